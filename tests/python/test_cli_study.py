"""`eft study` and `eft map`: their files and output, and that no row is lost."""

import json
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pandas as pd
import pytest

import eft
from eft.cli import main

COMMAND = '[command]\nkind = "sweep"\namplitude = 8900.0\nf_start = 0.5\nf_end = 4.0\nduration = 1.0\n'
SWEEP = eft.sine_sweep(8900.0, 0.5, 4.0, 1.0, 4096.0)
RIG = eft.Rig.zhao2005()


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.toml").write_text(RIG.to_toml())
    return tmp_path


def written(folder, study, command=COMMAND):
    (folder / "s.toml").write_text(f'rig = "rig.toml"\n{command}{study}')
    return "s.toml"


def table():
    return list(eft.Study.load("s.study"))


@pytest.mark.parametrize(
    ("text", "parameters"),
    [
        (
            '[study.grid]\n"compensation.mode" = ["off", "linear"]\n'
            "structure.mass = { low = 7000, high = 7040, count = 3 }\n",
            {"compensation.mode": ["off", "linear"], "structure.mass": [7000.0, 7020.0, 7040.0]},
        ),
        (
            '[study.grid]\nstructure.mass = { low = "7 t", high = 7040, count = 3 }\n'
            'actuator.stroke = ["12 cm"]\n',
            {"structure.mass": [7000.0, 7020.0, 7040.0], "actuator.stroke": [0.12]},
        ),
        (
            '[study.grid]\n"actuator.leakage" = { low = 1e-13, high = 1e-11, count = 3, log = true }\n',
            {"actuator.leakage": np.geomspace(1e-13, 1e-11, 3)},
        ),
        (
            '[study.grid]\n"truth.structure.mass" = [7000, 9000.0]\ntruth.actuator.leakage = [0]\n',
            {"truth.structure.mass": [7000.0, 9000.0], "truth.actuator.leakage": [0.0]},
        ),
        (
            "[[study.list]]\nstructure.mass = 7000.0\n[[study.list]]\ncompensation.level = 0.9\n",
            [{"structure.mass": 7000.0}, {"compensation.level": 0.9}],
        ),
        (
            "[study.latin_hypercube]\nn = 5\nseed = 3\n[study.latin_hypercube.ranges]\n"
            '"structure.mass" = { low = 6e3, high = 8e3, log = true }\n'
            '"compensation.mode" = ["off", "linear"]\n',
            eft.studies.LatinHypercube(
                {"structure.mass": (6e3, 8e3, "log"), "compensation.mode": ["off", "linear"]}, n=5, seed=3
            ),
        ),
        (
            "[study.sobol]\nn = 4\nranges.structure.mass = { low = 6e3, high = 8e3 }\n",
            eft.studies.Sobol({"structure.mass": (6e3, 8e3)}, n=4),
        ),
    ],
)
def test_a_file_gives_the_study_of_the_call(folder, capsys, text, parameters):
    assert main(["study", written(folder, text)]) == 0
    assert table() == list(eft.study(RIG, SWEEP, parameters))
    assert "s.study written" in capsys.readouterr().out


def test_several_commands_and_options(folder):
    text = COMMAND.replace("[command]", "[commands.small]").replace("8900.0", "1000.0")
    text += COMMAND.replace("[command]", "[commands.large]")
    study = '[study]\ndtype = "f32"\ntraces = true\nfft = false\n[study.grid]\ncommand.scale = [1.0, 0.5]\n'
    assert main(["study", written(folder, study, text)]) == 0
    found = eft.Study.load("s.study")
    assert list(found["command"]) == ["small", "small", "large", "large"]
    assert found.run(3).dtype == "f32" and np.isnan(found["delay"]).all()
    assert (found.run(3).command == SWEEP.values * 0.5).all()


def test_json_and_table(folder, capsys):
    name = written(folder, "[study.grid]\nstructure.mass = [7040.0, -1.0]\n")
    assert main(["study", name, "--json", "--table", "rows.csv"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["status"] == {"completed": 1, "refused": 1} and answer["tests"] == 2
    assert answer["metrics"]["nrmse"]["largest"] == eft.simulate(RIG, SWEEP).metrics()["nrmse"]
    rows = pd.read_csv("rows.csv")
    assert list(rows["status"]) == ["completed", "refused"] and "structure.mass = -1" in rows["error"][1]


def test_the_summary_leaves_out_delays_that_are_unknown(folder, capsys):
    study = "[study.grid]\ncompensation.level = [0.9, 1.3]\nactuator.stroke = [10.0]\n"
    name = written(folder, study, COMMAND.replace("duration = 1.0", "duration = 6.0"))
    assert main(["study", name, "--json"]) == 0
    answer, found = json.loads(capsys.readouterr().out), eft.Study.load("s.study")
    assert (found["status"] == "completed").all()
    assert found["nrmse_delay_removed"][1] > 1.0 and np.isfinite(found["delay"][1])
    delay = answer["metrics"]["delay"]
    assert delay["largest"] == delay["median"] == found["delay"][0] and delay["test"] == 0


def test_the_file_that_init_writes_runs(folder, capsys):
    assert main(["init", "fresh.toml", "--study"]) == 0
    text = (folder / "fresh.toml").read_text().replace("duration = 32.0", "duration = 1.0")
    (folder / "fresh.toml").write_text(text)
    assert main(["study", "fresh.toml"]) == 0
    assert len(eft.Study.load("fresh.study")) == 10
    # Other commands read the rig and the command of a study file.
    assert main(["run", "fresh.toml"]) == 0


LONG = COMMAND.replace("duration = 1.0", "duration = 8.0")


def test_ctrl_c_keeps_the_chunks_that_are_done_and_the_command_goes_on(folder):
    name = written(
        folder, "[study.grid]\ncompensation.level = { low = 0.5, high = 1.0, count = 1024 }\n", LONG
    )
    call = [sys.executable, "-m", "eft", "study", name]
    process = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not list((folder / "s.study").glob("part-*")) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    kept = len(eft.Study.load("s.study"))
    assert 0 < kept < 1024
    assert f"{kept} of 1024 tests are kept in s.study" in said and "Traceback" not in said
    assert main(["study", name, "--set", "structure.mass=7000"]) == 2  # not of another rig


def test_ctrl_c_during_a_run_keeps_the_samples_that_are_done(folder, monkeypatch, capsys):
    (folder / "t.toml").write_text(
        'rig = "rig.toml"\n' + COMMAND.replace("duration = 1.0", "duration = 1000.0")
    )
    real, interrupt = eft.simulate, threading.Timer(0.01, signal.raise_signal, [signal.SIGINT])

    def interrupted(rig, command, dtype, progress=None):
        def watch(samples, total):
            progress(samples, total)
            if samples > 1000 and interrupt.ident is None:
                interrupt.start()

        return real(rig, command, dtype, progress=progress and watch)

    monkeypatch.setattr(eft, "simulate", interrupted)
    # Friction needs very short steps, so only few samples are simulated and written.
    slow = ["--set", "actuator.friction=2000", "--set", "actuator.friction_velocity=1e-5"]
    assert main(["run", "t.toml", *slow]) == 130
    assert "writing the finished part" in capsys.readouterr().err
    assert 1000 < len(eft.TestRun.load("t.eft")) < 1000 * 4096


def test_ctrl_c_while_a_test_is_written_is_held_back(folder, monkeypatch):
    (folder / "t.toml").write_text('rig = "rig.toml"\n' + COMMAND)
    real = eft.TestRun.save

    def interrupted(run, path):
        signal.raise_signal(signal.SIGINT)
        return real(run, path)

    monkeypatch.setattr(eft.TestRun, "save", interrupted)
    assert main(["run", "t.toml"]) == 130
    assert len(eft.TestRun.load("t.eft")) == 4096
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_a_map_as_picture_table_and_json(folder, capsys):
    axes = ["--x", "compensation.level", "0.9", "1.1", "3", "--y", "structure.damping", "1e3", "9e3", "2"]
    assert main(["map", *axes, "-o", "m.png", "-o", "m.csv", "-o", "m.json"]) == 0
    assert (folder / "m.png").read_bytes().startswith(b"\x89PNG")
    found = eft.linear.stability_map(
        RIG, ("compensation.level", [0.9, 1.0, 1.1]), ("structure.damping", [1e3, 9e3])
    )
    rows = pd.read_csv("m.csv")
    assert list(rows.columns) == ["compensation.level", "structure.damping", "growth_rate"]
    assert rows["growth_rate"].to_numpy() == pytest.approx(found.values.ravel())
    answer = json.loads((folder / "m.json").read_text())
    assert np.array(answer["values"]) == pytest.approx(found.values)
    assert f"stable at {found.stable.mean():.0%} of 6 points" in capsys.readouterr().out


def test_a_map_over_values_with_units_and_over_whole_numbers(folder, capsys):
    axes = ["--x", "structure.mass", "7 t", "7100", "3", "--y", "dac.delay", "0", "4", "3"]
    assert main(["map", *axes, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    masses, delays = [7000.0, 7050.0, 7100.0], [0, 2, 4]
    assert answer["horizontal"]["values"] == masses and answer["vertical"]["values"] == delays
    found = eft.linear.stability_map(RIG, ("structure.mass", masses), ("dac.delay", delays))
    assert np.array(answer["values"]) == pytest.approx(found.values)
    texts = ["7 t", "7050 kg", "71e5 g"]
    with pytest.raises(ValueError, match=r"structure\.mass = '71e5 g'"):
        eft.linear.stability_map(RIG, ("structure.mass", texts), ("dac.delay", delays))
    with pytest.raises(ValueError, match=r"dac\.delay = 1\.5"):
        eft.linear.stability_map(RIG, ("structure.mass", masses), ("dac.delay", [1.5]))


@pytest.mark.parametrize("key", ["truth.structure.mass", "actuator.attachment_stiffness"])
def test_a_map_over_a_value_that_the_rig_does_not_have(folder, key):
    low, high = {"truth.structure.mass": ("6 t", "8 t")}.get(key, ("1e7", "1e8"))
    axes = ["--x", key, low, high, "2", "--y", "compensation.level", "0.9", "1.1", "2"]
    assert main(["map", *axes, "-o", "m.png"]) == 0
    assert (folder / "m.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("kind", eft.linear.STABILITY_MAPS)
def test_the_named_maps(folder, kind, capsys):
    assert main(["map", "--rig", "rig.toml", "--kind", kind, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    found = eft.linear.STABILITY_MAPS[kind](RIG)
    values = np.array([[np.nan if v is None else v for v in row] for row in answer["values"]])
    np.testing.assert_array_equal(values, found.values)
    assert [path.name for path in folder.iterdir()] == ["rig.toml"]


def test_a_report_of_the_study_in_the_working_folder_is_beside_it(folder, monkeypatch):
    eft.study(RIG, SWEEP, {"compensation.level": [0.9, 1.0]}, output="s.study", progress=False)
    monkeypatch.chdir(folder / "s.study")
    assert main(["report", "."]) == 0
    assert "study" in (folder / "s.html").read_text(encoding="utf-8").lower()
