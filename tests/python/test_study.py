"""`eft.study`: which rows there are, what stands in them, and that nothing is lost."""

import itertools
import json
import math
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest

import eft

RIG = eft.Rig.zhao2005()
COMMAND = eft.sine_sweep(amplitude=8900.0, f_start=0.5, f_end=4.0, duration=1.0, sample_rate=1024.0)
GRID = {"compensation.mode": ["off", "linear", "nonlinear"], "servovalve.flow_gain_scale": [0.95, 1.0]}


def rows(study):
    return list(study)


def test_a_grid_has_every_value_with_every_other_and_the_metrics_of_each_run():
    study = eft.study(RIG, COMMAND, GRID)
    expected = list(itertools.product(*GRID.values()))
    assert len(study) == 6 and study.complete and study.parameters == tuple(GRID)
    for number, (row, (mode, scale)) in enumerate(zip(study, expected, strict=True)):
        run = eft.simulate(
            RIG.replace({"compensation.mode": mode, "servovalve.flow_gain_scale": scale}), COMMAND
        )
        assert (row["index"], row["compensation.mode"], row["servovalve.flow_gain_scale"]) == (
            number,
            mode,
            scale,
        )
        assert {name: row[name] for name in run.metrics()} == {
            name: None if math.isnan(value) else value for name, value in run.metrics().items()
        }
        assert (row["status"], row["error"], row["flags"], row["samples"]) == (
            "completed", None, int(run.flags), len(run),
        )  # fmt: skip


def test_the_columns_of_metrics_are_the_metrics_of_a_run():
    study = eft.study(RIG, COMMAND, [{}])
    numbers = [c.name for c in study.columns if c.type == "float"]
    assert numbers == list(eft.simulate(RIG, COMMAND).metrics())
    assert tuple(rows(study)[0]) == tuple(c.name for c in study.columns)


def test_several_commands_and_their_scale_are_axes_too():
    half = eft.Command(COMMAND.values * 0.5, COMMAND.sample_rate)
    study = eft.study(RIG, {"whole": COMMAND, "half": half}, {"command.scale": [1.0, 0.5]})
    assert [(r["command"], r["command.scale"]) for r in study] == [
        ("whole", 1.0), ("whole", 0.5), ("half", 1.0), ("half", 0.5),
    ]  # fmt: skip
    by_scale, by_name = study.row(1), study.row(2)
    assert by_scale["nrmse"] == by_name["nrmse"] != study.row(0)["nrmse"]


def test_a_list_fills_in_what_a_combination_does_not_name():
    study = eft.study(RIG, COMMAND, [{"structure.damping": 5000}, {"compensation.level": np.float64(0.9)}])
    assert list(study["structure.damping"]) == [5000.0, RIG["structure.damping"]]
    assert list(study["compensation.level"]) == [RIG["compensation.level"], 0.9]
    assert study.rig(1) == RIG.replace({"compensation.level": 0.9})


RANGES = {
    "servovalve.flow_gain_scale": (0.9, 1.1),
    "actuator.leakage": (1e-13, 1e-11, "log"),
    "compensation.mode": ["linear", "nonlinear"],
}


def test_a_latin_hypercube_visits_every_part_once():
    study = eft.study(RIG, COMMAND, eft.LatinHypercube(RANGES, n=8, seed=3))
    parts = np.floor((study["servovalve.flow_gain_scale"] - 0.9) / 0.2 * 8).astype(int)
    assert sorted(parts) == list(range(8))
    logs = np.floor((np.log10(study["actuator.leakage"]) + 13) / 2 * 8).astype(int)
    assert sorted(logs) == list(range(8))
    assert sorted(study["compensation.mode"]) == ["linear"] * 4 + ["nonlinear"] * 4
    again = eft.study(RIG, COMMAND, eft.LatinHypercube(RANGES, n=8, seed=3))
    other = eft.study(RIG, COMMAND, eft.LatinHypercube(RANGES, n=8, seed=4))
    assert rows(again) == rows(study) != rows(other)


def test_sobol_points_are_those_of_scipy():
    from scipy.stats import qmc

    study = eft.study(RIG, COMMAND, eft.Sobol({"structure.damping": (1e3, 9e3)}, n=4, seed=5))
    points = qmc.Sobol(1, seed=np.random.default_rng(5)).random(4)[:, 0]
    assert study["structure.damping"] == pytest.approx(1e3 + 8e3 * points, rel=1e-15)


def test_a_combination_that_fails_is_a_row_with_its_reason_and_loses_no_other():
    study = eft.study(
        RIG,
        COMMAND,
        {"structure.mass": [7040.0, -1.0], "actuator.stroke": [RIG["actuator.stroke"], 1e-3]},
    )
    assert [row["status"] for row in study] == ["completed", "stroke_exceeded", "refused", "refused"]
    assert "structure.mass = -1" in study.row(2)["error"]
    assert "left its stroke" in study.row(1)["error"] and study.row(1)["nrmse"] > 0
    assert study.row(2)["nrmse"] is None and np.isnan(study["nrmse"][2])
    assert study.count() == {"completed": 1, "refused": 2, "stroke_exceeded": 1}


def test_a_diverged_test_says_so():
    study = eft.study(RIG, COMMAND, {"compensation.level": [1.0, 3.0], "structure.damping": [0.0]})
    words = set(study["status"])
    assert words <= {"completed", "diverged", "stroke_exceeded"} and study.row(1)["status"] != "completed"


SIGNALS = ("force", "velocity", "displacement", "spool", "supply_pressure")
MANY = {f"sensors.{signal}.bits": range(1, 33) for signal in SIGNALS} | {"structure.mass": range(1, 33)}


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"structure.mas": [1.0]}, ["structure.mas", "`structure.mass`"]),
        ({"command.scal": [1.0]}, ["command.scal", "`command.scale`"]),
        ({"structure": [{}]}, ["`structure` is a section", "structure."]),
        ({"structure.mass": []}, ["structure.mass", "empty"]),
        ({"structure.mass": 7040.0}, ["structure.mass", "list of values"]),
        ({"structure.mass": ["heavy"]}, ["structure.mass'][0] = 'heavy'", "number"]),
        ({"compensation.mode": [1]}, ["compensation.mode", "string"]),
        ({"sensors.seed": [1.5]}, ["sensors.seed", "1.5", "whole number"]),
        ({3: [1.0]}, ["3", "string"]),
        ([], ["empty"]),
        ([1], ["parameters[0] = 1", "mapping"]),
        ("structure.mass", ["'structure.mass'", "sampler"]),
        (MANY, ["1073741824 combinations", "at most"]),
    ],
)
def test_what_is_wrong_with_all_is_said_before_anything_runs(parameters, words):
    with pytest.raises(ValueError, match=r".") as caught:
        eft.study(RIG, COMMAND, parameters)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: eft.Sobol({"structure.mass": (1, 2)}, n=100), ["n = 100", "64 or 128"]),
        (lambda: eft.LatinHypercube({}, n=3), ["ranges"]),
        (lambda: eft.LatinHypercube({"structure.mass": (1, 2)}, n=0), ["n = 0", "whole number from 1"]),
        (lambda: eft.LatinHypercube({"structure.mass": (1, 2)}, n=3, seed=-1), ["seed = -1"]),
        (lambda: eft.LatinHypercube({"structure.mass": (2, 1)}, n=3), ["structure.mass", "below"]),
        (lambda: eft.LatinHypercube({"structure.mass": (0, 1, "log")}, n=3), ["above zero"]),
        (lambda: eft.LatinHypercube({"structure.mass": (0, 1, "lin")}, n=3), ['"log"']),
        (lambda: eft.LatinHypercube({"compensation.mode": (0, 1)}, n=3), ["compensation.mode", "choices"]),
        (lambda: eft.LatinHypercube({"sensors.seed": (0, 9)}, n=3), ["sensors.seed", "choices"]),
    ],
)
def test_samplers_refuse_what_they_cannot_draw(make, words):
    with pytest.raises(ValueError, match=r".") as caught:
        eft.study(RIG, COMMAND, make())
    for word in words:
        assert word in str(caught.value)


def test_traces_are_kept_on_request_only(tmp_path):
    grid = {"compensation.level": [0.9, 1.0], "structure.mass": [7040.0, -1.0]}
    expected = eft.simulate(RIG.replace({"compensation.level": 1.0}), COMMAND).force
    for output in (None, tmp_path / "kept"):
        kept = eft.study(RIG, COMMAND, grid, traces=True, output=output)
        assert (kept.run(2).force == expected).all()
        with pytest.raises(ValueError, match=r"structure\.mass"):
            kept.run(1)
    assert len(list((tmp_path / "kept" / "_traces").iterdir())) == 2
    with pytest.raises(ValueError, match="traces=True"):
        eft.study(RIG, COMMAND, grid).run(0)


def test_progress_counts_up_to_the_total():
    seen = []
    eft.study(RIG, COMMAND, GRID, chunk=4, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(4, 6), (6, 6)]


def test_a_building_has_one_row_with_its_worst_floor():
    stories = {"masses": [7e3, 6e3], "dampings": [5e3, 4e3], "stiffnesses": [2.6e6, 2.3e6]}
    rig = RIG.replace({"structure.kind": "shear_building", "structure.stories": stories})
    command = eft.Command(np.stack([COMMAND.values * 0.2, COMMAND.values * 0.1]), COMMAND.sample_rate)
    study = eft.study(rig, command, {"compensation.level": [0.9, -1.0]}, traces=True)
    run = eft.simulate(rig.replace({"compensation.level": 0.9}), command)
    assert study.row(0)["nrmse"] == run.metrics()["nrmse"].max()
    assert study.row(1)["status"] == "refused" and (study.run(0).force == run.force).all()


# --- folders ---


def test_a_folder_is_read_by_pandas_and_carries_what_made_it(tmp_path):
    sampler = eft.LatinHypercube(RANGES, n=5, seed=7)
    study = eft.study(RIG, COMMAND, sampler, output=tmp_path / "s", chunk=2)
    table = pd.read_parquet(tmp_path / "s")
    pd.testing.assert_frame_equal(
        table.astype(object).where(table.notna(), None),
        pd.DataFrame(rows(study), dtype=object).where(lambda frame: frame.notna(), None),
        check_dtype=False,
    )
    schema = pyarrow.parquet.read_schema(tmp_path / "s" / "part-000001.parquet")
    metadata = {key.decode(): value.decode() for key, value in schema.metadata.items()}
    assert metadata["eft.version"] == eft.__version__ and metadata["eft.seed"] == "7"
    assert len(metadata["eft.configuration"]) == 64
    assert eft.Rig.from_dict(json.loads(metadata["eft.rig"])) == RIG
    assert schema.field("actuator.leakage").metadata[b"doc"]
    assert schema.field("delay").metadata[b"unit"] == b"s"
    assert rows(eft.Study.load(tmp_path / "s")) == rows(study) == rows(eft.study(RIG, COMMAND, sampler))


def test_a_resumed_study_computes_only_what_is_missing(tmp_path):
    whole = rows(eft.study(RIG, COMMAND, GRID, output=tmp_path / "s", chunk=2))
    (tmp_path / "s" / "part-000001.parquet").unlink()
    (tmp_path / "s" / ".part-000001-half.parquet").write_text("half")
    partial = eft.Study.load(tmp_path / "s")
    assert (len(partial), partial.complete, [r["index"] for r in partial]) == (4, False, [0, 1, 4, 5])
    assert "2 to come" in repr(partial)
    with pytest.raises(IndexError, match="not run yet"):
        partial.row(2)
    stamps = {part: part.stat().st_mtime_ns for part in (tmp_path / "s").glob("part-*")}
    seen = []
    study = eft.study(RIG, COMMAND, GRID, output=tmp_path / "s", progress=lambda *at: seen.append(at))
    assert rows(study) == whole and study.complete
    assert seen == [(6, 6)]
    assert {part: part.stat().st_mtime_ns for part in stamps} == stamps
    assert not list((tmp_path / "s").glob(".part*"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rig": RIG.replace({"structure.damping": 5e3})}, ["rig.structure.damping", "5000.0 here"]),
        ({"command": eft.Command(COMMAND.values * 2, 1024.0)}, ["commands.command.sha256"]),
        ({"command": {"other": COMMAND}}, ["commands.other is only here"]),
        ({"parameters": GRID | {"compensation.mode": ["off"]}}, ["parameters.values.compensation.mode"]),
        ({"parameters": [{}]}, ["parameters.kind", "'list' here"]),
        ({"dtype": "f32"}, ["dtype is 'f64' there, 'f32' here"]),
        ({"traces": True}, ["traces"]),
    ],
)
def test_another_configuration_is_refused_naming_what_differs(tmp_path, change, words):
    eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")
    before = {path: path.read_bytes() for path in (tmp_path / "s").iterdir()}
    arguments = {"rig": RIG, "command": COMMAND, "parameters": GRID} | change
    with pytest.raises(ValueError, match="cannot be resumed") as caught:
        eft.study(**arguments, output=tmp_path / "s")
    for word in words:
        assert word in str(caught.value)
    assert {path: path.read_bytes() for path in (tmp_path / "s").iterdir()} == before


def test_another_version_is_refused(tmp_path):
    eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")
    about = tmp_path / "s" / "_study.json"
    about.write_text(about.read_text().replace(f'"version": "{eft.__version__}"', '"version": "0.0.9"'))
    with pytest.raises(ValueError, match=r"version is '0\.0\.9' there"):
        eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("words")
    with pytest.raises(ValueError, match="other files"):
        eft.study(RIG, COMMAND, GRID, output=tmp_path)
    with pytest.raises(ValueError, match="not a study"):
        eft.Study.load(tmp_path)
    with pytest.raises(NotADirectoryError):
        eft.study(RIG, COMMAND, GRID, output=tmp_path / "thesis.tex")


def test_damaged_files_are_named(tmp_path):
    eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")
    part = tmp_path / "s" / "part-000000.parquet"
    part.write_bytes(part.read_bytes()[:100])
    with pytest.raises(ValueError, match=r"part-000000\.parquet: damaged"):
        eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")
    (tmp_path / "s" / "_study.json").write_text("{")
    with pytest.raises(ValueError, match=r"_study\.json: damaged"):
        eft.Study.load(tmp_path / "s")


STUDY = textwrap.dedent("""
    import sys, eft
    command = eft.sine_sweep(amplitude=8900.0, f_start=0.5, f_end=4.0, duration=8.0, sample_rate=2048.0)
    eft.study(eft.Rig.zhao2005(), command, {"compensation.level": [0.5 + i / 100 for i in range(50)]},
              output=sys.argv[1], chunk=1)
""")


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_kill_loses_at_most_the_chunk_in_flight(tmp_path, how):
    script = tmp_path / "study.py"
    script.write_text(STUDY)
    folder = tmp_path / "s"
    process = subprocess.Popen([sys.executable, script, folder], stderr=subprocess.PIPE)
    deadline = time.monotonic() + 60
    while len(list(folder.glob("part-*"))) < 3 and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(how)
    process.communicate(timeout=60)
    assert process.returncode != 0, "the study ended before it was interrupted"
    kept = rows(eft.Study.load(folder))
    assert 3 <= len(kept) < 50
    assert [row["index"] for row in kept] == list(range(len(kept)))
    subprocess.run([sys.executable, script, folder], check=True, timeout=120)
    whole = eft.Study.load(folder)
    assert whole.complete and rows(whole)[: len(kept)] == kept


def test_a_second_process_is_kept_out(tmp_path):
    seen = []

    def meanwhile(*_):
        with pytest.raises(ValueError, match="another process"):
            eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")
        seen.append(1)

    eft.study(RIG, COMMAND, GRID, output=tmp_path / "s", progress=meanwhile)
    assert seen


# --- executors ---


@pytest.mark.parametrize("workers", [1, 2, 3])
@pytest.mark.parametrize("pool", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_rows_are_the_same_whatever_the_engine(pool, workers, tmp_path):
    here = rows(eft.study(RIG, COMMAND, GRID))
    with pool(workers) as executor:
        study = eft.study(RIG, COMMAND, GRID, executor=executor, chunk=1, output=tmp_path / "s")
    assert rows(study) == here


class Treacherous(Executor):
    """Breaks on some tests, whatever they come with."""

    def __init__(self, bad, error):
        self.bad, self.error = bad, error

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        if self.bad & {test.index for test in args[0].tests}:
            future.set_exception(self.error)
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def test_a_test_that_takes_its_worker_along_loses_no_other(tmp_path):
    here = rows(eft.study(RIG, COMMAND, GRID))
    executor = Treacherous({4}, RuntimeError("worker died"))
    study = eft.study(RIG, COMMAND, GRID, executor=executor, chunk=3, output=tmp_path / "s")
    assert [r["status"] for r in study] == ["completed"] * 4 + ["failed", "completed"]
    assert study.row(4)["error"] == "RuntimeError: worker died"
    assert [r for r in study if r["index"] != 4] == [r for r in here if r["index"] != 4]
    # What failed by accident is tried again.
    assert rows(eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")) == here


def test_a_broken_pool_ends_the_study_and_keeps_what_was_done(tmp_path):
    executor = Treacherous({4}, BrokenProcessPool("gone"))
    with pytest.raises(BrokenProcessPool):
        eft.study(RIG, COMMAND, GRID, executor=executor, chunk=1, output=tmp_path / "s")
    assert len(eft.Study.load(tmp_path / "s")) > 0
    assert rows(eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")) == rows(eft.study(RIG, COMMAND, GRID))


def test_a_worker_of_another_version_is_an_error(monkeypatch):
    monkeypatch.setattr("eft._study._rows.__version__", "0.0.9")
    with pytest.raises(Exception, match=r"0\.0\.9 on the worker: must be"):
        eft.study(RIG, COMMAND, GRID, executor=Treacherous(set(), None))


def test_memory_does_not_grow_with_the_number_of_tests(tmp_path):
    script = tmp_path / "study.py"
    script.write_text(
        textwrap.dedent("""
        import resource, sys, eft
        command = eft.sine_sweep(amplitude=8900.0, f_start=0.5, f_end=4.0, duration=2.0, sample_rate=1024.0)
        def run(n):
            levels = [0.5 + i / 10000 for i in range(n)]
            folder = f"{sys.argv[1]}/{n}"
            eft.study(eft.Rig.zhao2005(), command, {"compensation.level": levels}, output=folder, chunk=16)
            return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        few = run(64)
        print(few, run(640))
    """)
    )
    done = subprocess.run(
        [sys.executable, script, tmp_path], check=True, timeout=120, capture_output=True, text=True
    )
    few, many = map(int, done.stdout.split())
    # 576 more runs of 2048 samples and 18 traces would be 170 MB.
    assert many - few < 20_000, (few, many)


def test_the_repr_tells_how_it_went():
    assert repr(eft.study(RIG, COMMAND, GRID)) == (
        "<eft.Study over compensation.mode, servovalve.flow_gain_scale: 6 completed>"
    )


def test_the_page_shows_every_column_as_it_is():
    page = (Path(__file__).resolve().parents[2] / "docs" / "studies.md").read_text(encoding="utf-8")
    types = {"int": "int64", "flags": "uint32", "float": "double", "str": "string"}
    for column in eft.study(RIG, COMMAND, [{}]).columns:
        unit = f" {column.unit} " if column.unit else " "
        assert f"| `{column.name}` | {types[column.type]} |{unit}| {column.doc} |" in page
