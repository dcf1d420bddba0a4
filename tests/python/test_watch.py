"""A test that is watched while it runs: force, estimates, and tests that cannot be watched."""

import numpy as np
import pytest

import eft
from buildings import building
from eft.cli import main

RIG = eft.Rig.zhao2005().replace(
    {
        "controller.realization": "digital",
        "compensation.adaptive": True,
        "compensation.feedforward": True,
        "compensation.look_ahead": True,
    }
)
SWEEP = eft.sine_sweep(8900.0, 0.0, 10.0, 4.0, 4096.0)


@pytest.mark.parametrize("rig", [RIG, RIG.replace({"controller.force_loop": "robust"})])
def test_what_is_seen_is_the_simulated_test(rig):
    run = eft.simulate(rig, SWEEP)
    looks = list(eft.watch(rig, SWEEP, every=0.25))
    assert len(looks) == 17 and looks[-1].time == pytest.approx(run.time[-1])
    at = [round(look.time * 4096) for look in looks]
    # Two integration methods, each within 1e-4 of the peak of the converged answer.
    np.testing.assert_allclose(
        [look.force for look in looks], run.force[at], atol=1e-4 * abs(run.force).max()
    )
    np.testing.assert_allclose([look.spool for look in looks], run.spool[at], atol=1e-3)
    assert looks[-1].error == pytest.approx(run.metrics().nrmse, rel=0.02)
    assert looks[-1].response_delay == pytest.approx(run.response_delay_estimate[-1], rel=1e-2)
    assert looks[-1].flow_gain == pytest.approx(run.flow_gain_estimate[-1], rel=1e-2)


def test_watching_changes_nothing(capsys):
    watched = eft.simulate(RIG, SWEEP, watch=True)
    assert len(capsys.readouterr().out.splitlines()) >= 20
    np.testing.assert_array_equal(watched.force, eft.simulate(RIG, SWEEP).force)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"controller.realization": "analog"}, "controller.realization"),
        ({"sensors.force.noise": 10.0}, "sensors.force.noise"),
        ({"truth.sensors.spool.delay": 2}, "sensors.spool.delay"),
    ],
)
def test_what_the_loop_leaves_out_is_refused(changes, says):
    with pytest.raises(ValueError, match=says):
        eft.watch(RIG.replace(changes), SWEEP)


def test_a_building_is_watched_floor_by_floor(capsys):
    rig = building(2, **{"controller.realization": "digital"})
    tone = np.sin(2 * np.pi * 1.5 * np.arange(1024) / 2048.0)
    command = eft.Command([3e3 * tone, 2e3 * tone], 2048.0)
    run = eft.simulate(rig, command)
    *_, last = eft.watch(rig, command, every=0.1)
    np.testing.assert_allclose(last.force, run.force[:, -1], rtol=1e-9)
    np.testing.assert_allclose(last.error, run.metrics().nrmse, rtol=1e-9)
    eft.simulate(rig, command, watch=True)
    assert "actuator " in capsys.readouterr().out
    with pytest.raises(ValueError, match="command = 1 actuators: must be of 2"):
        eft.watch(rig, SWEEP)


def test_wrong_arguments_are_named():
    with pytest.raises(ValueError, match="every"):
        eft.watch(RIG, SWEEP, every=0.0)
    with pytest.raises(ValueError, match="command"):
        eft.watch(RIG, eft.Command(np.ones((2, 10)), 1024.0))


def test_the_command_line_watches_beside_its_answer(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    asked = [
        "run",
        "--sweep",
        "2000",
        "0.5",
        "4",
        "2",
        "--set",
        "controller.realization=digital",
        "--watch",
        "--json",
    ]
    assert main(asked) == 0
    said = capsys.readouterr()
    assert said.out.startswith("{") and len(said.err.splitlines()) >= 20
    assert main(["run", "--sweep", "2000", "0.5", "4", "2", "--watch"]) == 2
    assert "controller.realization" in capsys.readouterr().err
