"""What the feasibility check foresees of a guard alone, compared with simulated tests."""

import numpy as np
import pytest

import eft

GUARD = eft.Rig.zhao2005().replace({"structure.kind": "linear", "compensation.guard": True})
STABLE = GUARD.replace({"controller.force_loop": "robust"})


def specimen(rig, frequency, mass, ratio, scale):
    angular = 2.0 * np.pi * frequency
    return rig.replace(
        {
            "structure.mass": mass,
            "structure.stiffness": mass * angular**2,
            "structure.damping": 2.0 * ratio * mass * angular,
            "servovalve.flow_gain_scale": scale,
        }
    )


@pytest.mark.parametrize("frequency", [1.0, 2.5, 5.0])
@pytest.mark.parametrize("scale", [1.05, 1.2])
def test_an_excess_of_flow_that_a_guard_removes_is_no_reason_against_a_test(frequency, scale):
    rig = specimen(STABLE, frequency, 7040.0, 0.0222, scale)
    command = eft.sine_sweep(2000.0, 0.3, 10.0, 20.0, 4096.0)
    found, metrics = eft.check_feasibility(rig, command), eft.simulate(rig, command).metrics()
    assert found.displacement_error == pytest.approx(metrics.displacement_error, rel=0.2, abs=0.005)
    assert found.force_error == pytest.approx(metrics.nrmse, abs=0.012)
    assert found.verdict == eft.simulate(rig, command).verdict.grade != "no"
    unguarded = rig.replace({"compensation.guard": False})
    assert eft.check_feasibility(unguarded, command).displacement_error > 0.25


@pytest.mark.parametrize(
    ("case", "amplitude"),
    [
        # The motion is too small for the guard.
        ((7.2, 17_700.0, 0.037, 1.2), 1000.0),
        # It becomes large enough during the test.
        ((7.0, 10_070.0, 0.046, 1.2), 1000.0),
    ],
)
def test_a_guard_acts_on_a_motion_that_is_large_enough(case, amplitude):
    rig = specimen(GUARD.replace({"compensation.feedforward": True}), *case)
    command = eft.sine_sweep(amplitude, 0.3, 10.0, 20.0, 4096.0)
    found, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
    assert found.verdict == run.verdict.grade == "no"
    assert found.displacement_error == pytest.approx(run.metrics().displacement_error, rel=0.15)


@pytest.mark.parametrize(
    ("case", "amplitude", "grade"),
    [
        ((6.5, 755.0, 0.036, 1.05), 300.0, "no"),
        ((7.7, 1291.0, 0.033, 1.2), 300.0, "no"),
        ((4.5, 1866.0, 0.045, 1.1), 300.0, "no"),
        ((3.4, 1430.0, 0.041, 1.05), 300.0, "caution"),
        ((4.0, 1321.0, 0.044, 1.05), 1000.0, "caution"),
    ],
)
def test_a_motion_that_grows_before_the_guard_acts_is_foreseen(case, amplitude, grade):
    rig = specimen(GUARD, *case)
    command = eft.sine_sweep(amplitude, 0.3, 10.0, 20.0, 4096.0)
    found, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
    assert found.verdict == run.verdict.grade == grade
    assert 1 / 1.5 < found.displacement_error / run.metrics().displacement_error < 1.5
    assert any(reason.startswith("Before the guard acts the loop is unstable") for reason in found.reasons)
    assert "compensation.guard" in found.left_out


def test_an_oil_column_that_no_level_of_the_guard_makes_stable_is_a_no():
    rig = specimen(GUARD, 3.2, 7252.0, 0.022, 1.4)
    command = eft.sine_sweep(1000.0, 0.3, 10.0, 20.0, 4096.0)
    found, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
    for verdict, reasons in ((found.verdict, found.reasons), (run.verdict.grade, run.verdict.reasons)):
        assert verdict == "no"
        assert any("even at the level to which the guard reduces it" in reason for reason in reasons)
    assert found.displacement_error is None and run.metrics().oscillation > 1.0


def test_a_loop_unstable_by_its_gains_does_not_blame_the_guard():
    rig = GUARD.replace({"controller.proportional_gain": 3.0, "compensation.level": 0.0})
    found = eft.check_feasibility(rig, eft.sine_sweep(2000.0, 0.3, 10.0, 8.0, 4096.0))
    assert found.verdict == "no" and "unstable" in " ".join(found.reasons)
    assert "guard" not in " ".join(found.reasons)
