"""A null bias under the protection: the supply must rise as a pump's does."""

import pytest

import eft

RIG = eft.Rig.zhao2005().replace(
    {
        "controller.force_loop": "robust",
        "compensation.adaptive": True,
        "compensation.feedforward": True,
        "compensation.look_ahead": True,
        "protection.enabled": True,
        "protection.plausibility": True,
        "protection.force_trip": 40e3,
        "protection.displacement_trip": 0.1,
        "protection.start_time": 3.0,
    }
)
COMMAND = eft.sine_sweep(8900.0, 0.5, 4.0, 8.0, 4096.0)
RISING = {"truth.supply.schedule.times": [0.0, 2.0], "truth.supply.schedule.pressures": [1e6, 1.9e7]}


@pytest.mark.parametrize("bias", [-0.03, -0.01, 0.015, 0.03])
def test_a_bias_raises_no_alarm_while_the_supply_rises(bias: float) -> None:
    run = eft.simulate(RIG.replace({"truth.servovalve.null_bias": bias} | RISING), COMMAND)
    assert run.cause == eft.Cause.NONE
    assert abs(run.force).max() < 10e3


def test_a_bias_at_full_pressure_from_the_first_sample_is_taken_for_a_wrong_force() -> None:
    runs = [eft.simulate(RIG.replace({"truth.servovalve.null_bias": bias}), COMMAND) for bias in (0.01, 0.02)]
    assert [run.cause for run in runs] == [eft.Cause.NONE, eft.Cause.FORCE_IMPLAUSIBLE]
