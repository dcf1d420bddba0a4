"""A supply that droops under a controller that does not know its pressure."""

import pytest

import eft

SWEEP = eft.sine_sweep(8900.0, 0.5, 10.0, 32.0, 4096.0)
RIG = eft.Rig.zhao2005().replace({"supply.droop": 1e8, "supply.accumulator": 1e-12})


def test_a_droop_that_the_controller_does_not_know_is_named_with_its_effect():
    found, run = eft.check_feasibility(RIG, SWEEP), eft.simulate(RIG, SWEEP)
    # The pressure falls by less than 4 %.
    assert found.lowest_supply_pressure > 0.96 * RIG["supply.pressure"]
    assert run.verdict.grade == "no" and found.verdict == "caution"
    (reason,) = found.reasons
    assert reason.startswith(
        "The supply droops to 96% of its pressure, and the controller does not know it: "
    )
    assert "compensation.supply_correction" in reason and "supply.droop" in found.left_out
    # The prediction at the lowest pressure has the size of the error.
    assert "by about 23% (rms)" in reason
    assert run.metrics()["displacement_error"] == pytest.approx(0.34, abs=0.01)


def test_a_droop_without_effect_is_no_finding():
    # In this time the droop has its effect without these changes.
    short = eft.sine_sweep(8900.0, 0.5, 10.0, 8.0, 4096.0)
    assert eft.check_feasibility(RIG, short).left_out == ("supply.droop",)
    for changes in (
        {"compensation.supply_correction": True},
        {"compensation.adaptive": True},
        {"supply.droop": 2e7},
    ):
        rig = RIG.replace(changes)
        found = eft.check_feasibility(rig, short)
        assert found.verdict == eft.simulate(rig, short).verdict.grade == "go", changes
        assert "supply.droop" not in found.left_out, changes
