"""`eft check`: its verdict, its output and its exit codes."""

import dataclasses
import json
import re

import pytest

import eft
from eft.cli import main

pytestmark = pytest.mark.usefixtures("quick_pictures")

SWEEP = ["--sweep", "2000", "0", "10", "4", "--sample-rate", "1024"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_check_gives_the_verdict_of_the_library_and_the_test_on_the_virtual_rig(folder, capsys):
    rig = eft.Rig.zhao2005()
    command = eft.sine_sweep(2000.0, 0.0, 10.0, 4.0, 1024.0)
    assert main(["check", *SWEEP, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    found = eft.check_feasibility(rig, command)
    told = json.loads(json.dumps(dataclasses.asdict(found)))
    assert answer | told == answer and found.verdict == "go"
    assert answer["margins"]["level"] == pytest.approx(
        eft.stability_margin(rig, sampled=True, sample_rate=1024.0, flow_gain="steeper")
    )
    assert answer["metrics"] == pytest.approx(dict(eft.simulate(rig, command).metrics()))
    assert main(["check", *SWEEP]) == 0
    assert re.search(
        rf"sample rate, Hz +1024 +safe from {found.smallest_sample_rate:.0f}", capsys.readouterr().out
    )
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(("amplitude", "rate"), [(4000.0, 1800.0), (6000.0, 2400.0)])
def test_check_gives_the_worse_verdict_of_before_the_test_and_after_it(amplitude, rate, folder, capsys):
    changes = {
        "compensation.mode": "linear",
        "controller.force_loop": "robust",
        "compensation.feedforward": True,
        "compensation.look_ahead": True,
    }
    rig, command = eft.Rig.zhao2005().replace(changes), eft.sine_sweep(amplitude, 0.0, 10.0, 8.0, rate)
    before, after = eft.check_feasibility(rig, command), eft.simulate(rig, command).verdict
    assert (before.verdict, after.grade) == ("caution", "go")
    (folder / "linear.toml").write_text(rig.to_toml(), encoding="utf-8")
    sweep = [
        "--rig",
        "linear.toml",
        "--sweep",
        f"{amplitude:g}",
        "0",
        "10",
        "8",
        "--sample-rate",
        f"{rate:g}",
    ]
    assert main(["check", *sweep, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["verdict"] == "caution"
    assert set(answer["reasons"]) == {*before.reasons, *after.reasons}
    assert main(["check", *sweep]) == 0
    said = capsys.readouterr().out.split("\nCaution:\n")[1]
    assert all(reason in said for reason in before.reasons)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ("compensation.level=2.0", "the loop is unstable at 4096"),
        ("controller.proportional_gain=10", "no compensation level from 0 to 10 makes the loop stable"),
        ("actuator.stroke=0.05", "displacement exceeds"),
    ],
)
def test_check_says_no_and_why(change, why, capsys):
    assert main(["check", "--sweep", "20000", "0", "10", "4", "--set", change]) == 1
    said = capsys.readouterr().out.split("\nNo:\n")[1]
    assert why in said.lower()


def test_check_lets_the_virtual_test_decide_on_a_rig_that_calibrates_itself(capsys):
    command = ["--sweep", "2000", "0", "10", "8"]
    off = ["--set", "servovalve.flow_gain_scale=1.05", "--set", "compensation.feedforward=true"]
    assert main(["check", *command, *off]) == 1
    said = capsys.readouterr().out
    assert "before self-calibration" not in said and "unstable at 4096 Hz" in said
    adaptive = [*off, "--set", "compensation.adaptive=true"]
    assert main(["check", *command, *adaptive]) == 0
    said = capsys.readouterr().out
    assert "as configured, before self-calibration:\n" in said
    assert "unstable at 4096 Hz" in said.split("\nCaution:\n")[1]
    # A loop that stays unstable after the calibration gets the verdict no, and so does the virtual test.
    hopeless = ["--set", "controller.proportional_gain=10", "--set", "compensation.adaptive=true"]
    assert main(["check", *SWEEP, *hopeless]) == 1
    said = capsys.readouterr().out.split("\nNo:\n")[1].lower()
    assert "after self-calibration" in said and re.search(r"force error is \d{3,}%", said)


def test_check_names_missing_effects_and_idle_keys(folder, capsys):
    adaptive = ["--set", "compensation.adaptive=true", "--set", "controller.velocity_source=derivative"]
    idle = ["--set", "compensation.look_ahead=true"]
    assert main(["check", *SWEEP, *adaptive, *idle]) in (0, 1)
    said = capsys.readouterr().out
    assert "not in the linear model: compensation.adaptive" in said
    assert "without effect: compensation.look_ahead needs compensation.feedforward = true" in said
    unprotected = ["--set", "protection.force_trip=20e3"]
    assert main(["run", *SWEEP, *unprotected]) == 0
    assert (
        "\nwithout effect: protection.force_trip needs protection.enabled = true\n" in capsys.readouterr().out
    )
    assert main(["run", *SWEEP, *unprotected, "--json"]) == 0
    idle_keys = json.loads(capsys.readouterr().out)["idle_keys"]
    assert idle_keys == ["protection.force_trip needs protection.enabled = true"]
    assert main(["check", *SWEEP, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["left_out"], answer["idle_keys"]) == ([], [])
    axes = ["--x", "compensation.level", "0.9", "1.1", "3", "--y", "structure.damping", "1", "9", "2"]
    assert main(["map", *axes, *adaptive[:2], "-o", "map.csv"]) == 0
    assert "not in the linear model: compensation.adaptive\n" in capsys.readouterr().out


def test_check_reports_a_missing_force(capsys):
    assert main(["check", *SWEEP, "--set", "compensation.mode=off"]) == 1
    said = capsys.readouterr().out.split("\nNo:\n")[1]
    assert "The force misses the command by" in said


def test_check_does_not_call_a_test_feasible_that_fails_on_the_virtual_rig(capsys):
    # The demands do not depend on the sensor's offset, but the test fails.
    fault = ["--set", "sensors.velocity.bias=5.0"]
    code = main(["check", *SWEEP, *fault])
    said = capsys.readouterr().out
    assert code == 1 and re.search(r"force error is \d{3,}%", said.split("\nNo:\n")[1])
