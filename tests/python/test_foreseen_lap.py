"""What the feasibility check foresees of an unknown lap, compared with simulated tests."""

import numpy as np
import pytest

import eft

RATE = 2048.0
RIG = eft.Rig.zhao2005().replace(
    {
        "structure.kind": "linear",
        "controller.force_loop": "robust",
        "controller.sample_rate": RATE,
        "compensation.feedforward": True,
        "compensation.look_ahead": True,
    }
)
SWEEP = eft.sine_sweep(500.0, 0.3, 8.0, 8.0, RATE)
ADAPTIVE, GUARD = {"compensation.adaptive": True}, {"compensation.guard": True}


@pytest.mark.parametrize(
    ("changes", "lap"),
    [
        ({}, 1e-3),
        ({}, -1e-3),
        (ADAPTIVE, 1e-3),
        (ADAPTIVE, 2e-3),
        (ADAPTIVE, -1e-3),
        (GUARD, 1e-3),
        ({"compensation.mode": "linear"}, 1e-3),
    ],
)
def test_an_unknown_lap_near_the_size_of_the_opening_has_the_predicted_error(changes, lap):
    rig = RIG.replace(changes | {"structure.damping": 7000.0, "truth.servovalve.overlap": lap})
    found, metrics = eft.check_feasibility(rig, SWEEP), eft.simulate(rig, SWEEP).metrics()
    assert found.force_error == pytest.approx(metrics.nrmse, rel=0.35)
    assert found.displacement_error == pytest.approx(metrics.displacement_error, rel=0.35)
    assert "servovalve.overlap" in found.left_out


@pytest.mark.parametrize(
    "changes", [{"compensation.mode": "linear"}, {"compensation.mode": "off", "controller.force_loop": "pd"}]
)
@pytest.mark.parametrize("lap", [-1e-3, 3e-4, 1e-3])
def test_a_known_lap_has_the_errors_of_an_unknown_one_where_the_scheme_ignores_it(changes, lap):
    rig = RIG.replace(changes | {"structure.damping": 7000.0, "servovalve.overlap": lap})
    found, metrics = eft.check_feasibility(rig, SWEEP), eft.simulate(rig, SWEEP).metrics()
    assert found.force_error == pytest.approx(metrics.nrmse, rel=0.35)
    assert found.displacement_error == pytest.approx(metrics.displacement_error, rel=0.35)
    assert found.left_out == ("servovalve.overlap",)
    assert not any("although the controller knows it" in one for one in found.reasons)


@pytest.mark.parametrize("changes", [{}, ADAPTIVE])
def test_an_oscillation_about_null_by_an_unknown_underlap_is_foreseen(changes):
    late = {"truth.sensors.force.delay": 4, "truth.dac.delay": 4, "truth.servovalve.overlap": -3e-3}
    oil = {"truth.actuator.compressibility": 0.8 * RIG["actuator.compressibility"]}
    rig = RIG.replace(changes | late | oil | {"structure.damping": 7000.0})
    moving = eft.sine_sweep(2000.0, 0.5, 6.0, 3.0, RATE).values
    command = eft.Command(np.concatenate([moving, np.zeros_like(moving)]), RATE)
    found, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
    assert found.force_error == pytest.approx(run.metrics().nrmse, rel=0.4)
    assert any("above 30 Hz" in reason for reason in found.reasons)
    assert found.verdict == run.verdict.grade == "no"
