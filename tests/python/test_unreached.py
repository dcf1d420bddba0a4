"""Predicted errors of rigs whose true valve lies beyond what self-calibration learns."""

import pytest

import eft

RIG = eft.Rig.zhao2005().replace(
    {"structure.kind": "linear", "controller.force_loop": "robust", "compensation.adaptive": True}
)
NO_CURVE = {"compensation.curve_correction": False}
FLOW, SPOOL = "truth.servovalve.flow_gain_scale", "truth.servovalve.spool_sensitivity"


@pytest.mark.parametrize(
    ("changes", "rate", "said"),
    [
        ({FLOW: 0.6}, 4096.0, "The flow gain is 0.60 and the valve gain 1.00 times the configured one."),
        ({SPOOL: 1.4 * 3579.13}, 4096.0, "learns nothing."),
        (
            {FLOW: 0.9, "compensation.learning.lowest_flow_gain": 0.95} | NO_CURVE,
            4096.0,
            "needs a flow gain of 0.90 times the configured one, and the lowest that it learns is 0.95 "
            "(compensation.learning.lowest_flow_gain).",
        ),
        (
            {"compensation.response_delay": 0.0005},
            4096.0,
            "needs a response delay of 5.3 ms, and the longest that it learns is 2 ms "
            "(compensation.learning.longest_delay).",
        ),
        (
            eft.servovalve("15 gpm", "1000 psi", "200 Hz"),
            500.0,
            "needs a response delay of 2.4 ms, and the shortest that it learns is 4 ms (two samples).",
        ),
        ({FLOW: 0.8}, 4096.0, None),
        ({FLOW: 1.4}, 4096.0, None),
    ],
)
def test_predicted_errors_contain_what_self_calibration_does_not_reach(changes, rate, said):
    rig = RIG.replace(changes | {"controller.sample_rate": rate})
    command = eft.sine_sweep(1000.0, 0.3, 8.0, 16.0, rate)
    found, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
    assert found.verdict == run.verdict.grade
    assert found.force_error == pytest.approx(run.metrics().nrmse, rel=0.1)
    if said is None:
        assert found.verdict == "go"
        assert found.displacement_error == pytest.approx(run.metrics().displacement_error, abs=0.01)
    else:
        assert found.displacement_error == pytest.approx(run.metrics().displacement_error, rel=0.1)
        assert any(said in reason for reason in found.reasons)
