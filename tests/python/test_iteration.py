"""Drive files: the error decreases, yielding specimens are refused, measured data give one step."""

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import eft
from buildings import building, command_of, record
from eft.cli import main
from eft.traces import Traces

pytestmark = pytest.mark.usefixtures("quick_pictures")

RIG = eft.Rig.zhao2005()
SWEEP = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0)
SHORT = eft.sine_sweep(8900.0, 0.0, 10.0, 8.0, 2048.0)


def test_the_paper_s_sweep_falls_below_one_per_cent_in_five_repeats():
    found = eft.iterate(RIG, SWEEP, repeats=5)
    assert found.errors[0] == pytest.approx(0.059, abs=0.002) and len(found.errors) <= 6
    assert min(found.errors) < 0.01
    again = eft.simulate(RIG, found.drive)
    # The error refers to the desired force, not to the drive.
    wanted = SWEEP.values
    assert np.sqrt(np.mean((again.force - wanted) ** 2) / np.mean(wanted**2)) == pytest.approx(
        min(found.errors)
    )


def test_noise_does_not_make_it_diverge():
    noisy = RIG.replace({"sensors.force.noise": 40.0, "sensors.velocity.noise": 1e-3})
    found = eft.iterate(noisy, SHORT, repeats=4)
    assert min(found.errors) < 0.5 * found.errors[0]


@pytest.mark.parametrize(
    ("factor", "says"),
    [
        (-1.0, "force = against the command"),
        (4.448, "force = 4.4 times the command"),
        (1e-3, "check the units"),
    ],
)
def test_a_measured_force_of_another_sign_or_unit_is_refused(factor, says):
    run = eft.simulate(RIG, SHORT)
    measured = Traces("m.csv", 2048.0, {"command": run.command, "force": factor * run.force})
    with pytest.raises(ValueError, match=says):
        eft.iterate(measured, SHORT)


def test_a_measured_test_without_compensation_is_corrected():
    run = eft.simulate(RIG.replace({"compensation.mode": "off"}), SHORT)
    assert eft.iterate(Traces.from_run(run), SHORT).corrected.any()


def test_a_measured_test_takes_the_first_step_of_the_rig():
    on_rig = eft.iterate(RIG, SHORT, repeats=1)
    run = eft.simulate(RIG, SHORT)
    for measured in (run, Traces.from_run(run)):
        found = eft.iterate(measured, SHORT)
        np.testing.assert_allclose(found.drive.values, on_rig.runs[1].command, atol=1e-6)
        assert found.errors == (pytest.approx(on_rig.errors[0]),)


def test_what_has_no_coherence_or_lies_outside_the_band_keeps_its_drive():
    rng = np.random.default_rng(3)
    noise = Traces("noise", 2048.0, {"command": SHORT.values, "force": 3e3 * rng.standard_normal(len(SHORT))})
    found = eft.iterate(noise, SHORT, least_coherence=0.9)
    np.testing.assert_array_equal(found.drive.values, SHORT.values)
    assert not found.corrected.any() and "coherence" in found.stopped
    banded = eft.iterate(RIG, SHORT, repeats=1, band=(2.0, 5.0))
    assert banded.frequency[banded.corrected].min() >= 2.0 and banded.frequency[banded.corrected].max() <= 5.0


def test_a_specimen_that_yields_is_refused():
    hysteretic = {
        "structure.kind": "bouc_wen",
        "structure.softening": None,
        "structure.bouc_wen": {
            "yield_displacement": 5e-3,
            "post_yield_ratio": 0.1,
            "exponent": 2.0,
            "shape": 0.5,
        },
    }
    with pytest.raises(ValueError, match="yield_displacement"):
        eft.iterate(RIG.replace(hysteretic), SHORT)
    stiff = hysteretic | {"structure.bouc_wen.yield_displacement": 1.0}
    assert eft.iterate(RIG.replace(stiff), SHORT, repeats=1).errors
    run = eft.simulate(RIG, SHORT)
    bent = run.displacement + np.linspace(0.0, 0.3 * abs(run.displacement).max(), len(run))
    traces = Traces("bent", 2048.0, {"command": run.command, "force": run.force, "displacement": bent})
    with pytest.raises(ValueError, match="displacement"):
        eft.iterate(traces, SHORT)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"relaxation": 0.0}, "relaxation"),
        ({"least_coherence": 2.0}, "least_coherence"),
        ({"repeats": 0}, "repeats"),
        ({"band": (5.0, 2.0)}, "band"),
    ],
)
def test_a_wrong_argument_is_named(options, says):
    with pytest.raises(ValueError, match=says):
        eft.iterate(RIG, SHORT, **options)


def test_a_test_of_another_length_or_actuators_is_refused():
    run = eft.simulate(RIG, SHORT)
    with pytest.raises(ValueError, match="samples"):
        eft.iterate(run, SHORT[:100])
    with pytest.raises(ValueError, match="command"):
        eft.iterate(RIG, eft.Command(np.zeros(100), 1024.0))
    with pytest.raises(ValueError, match="command"):
        eft.iterate(RIG, eft.Command(np.ones((2, 100)), 1024.0))


def test_the_actuators_of_a_building_are_corrected_each():
    rig = building(2)
    command = command_of(rig, record(), 0.4)
    found = eft.iterate(rig, command, repeats=3)
    assert found.drive.values.shape == command.values.shape
    assert found.errors[-1] < 0.5 * found.errors[0], found.errors
    assert found.errors[0] == pytest.approx(found.runs[0].metrics().nrmse.max())
    step = eft.iterate(found.runs[0], command)
    np.testing.assert_allclose(step.drive.values, found.runs[1].command, atol=1e-6)
    labels = {line.get_label() for line in found.plot(ax=Figure().subplots()).get_lines()}
    assert {"force / drive, actuator 1", "coherence, actuator 2"} <= labels


def test_the_command_writes_a_drive_that_a_test_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    asked = [
        "iterate",
        "--sweep",
        "8900",
        "0",
        "10",
        "8",
        "--sample-rate",
        "2048",
        "--repeats",
        "2",
        "--json",
    ]
    assert main(asked) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["errors"][-1] < 0.5 * answer["errors"][0]
    rig = RIG.replace({"controller.sample_rate": 2048.0}).to_toml()
    Path("test.toml").write_text(rig + '[command]\nkind = "drive"\nfile = "drive.csv"\n', encoding="utf-8")
    assert main(["run", "test.toml", "-o", "out.eft"]) == 0
    run = eft.TestRun.load("out.eft")
    np.testing.assert_allclose(
        run.command, eft.iterate(RIG, SHORT, repeats=2).drive.values, rtol=1e-6, atol=1e-3
    )


def test_the_command_writes_a_drive_for_each_actuator_that_a_test_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rig = building(2).to_toml()
    Path("rig.toml").write_text(rig, encoding="utf-8")
    asked = ["iterate", "--rig", "rig.toml", "--record", "elcentro", "--scale", "0.05", "--repeats", "1"]
    assert main([*asked, "--sample-rate", "512", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["drive"] == "drive-1.csv, drive-2.csv" and not Path("drive.csv").exists()
    test = '[command]\nkind = "drive"\nfile = "drive.csv"\n'
    Path("test.toml").write_text(rig + test, encoding="utf-8")
    main(["run", "test.toml", "-o", "out.eft"])
    run = eft.TestRun.load("out.eft")
    for row, name in zip(run.command, answer["drive"].split(", "), strict=True):
        np.testing.assert_array_equal(row, np.loadtxt(name, delimiter=",", skiprows=1)[:, 1])
    short = Path("drive-2.csv").read_text(encoding="utf-8").splitlines()[:100]
    Path("drive-2.csv").write_text("\n".join(short), encoding="utf-8")
    assert main(["run", "test.toml", "-o", "out.eft"]) == 2
    assert "drive-2.csv: 99 samples" in capsys.readouterr().err


def test_the_picture_shows_response_and_coherence():
    ax = eft.iterate(RIG, SHORT, repeats=1).plot(ax=Figure().subplots())
    assert {line.get_label() for line in ax.get_lines()} == {"exact", "force / drive", "coherence"}
