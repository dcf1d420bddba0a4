"""Effects that no linear model has, foreseen before a test, such as a known overlap and a tiny command."""

import numpy as np
import pytest

import eft

RIG = eft.Rig.zhao2005().replace(
    {
        "controller.force_loop": "robust",
        "compensation.adaptive": True,
        "compensation.feedforward": True,
        "compensation.look_ahead": True,
    }
)
SWEEP = eft.sine_sweep(4000.0, 0.5, 6.0, 20.0, 4096.0)


@pytest.mark.parametrize(("overlap", "large"), [(0.0, False), (1e-3, False), (0.01, True)])
def test_a_known_overlap_is_a_caution_where_it_makes_a_large_error(overlap, large):
    rig = RIG.replace({"servovalve.overlap": overlap})
    found, run = eft.check_feasibility(rig, SWEEP), eft.simulate(rig, SWEEP)
    named = [reason for reason in found.reasons if reason.startswith("The overlap is ")]
    assert bool(named) == large
    assert (found.verdict, run.verdict.grade) == (("caution", "caution") if large else ("go", "go"))
    error = run.metrics()["nrmse"]
    if large:
        share = float(named[0].split("%")[0].split()[-1]) / 100
        assert 0.5 * share < error < 2.5 * share


PAPER = eft.Rig.zhao2005()
SMALL, QUICK = eft.sine_sweep(2200.0, 0.5, 6.0, 16.0, 4096.0), eft.sine_sweep(4000.0, 0.0, 10.0, 16.0, 4096.0)


@pytest.mark.parametrize(
    ("rig", "command", "play", "large"),
    [
        (RIG, SWEEP, 2e-6, False),
        (RIG, SWEEP, 5e-5, True),
        (RIG, QUICK, 3e-6, False),
        # The oil column rings with the paper's gains after each crossing of the play.
        (PAPER, SMALL, 2e-6, False),
        (PAPER, SMALL, 1e-5, True),
        (PAPER, QUICK, 2e-5, True),
        (PAPER.replace({"sensors.motion_at": "structure"}), SMALL, 1e-5, True),
        # Its oscillation lasts where the motion is measured at the piston.
        (PAPER, SMALL, 5e-5, True),
        (PAPER.replace({"sensors.motion_at": "structure"}), SMALL, 5e-5, True),
    ],
)
def test_a_play_of_the_attachment_is_a_caution_where_it_makes_a_large_error(rig, command, play, large):
    rig = rig.replace({"actuator.attachment_play": play})
    found, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
    named = [reason for reason in found.reasons if reason.startswith(f"The play of {1e3 * play:.2g} mm ")]
    assert bool(named) == large == (run.verdict.grade != "go")
    assert found.verdict == ("caution" if large else "go")
    if large:
        share = float(named[0].split("%")[0].split()[-1]) / 100
        error = run.metrics()["nrmse"]
        assert share / 2.5 < error < 1.7 * share
        at_piston = rig["sensors.motion_at"] == "piston"
        assert ("an oscillation of about" in named[0]) == at_piston


@pytest.mark.parametrize(
    ("key", "bias", "trips"), [("velocity", 5e-4, False), ("velocity", 0.01, True), ("force", 10.0, False)]
)
def test_a_bias_that_trips_the_protection_at_rest_is_foreseen(key, bias, trips):
    rig = RIG.replace({"protection.enabled": True, f"truth.sensors.{key}.bias": bias})
    found, run = eft.check_feasibility(rig, SWEEP), eft.simulate(rig, SWEEP)
    said = [one for one in found.reasons if one.startswith("The protection trips at rest after ")]
    assert bool(said) == trips == bool(run.flags & eft.Status.TRIPPED)
    if trips:
        assert said[0].endswith(
            "s (velocity implausible) with the bias of the velocity sensor. Set it to zero before the test."
        )
        assert found.verdict != "go" and run.cause == eft.Cause.VELOCITY_IMPLAUSIBLE
    unwatched = rig.replace({"protection.plausibility": False})
    assert not any("trips at rest" in one for one in eft.check_feasibility(unwatched, SWEEP).reasons)


def test_a_jump_at_the_start_is_a_caution_where_the_feedforward_saturates_the_valve():
    time = np.arange(8 * 4096) / 4096.0
    hard = 6000.0 * np.cos(2.0 * np.pi * time)
    soft = np.minimum(1.0, time) * hard
    oil = {"actuator.compressibility": 3e-12}
    for rig, values, jumps in (
        (RIG.replace(oil), hard, True),
        (RIG.replace(oil), soft, False),
        (RIG, hard, False),
        (PAPER.replace(oil), hard, False),
    ):
        command = eft.Command(values, 4096.0)
        found, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
        named = [one for one in found.reasons if one.startswith("The command begins with a jump to 6 kN.")]
        assert bool(named) == jumps
        assert bool(run.status[0] & eft.Status.DEMAND_SATURATED) == jumps
    started = RIG.replace(oil | {"protection.enabled": True, "protection.start_time": 1.0})
    reasons = eft.check_feasibility(started, eft.Command(hard, 4096.0)).reasons
    assert not any("begins with a jump" in one for one in reasons)


TINY = "The command reaches "


def test_a_command_below_friction_and_accuracy_is_a_caution_before_and_after_the_test():
    sweep = eft.sine_sweep(1.0, 0.0, 10.0, 32.0, 4096.0)
    capacity = PAPER["actuator.piston_area"] * PAPER["supply.pressure"]
    # Seals of a fatigue-rated actuator have 0.2 % of its capacity at least.
    rubs = PAPER.replace({"truth.actuator.friction": 2e-3 * capacity})
    for peak, tiny in ((2200.0 / 400, True), (0.9e-3 * capacity, True), (1.1e-3 * capacity, False)):
        command = sweep * peak
        for said in (eft.check_feasibility(PAPER, command), eft.simulate(PAPER, command).verdict):
            named = [one for one in said.reasons if one.startswith(TINY)]
            assert bool(named) == tiny
            if tiny:
                assert named[0].endswith("Check the unit of the record, the mass and the scale.")
        if tiny:
            assert eft.simulate(rubs, command).metrics().displacement_error > 0.2
    assert eft.simulate(rubs, sweep * 2200.0).metrics().displacement_error < 0.1
    cell = PAPER.replace({"sensors.force.range": 4e6})
    assert any(one.startswith(TINY) for one in eft.check_feasibility(cell, sweep * 2200.0).reasons)


@pytest.mark.parametrize(
    "cell", [{"noise": 60.0}, {"range": 1e6, "bits": 12}, {"noise": 30.0, "range": 4e5, "bits": 12}]
)
def test_a_command_in_the_noise_and_the_steps_of_the_load_cell_is_a_caution(cell):
    rig = PAPER.replace({f"sensors.force.{key}": value for key, value in cell.items()})
    for peak in (500.0, 1000.0, 2200.0, 8900.0):
        command = eft.sine_sweep(peak, 0.0, 10.0, 16.0, 4096.0)
        named = [one for one in eft.check_feasibility(rig, command).reasons if one.startswith(TINY)]
        run = eft.simulate(rig, command)
        missed = np.std(run.measured_force - run.force) / peak
        assert abs(missed / 0.1 - 1.0) > 0.1
        assert bool(named) == (missed > 0.1 or peak < 1e-3 * cell.get("range", 0.0))


def test_a_silent_command_is_not_tiny():
    silent = eft.Command(np.zeros(4096), 4096.0)
    assert not any(one.startswith(TINY) for one in eft.check_feasibility(PAPER, silent).reasons)
