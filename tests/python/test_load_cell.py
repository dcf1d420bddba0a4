"""The gain of the load cell, identified against the specimen's inertia."""

import json
from pathlib import Path

import numpy as np
import pytest

import eft
from eft.cli import main

RATE = 2048.0
RIG = eft.Rig.zhao2005().replace({"controller.force_loop": "robust", "compensation.feedforward": True})
BUILDING = RIG.replace(
    {
        "structure.kind": "shear_building",
        "structure.stories.masses": [7e3, 7e3],
        "structure.stories.dampings": [3e3, 3e3],
        "structure.stories.stiffnesses": [2e6, 2e6],
    }
)
DAMPED = RIG.replace({"structure.power_damper.coefficient": 1e4, "structure.power_damper.exponent": 0.3})
SWEEP = eft.sine_sweep(8900.0, 0.0, 40.0, duration=16.0, sample_rate=RATE)
SENSORS = {
    "force.noise": 78.0,
    "velocity.noise": 5e-4,
    "displacement.noise": 6e-5,
    "seed": 5,
    "force.delay": 3,
    "velocity.delay": 1,
    "displacement.delay": 2,
}
GAINS = {"force": 1.02, "velocity": 0.99, "displacement": 1.01}
NOISY = {f"truth.sensors.{key}": value for key, value in SENSORS.items()}


def signals(rig: eft.Rig) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    run = eft.simulate(rig, SWEEP)
    return run.measured_displacement, run.measured_velocity, run.measured_force


@pytest.fixture(scope="module")
def measured() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    gains = {f"truth.sensors.{name}.gain": gain for name, gain in GAINS.items()}
    return signals(RIG.replace(NOISY | gains))


def test_drifting_sensors_show_the_same_ratios(
    measured: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    share = np.linspace(0.0, 1.0, measured[0].size)
    drifts = (0.006 * share, 0.05 * share, 4000.0 * share)
    moved = [signal + drift for signal, drift in zip(measured, drifts, strict=True)]
    plain, found = (
        eft.identification.identify_load_cell(RIG, *signals, RATE, gain_uncertainty=0.01)
        for signals in (measured, moved)
    )
    ratio = plain.velocity_over_displacement
    assert found.velocity_over_displacement == pytest.approx(ratio, abs=1e-4)
    assert found.force_over_velocity == pytest.approx(plain.force_over_velocity, abs=1e-4)


def test_late_and_noisy_sensors_show_the_ratios_of_their_gains(
    measured: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    found = eft.identification.identify_load_cell(RIG, *measured, RATE, gain_uncertainty=0.01)
    over_velocity = GAINS["force"] / GAINS["velocity"]
    assert found.force_over_velocity == pytest.approx(over_velocity, abs=3e-3)
    assert abs(found.force_over_velocity - over_velocity) < 4.0 * found.force_over_velocity.uncertainty
    ratio = GAINS["velocity"] / GAINS["displacement"]
    assert found.velocity_over_displacement == pytest.approx(ratio, abs=3e-3)
    # The middle of the outer two gains, here of force and velocity: what is left is common to all three.
    common = np.sqrt(max(GAINS.values()) * min(GAINS.values()))
    assert found.gain == pytest.approx(GAINS["force"] / common, abs=3e-3)
    assert 0.002 < found.gain.uncertainty < 0.004


def test_gains_further_apart_than_the_tolerance_are_refused(
    measured: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    with pytest.raises(ValueError, match=r"gain_uncertainty = 0\.0005: must be larger: load cell over vel"):
        eft.identification.identify_load_cell(RIG, *measured, RATE, gain_uncertainty=0.0005)


def test_the_command_line_agrees(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = eft.simulate(RIG.replace({"truth.sensors.force.gain": 1.02}), SWEEP)
    rig, file = tmp_path / "rig.toml", tmp_path / "sweep.csv"
    rig.write_text(RIG.to_toml(), encoding="utf-8")
    columns = np.column_stack([run.time, run.displacement, run.velocity, 1.02 * run.force])
    head = "time (s),displacement (m),velocity (m/s),force (N)"
    np.savetxt(file, columns, delimiter=",", header=head, comments="", fmt="%.17g")
    arguments = ["identify", "load-cell", str(file), "--rig", str(rig), "--mass-uncertainty", "0.002"]
    assert main(arguments) == 0
    assert "load cell over velocity     1.02" in capsys.readouterr().out
    assert main([*arguments, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    signals = run.displacement, run.velocity, 1.02 * run.force
    own = eft.identification.identify_load_cell(RIG, *signals, RATE, mass_uncertainty=0.002)
    assert found["gain"] == pytest.approx(float(own.gain), abs=1e-12)
    assert found["gain_uncertainty"] == pytest.approx(own.gain.uncertainty, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "seconds"),
    [
        ({}, 4.0),
        ({"structure.kind": "linear", "structure.stiffness": 7040.0 * (2 * np.pi * 6.0) ** 2}, 16.0),
        ({"actuator.attachment_stiffness": 1e9}, 16.0),
        ({"sensors.force.bandwidth": 100.0, "sensors.velocity.bandwidth": 60.0}, 16.0),
    ],
)
def test_ends_attachment_and_bandwidths_of_the_rig_are_no_errors(
    changes: dict[str, object], seconds: float
) -> None:
    rig = RIG.replace({"controller.force_loop": "pd"} | changes)
    run = eft.simulate(rig, SWEEP)
    last = int(seconds * RATE)
    signals = run.measured_displacement[:last], run.measured_velocity[:last], run.measured_force[:last]
    found = eft.identification.identify_load_cell(rig, *signals, RATE)
    assert found.force_over_velocity == pytest.approx(1.0, abs=3e-3)
    assert found.velocity_over_displacement == pytest.approx(1.0, abs=1e-3)


def test_an_unknown_mass_widens_the_uncertainty(
    measured: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    def uncertainty(mass: float) -> float:
        return eft.identification.identify_load_cell(
            RIG, *measured, RATE, mass_uncertainty=mass
        ).gain.uncertainty

    assert uncertainty(0.0) < uncertainty(0.01) < uncertainty(0.1) < 0.011


def test_a_heavy_specimen_looks_like_a_weak_load_cell(
    measured: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    heavier = RIG.replace({"structure.mass": 1.05 * RIG["structure.mass"]})
    found = eft.identification.identify_load_cell(heavier, *measured, RATE).force_over_velocity
    true = eft.identification.identify_load_cell(RIG, *measured, RATE).force_over_velocity
    assert found / true == pytest.approx(1.0 / 1.05, abs=5e-3)


def test_what_is_no_such_test_is_refused(measured: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    identify = eft.identification.identify_load_cell
    displacement, velocity, force = measured
    with pytest.raises(ValueError, match="velocity"):
        identify(RIG, displacement, velocity[:-1], force, RATE)
    with pytest.raises(ValueError, match="check gains, units, signs"):
        identify(RIG, displacement, 39.37 * velocity, force, RATE)
    with pytest.raises(ValueError, match="check gains, units, signs"):
        identify(RIG, displacement, -velocity, -force, RATE)
    with pytest.raises(ValueError, match="run a sweep to 40 Hz"):
        identify(RIG, displacement, np.random.default_rng(1).normal(size=force.size), force, RATE)
    with pytest.raises(ValueError, match="sample_rate = 60: must be at least 80 Hz"):
        identify(RIG, displacement, velocity, force, 60.0)
    with pytest.raises(ValueError, match="power_damper"):
        identify(DAMPED, displacement, velocity, force, RATE)
    with pytest.raises(ValueError, match="attachment_play"):
        identify(RIG.replace({"actuator.attachment_play": 1e-5}), displacement, velocity, force, RATE)
    with pytest.raises(ValueError, match="gain_uncertainty = 0"):
        identify(RIG, displacement, velocity, force, RATE, gain_uncertainty=0.0)
    with pytest.raises(ValueError, match="mass_uncertainty = -1"):
        identify(RIG, displacement, velocity, force, RATE, mass_uncertainty=-1.0)
    with pytest.raises(ValueError, match="natural frequency"):
        stiff = RIG.replace({"structure.stiffness": 60.0 * RIG["structure.stiffness"]})
        identify(stiff, displacement, velocity, force, RATE)
    with pytest.raises(ValueError, match="shear_building"):
        identify(BUILDING, displacement, velocity, force, RATE)
