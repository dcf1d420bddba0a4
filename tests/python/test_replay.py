"""A recorded test fed to the learner: from a run, from a file, with a sensor that failed."""

import numpy as np
import pytest

import eft
from eft.traces import write_run

RIG = eft.Rig.zhao2005()
COMMAND = eft.sine_sweep(4000.0, 0.5, 4.0, 8.0, 4096.0)


@pytest.fixture(scope="module")
def run():
    return eft.simulate(RIG.replace({"servovalve.flow_gain_scale": 0.95}), COMMAND)


def test_a_test_without_learning_is_learned_from(run):
    replay = eft.replay(RIG, run)
    assert replay.flow_gain_estimate[-1] == pytest.approx(0.95, abs=0.01)
    assert replay.time.size == COMMAND.values.size // 16
    assert np.all(np.diff(replay.time) == pytest.approx(16 / 4096))
    assert np.all(replay.test_ratio[64:] < 1.0)
    frame = replay.to_pandas()
    assert list(frame["flow_gain_estimate"]) == list(replay.flow_gain_estimate)
    table = RIG["servovalve.flow_table.flows"]
    found = replay.found_flows / np.where(np.array(table) == 0.0, 1.0, table)
    assert found[8] == pytest.approx(replay.flow_gain_estimate[-1], rel=1e-6)


def test_a_file_teaches_what_the_run_does(run, tmp_path):
    write_run(run, tmp_path / "run.csv")
    read = eft.replay(RIG, tmp_path / "run.csv")
    assert read.flow_gain_estimate[-1] == pytest.approx(eft.replay(RIG, run).flow_gain_estimate[-1], abs=1e-4)


def test_a_failed_sensor_shows_in_the_test_ratio():
    fault = {"signal": "velocity", "kind": "zero", "start": 5.0, "duration": 0.5}
    rig = RIG.replace({f"sensors.fault.{key}": value for key, value in fault.items()})
    replay = eft.replay(RIG, eft.simulate(rig, COMMAND), dtype="f32")
    during = (replay.time > 5.05) & (replay.time < 5.5)
    assert np.all(replay.test_ratio[during] > 1.0)
    assert np.all(replay.status[during] & eft.Status.ADAPTATION_FROZEN)


def test_what_is_missing_is_named(run):
    with pytest.raises(ValueError, match="no acceleration in it"):
        eft.replay(RIG.replace({"controller.velocity_source": "accelerometer"}), run)
    with pytest.raises(ValueError, match="sample_rate = 100"):
        eft.replay(RIG, eft.simulate(RIG, eft.sine_sweep(100.0, 0.5, 4.0, 1.0, 100.0)))
