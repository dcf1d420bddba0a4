"""What the check foresees of an unstable loop until it is calibrated, compared with simulated tests."""

import eft

RIG = eft.Rig.zhao2005().replace(
    {
        "structure.kind": "linear",
        "controller.force_loop": "robust",
        "compensation.adaptive": True,
        "compensation.feedforward": True,
        "compensation.look_ahead": True,
    }
)


def judged(mass, frequency, rate, flow_gain, response_delay, valve_gain=0.1):
    angular = 6.283 * frequency
    specimen = {
        "structure.mass": mass,
        "structure.stiffness": mass * angular**2,
        "structure.damping": 0.06 * mass * angular,
        "controller.sample_rate": rate,
        "truth.servovalve.flow_gain_scale": flow_gain,
        "compensation.response_delay": response_delay,
        "compensation.valve_gain": valve_gain,
    }
    rig, command = RIG.replace(specimen), eft.sine_sweep(500.0, 0.3, 8.0, 8.0, rate)
    return eft.check_feasibility(rig, command), eft.simulate(rig, command)


def test_a_growth_that_calibration_is_too_slow_for_is_a_no():
    found, run = judged(2000.0, 1.5, 1024.0, 1.2, 10e-3)
    assert found.verdict == run.verdict.grade == "no" and run.metrics().nrmse > 1.0
    assert found.reasons[0].startswith("A deviation grows 1")
    assert "until self-calibration has found gains and delays" in found.reasons[0]


def test_a_valve_gain_is_learned_more_slowly_than_a_flow_gain():
    found, run = judged(2000.0, 1.5, 1024.0, 1.0, 5.6e-3, valve_gain=0.0834)
    assert found.verdict == run.verdict.grade == "no" and run.metrics().nrmse > 0.3
    assert found.reasons[0].startswith("A deviation grows")


def test_a_growth_that_calibration_soon_ends_is_a_caution():
    found, run = judged(7040.0, 4.0, 2048.0, 1.3, 2.5e-3)
    assert found.verdict == run.verdict.grade == "caution" and run.metrics().nrmse < 0.05
    assert any(one.startswith("Before self-calibration the loop is unstable") for one in found.reasons)
    assert not any(one.startswith("A deviation grows") for one in found.reasons)
