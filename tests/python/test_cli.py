"""The command line with valid input: its output, its files and its exit codes."""

import json
import re
import sys
import warnings

import numpy as np
import pytest

import eft
from eft.cli import main
from eft.traces import read_traces

pytestmark = pytest.mark.usefixtures("quick_pictures")

SWEEP = ["--sweep", "2000", "0", "10", "4", "--sample-rate", "1024"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_command_explains_itself_with_an_example(capsys):
    assert main(["--help"]) == 0
    commands = capsys.readouterr().out.split("Commands:")[1].split()[::1]
    for command in (
        "init",
        "check",
        "run",
        "study",
        "map",
        "report",
        "compare",
        "identify",
        "export",
        "demo",
    ):
        assert command in commands
        assert main([command, "--help"]) == 0
        assert f"  eft {command}" in capsys.readouterr().out.split("Examples:")[1]


def test_version_is_that_of_the_package(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"eft {eft.__version__}\n"


def test_init_writes_the_rig_of_the_paper_and_keeps_what_is_there(folder, capsys):
    assert main(["init"]) == 0
    assert eft.Rig.from_toml(folder / "rig.toml") == eft.Rig.zhao2005()
    (folder / "rig.toml").write_text("mine")
    assert main(["init"]) == 2
    assert (folder / "rig.toml").read_text() == "mine"
    assert main(["init", "--force"]) == 0
    assert eft.Rig.from_toml(folder / "rig.toml") == eft.Rig.zhao2005()


def test_a_fresh_test_file_runs_the_sweep_of_the_paper(folder, capsys):
    assert main(["init", "test.toml", "--test"]) == 0
    assert main(["run", "test.toml"]) == 0
    run = eft.TestRun.load(folder / "test.eft")
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0)
    assert (run.force == eft.simulate(eft.Rig.zhao2005(), command).force).all()
    said = capsys.readouterr().out
    assert "5.89%" in said and "54.9%" in said


@pytest.mark.parametrize(
    ("command", "says"),
    [
        (["--sweep", "8896.4", "1", "2", "1"], ("of 8.896 kN", "of 2 kip")),
        (["--record", "elcentro", "--scale", "0.1"], ("of 2.75 m/s²", "of 0.281 g")),
    ],
)
def test_the_command_is_shown_in_the_chosen_units(command, says, folder, capsys):
    for units, text in zip(("si", "us"), says, strict=True):
        assert main(["check", *command, "--units", units]) in (0, 1)
        assert text in capsys.readouterr().out.splitlines()[0]


def test_json_is_the_metrics_of_the_run(folder, capsys):
    assert main(["run", *SWEEP, "--set", "compensation.mode=linear", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    run = eft.TestRun.load(folder / "run.eft")
    assert run.rig["compensation.mode"] == "linear"
    assert answer["metrics"] == pytest.approx(dict(run.metrics()))
    assert (answer["samples"], answer["sample_rate"], answer["success"]) == (4096, 1024.0, True)


def test_a_test_file_may_name_its_rig_and_a_record_beside_it(folder):
    (folder / "sub").mkdir()
    rig = eft.Rig.zhao2005().replace({"structure.mass": 5000.0})
    (folder / "sub" / "mine.toml").write_text(rig.to_toml())
    lines = [f"{0.01 * i:.2f},{0.5 if 50 <= i < 70 else 0.0}" for i in range(200)]
    (folder / "sub" / "pulse.csv").write_text("time (s),acceleration (m/s2)\n" + "\n".join(lines) + "\n")
    (folder / "sub" / "test.toml").write_text(
        'rig = "mine.toml"\n[command]\nkind = "record"\nfile = "pulse.csv"\nscale = 2.0\n'
    )
    assert main(["run", "sub/test.toml", "-o", "out.eft"]) == 0
    run = eft.TestRun.load(folder / "out.eft")
    assert run.rig == rig
    assert main(["map", "--rig", "sub/test.toml", "-o", "map.json"]) == 0
    assert np.abs(run.command).max() == pytest.approx(5000.0 * 0.5 * 2.0)


@pytest.mark.parametrize("suffix", [".csv", ".h5", ".parquet"])
def test_what_is_written_for_others_reads_back(folder, suffix, capsys):
    assert main(["run", *SWEEP]) == 0
    assert main(["run", *SWEEP, "-o", f"out{suffix}"]) == 0
    run = eft.TestRun.load(folder / "run.eft")
    traces = read_traces(folder / f"out{suffix}")
    assert traces.sample_rate == pytest.approx(run.sample_rate, rel=1e-6)
    for name in ("command", "force", "displacement", "spool", "measured_supply_pressure"):
        scale = np.abs(getattr(run, name)).max()
        assert np.abs(traces.columns[name] - getattr(run, name)).max() <= 1e-8 * scale


def test_compare_finds_the_gain_and_the_lag_it_was_given(folder, capsys):
    time = np.arange(4000) / 1000.0
    force = 1e3 * np.sin(2 * np.pi * 2.0 * time) * np.sin(np.pi * time / 4.0)
    late = 1.1 * np.interp(time - 0.010, time, force)
    np.savetxt("a.csv", np.c_[time, force / 4448.2216152605], "%.12g", ",", header="Time (s),Load [kip]")
    np.savetxt("b.csv", np.c_[time * 1e3, late / 1e3], "%.12g", ",", header="t_ms,force_kN", comments="")
    text = (folder / "a.csv").read_text()
    (folder / "a.csv").write_text(text.removeprefix("# "))
    assert main(["compare", "a.csv", "b.csv", "--json"]) == 0
    (signal,) = json.loads(capsys.readouterr().out)["signals"]
    assert signal["quantity"] == "force"
    assert signal["peak"] / signal["reference_peak"] == pytest.approx(1.1, rel=1e-3)
    assert signal["delay"] == pytest.approx(0.010, abs=2e-4)


def test_compare_of_a_run_with_itself_is_zero(capsys):
    assert main(["run", *SWEEP, "-o", "a.eft"]) == 0
    capsys.readouterr()
    assert main(["compare", "a.eft", "a.eft", "--json"]) == 0
    for signal in json.loads(capsys.readouterr().out)["signals"]:
        assert signal["nrmse"] == 0.0 and signal["peak_error"] == 0.0, signal["quantity"]


def test_a_name_that_the_font_of_a_figure_lacks_is_no_warning(capsys):
    assert main(["run", *SWEEP, "-o", "力.eft"]) == 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main(["compare", "力.eft", "力.eft", "--plot", "力.png"]) == 0


@pytest.fixture
def interrupted(monkeypatch):
    """Ctrl-C after 1500 samples of the next test; the lengths of all tests."""
    simulate, calls = eft.simulate, []

    def stopped(rig, command, dtype, progress=None):
        calls.append(len(command))
        if progress:
            progress(1500, len(command))
            raise KeyboardInterrupt
        return simulate(rig, command, dtype)

    monkeypatch.setattr(eft, "simulate", stopped)
    return calls


def test_an_interrupted_run_keeps_its_samples_bit_for_bit(folder, interrupted, monkeypatch, capsys):
    assert main(["run", *SWEEP]) == 130
    monkeypatch.undo()
    whole = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.0, 10.0, 4.0, 1024.0))
    kept = eft.TestRun.load(folder / "run.eft")
    assert interrupted == [4096, 1500]
    assert (kept.force == whole.force[:1500]).all()
    assert kept.interrupted and kept.message.startswith("interrupted after 1.46")
    assert not whole.interrupted
    said = capsys.readouterr()
    assert "interrupted" in said.err and "on zhao2005: interrupted after 1.46" in said.out


def test_an_interrupted_run_with_a_soft_end_keeps_its_samples(folder, interrupted, monkeypatch):
    soft = ["protection.enabled=true", "protection.soft_end=true", "protection.ramp_time=0.5"]
    settings = [word for one in soft for word in ("--set", one)]
    assert main(["run", *SWEEP, *settings]) == 130
    monkeypatch.undo()
    kept = eft.TestRun.load(folder / "run.eft")
    whole = eft.simulate(kept.rig, eft.sine_sweep(2000.0, 0.0, 10.0, 4.0, 1024.0))
    assert len(kept) == 1500 and kept.rig["protection.soft_end"]
    assert (kept.force == whole.force[:1500]).all()


def test_an_interrupted_run_of_a_building_keeps_its_samples(folder, interrupted):
    assert main(["run", "--record", "elcentro", "--scale", "0.3", *BUILDING]) == 130
    kept = eft.TestRun.load(folder / "run.eft")
    assert interrupted[1:] == [1500] and kept.force.shape == (2, 1500)
    assert kept.scale == 0.3


def test_a_rig_that_leaves_its_stroke_ends_with_exit_code_1(capsys):
    assert main(["run", *SWEEP, "--set", "compensation.level=2.0"]) == 1
    said = capsys.readouterr().out
    assert "left its stroke" in said and "on zhao2005: stroke_exceeded after " in said


def test_more_than_the_valve_has_is_no_test_where_the_force_misses(capsys):
    large = ["--sweep", "30000", "0", "10", "4", "--sample-rate", "1024", "--set", "actuator.stroke=1.0"]
    assert main(["run", *large]) == 1
    out = capsys.readouterr().out
    assert re.search(r"valve's capacity in [\d.]+% of the samples", out)


def test_an_oscillating_loop_ends_with_exit_code_1(folder, capsys):
    swings = ["--set", "controller.proportional_gain=10"]
    assert main(["run", *SWEEP, *swings]) == 1
    said = capsys.readouterr().out
    run = eft.TestRun.load(folder / "run.eft")
    assert not run.flags & (eft.Status.STROKE_EXCEEDED | eft.Status.DIVERGED)
    error = run.metrics()["nrmse"]
    assert error > 1 and f"{error:.0%} (rms)" in said
    assert f"{np.abs(run.force).max() / 1e3:.4g} kN" in said and "2 kN" in said
    assert "the spool at its stop in" in said
    # No delay explains such a force.
    assert next(line for line in said.splitlines() if line.startswith("delay")).endswith(" –")


def test_a_test_that_tripped_is_not_called_completed_and_is_judged_until_then(folder, capsys):
    tripping = ["--set", "protection.enabled=true", "--set", "protection.force_trip=1900"]
    assert main(["run", *SWEEP, *tripping, "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    run = eft.TestRun.load(folder / "run.eft")
    first = int(((run.status & eft.Status.TRIPPED) != 0).argmax())
    assert 0 < first < len(run) and answer["judged_samples"] == first
    assert answer["message"].startswith(f"tripped after {first / 1024:.6g} s; ")
    error = np.sqrt(np.mean((run.force - run.command)[:first] ** 2) / np.mean(run.command[:first] ** 2))
    assert answer["metrics"]["nrmse"] == pytest.approx(error, rel=1e-9)
    assert run.metrics()["nrmse"] > 2 * error, "all samples judge a force that was taken away"
    assert (
        f"In the {first / 1024:.4g} s before, the force misses the command by {error:.1%}"
        in answer["verdict"]
    )
    assert main(["run", *SWEEP, *tripping]) == 1
    assert f"until it ended, after {first / 1024:.4g} s:" in capsys.readouterr().out


BUILDING = [
    "--set", "structure.kind=shear_building", "--set", "structure.stories.masses=[7e3, 6e3]",
    "--set", "structure.stories.dampings=[5e3, 4e3]", "--set", "structure.stories.stiffnesses=[2.6e6, 2.3e6]",
]  # fmt: skip


def test_a_building_is_run_floor_by_floor_and_reported(tmp_path, capsys):
    time = np.arange(0.0, 4.0, 0.01)
    np.savetxt(
        tmp_path / "a.csv",
        np.c_[time, np.sin(9 * time)],
        delimiter=",",
        header="time (s),acceleration (m/s2)",
        comments="",
    )
    arguments = ["run", "--record", str(tmp_path / "a.csv"), "--scale", "0.3", *BUILDING]
    assert main(arguments) == 0
    assert "floor 1  floor 2" in capsys.readouterr().out
    assert main([*arguments, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["metrics"]["nrmse"] == list(eft.TestRun.load("run.eft").metrics()["nrmse"])
    assert main(["report", "run.eft"]) == 0


def test_check_and_map_take_a_building(folder, capsys):
    assert main(["check", "--record", "elcentro", "--scale", "0.3", *BUILDING]) == 0
    assert "compensation level" in capsys.readouterr().out
    assert main(["map", *BUILDING, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["vertical"]["key"] == "compensation.response_delay"


def test_map_and_export_take_the_rig_of_a_test(folder, capsys):
    assert main(["init", "test.toml", "--test"]) == 0
    assert main(["export", "test.toml", "--target", "c"]) == 0
    assert (folder / "test.h").read_text() == eft.firmware.export(eft.Rig.zhao2005(), "c")
    axes = ["--x", "compensation.level", "0.9", "1.1", "3", "--y", "structure.damping", "1", "9", "2"]
    for which in (["test.toml"], ["--rig", "test.toml"], []):
        assert main(["map", *which, *axes, "-o", "map.csv"]) == 0
        assert len((folder / "map.csv").read_text().splitlines()) == 7


def test_a_missing_package_is_named_with_its_extra(folder, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "h5py", None)
    (folder / "a.h5").write_bytes(b"")
    assert main(["compare", "a.h5", "a.h5"]) == 2
    needs = "needs the package {}, which is not installed: pip install 'effective-force-testing[{}]'\n"
    assert capsys.readouterr().err == "eft compare: " + needs.format("h5py", "files")
    assert main(["init", "a.toml", "--study"]) == 0
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    capsys.readouterr()
    assert main(["study", "a.toml"]) == 2
    assert capsys.readouterr().err.endswith("eft study: " + needs.format("pyarrow", "study"))


def test_a_factor_without_a_limit_is_any(folder, capsys):
    assert main(["check", "--record", "elcentro", "--scale", "0", "--largest"]) == 0
    assert (
        "largest factor on this command with a usable test on the virtual rig: any" in capsys.readouterr().out
    )
