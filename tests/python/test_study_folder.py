"""The folder of a study: its content, its resume, and its state after a kill."""

import json
import math
import runpy
import signal
import subprocess
import sys
import textwrap
import time

import pandas as pd
import pyarrow as pa
import pyarrow.parquet
import pytest

import eft
from eft._study._arrow import arrow_array
from studies import COMMAND, GRID, RANGES, RIG, rows


def test_a_folder_is_read_by_pandas_and_carries_what_made_it(tmp_path):
    sampler = eft.studies.LatinHypercube(RANGES, n=5, seed=7)
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


def test_columns_of_the_folder_are_as_pyarrow_makes_them():
    for kind, values in [
        (pa.float64(), [1.0, None, math.nan, -0.0, 3]), (pa.int64(), [-(2**63), None, 2**63 - 1]),
        (pa.uint32(), [2**32 - 1, 0]), (pa.bool_(), [True, None, False] * 7), (pa.string(), ["", None, "µ"]),
        (pa.list_(pa.float64()), [[1.0, 2], None, [], [3.0, None]]),
    ]:  # fmt: skip
        for some in (values, values[1:2], []):
            made, wanted = arrow_array(some, kind), pa.array(some, kind)
            made.validate(full=True)
            assert made.type == kind and made.null_count == wanted.null_count
            assert repr(made.to_pylist()) == repr(wanted.to_pylist())
    with pytest.raises(OverflowError):
        arrow_array([-1], pa.uint32())
    with pytest.raises(TypeError):
        arrow_array([1.5], pa.int64())


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

    def study(folder):
        levels = {"compensation.level": [0.5 + i / 50 for i in range(25)]}
        return eft.study(eft.Rig.zhao2005(), command, levels, output=folder, chunk=1)

    if __name__ == "__main__":
        study(sys.argv[1])
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
    assert 3 <= len(kept) < 25
    assert [row["index"] for row in kept] == list(range(len(kept)))
    runpy.run_path(str(script))["study"](folder)
    whole = eft.Study.load(folder)
    assert whole.complete and rows(whole)[: len(kept)] == kept


def test_rows_of_other_tests_or_of_another_study_are_named(tmp_path):
    folders = [tmp_path / name for name in ("s", "other")]
    for folder, rig in zip(folders, (RIG, RIG.replace({"structure.mass": 7000.0})), strict=True):
        eft.study(rig, COMMAND, GRID, output=folder, chunk=2)
    part = folders[0] / "part-000001.parquet"
    for source, says in [
        (folders[0] / "part-000000.parquet", "begins with test 0, must begin with 2"),
        (folders[1] / "part-000001.parquet", "its rows are of another study"),
    ]:
        part.write_bytes(source.read_bytes())
        with pytest.raises(ValueError, match=f"part-000001.parquet: damaged; remove it.*{says}"):
            list(eft.Study.load(folders[0]))
    with pytest.raises(TypeError, match=r"^index = 1\.5: must be a whole number"):
        eft.Study.load(folders[1]).row(1.5)


def test_a_second_process_is_kept_out(tmp_path):
    seen = []

    def meanwhile(*_):
        with pytest.raises(ValueError, match="another process"):
            eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")
        seen.append(1)

    eft.study(RIG, COMMAND, GRID, output=tmp_path / "s", progress=meanwhile)
    assert seen
