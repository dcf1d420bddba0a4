"""Replay of a recorded test with the learner: from a run, from a file, with a failed sensor."""

import numpy as np
import pytest

import eft
from eft.traces import Traces, write_run

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


@pytest.mark.parametrize("realization", ["analog", "digital"])
@pytest.mark.parametrize("adapts", [False, True])
def test_a_run_gives_the_delay_that_a_learning_run_finds(realization, adapts):
    rig = RIG.replace({"controller.realization": realization})
    learns = eft.simulate(rig.replace({"compensation.adaptive": True}), COMMAND)
    run = learns if adapts else eft.simulate(rig, COMMAND)
    found = eft.replay(rig, run).response_delay_estimate[-1]
    # A quarter of a sample.
    assert found == pytest.approx(learns.response_delay_estimate[-1], abs=0.25 / 4096)


def test_a_file_gives_the_estimates_of_the_run(run, tmp_path):
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


@pytest.mark.parametrize(
    ("factor", "says"),
    [(1 / 4448.2, "force = 0.00021 times the command"), (1000.0, "check the units"), (-1.0, "wrong sign")],
)
def test_a_force_of_another_sign_or_unit_is_refused(run, factor, says):
    measured = Traces.from_run(run)
    columns = dict(measured.columns) | {"measured_force": factor * run.measured_force}
    with pytest.raises(ValueError, match=says):
        eft.replay(RIG, Traces("m.csv", measured.sample_rate, columns))


@pytest.mark.parametrize("source", ["sensor", "derivative"])
@pytest.mark.parametrize("factor", [1000.0, 60.0])
def test_times_in_another_unit_are_refused(run, source, factor):
    measured, rig = Traces.from_run(run), RIG.replace({"controller.velocity_source": source})
    assert eft.replay(rig, measured).time.size == COMMAND.values.size // 16
    with pytest.raises(ValueError, match=r"^m.csv: displacement = .* times that by the .*: check the unit"):
        eft.replay(rig, Traces("m.csv", factor * measured.sample_rate, measured.columns))


@pytest.mark.parametrize("factor", [-1.0, 1000.0, 1 / 0.0254, 0.3048])
def test_a_displacement_of_another_sign_or_unit_is_refused(run, factor):
    measured = Traces.from_run(run)
    columns = dict(measured.columns) | {"measured_displacement": factor * run.measured_displacement}
    with pytest.raises(ValueError, match=r"times that by the velocity: must be 0\.5 to 2 times"):
        eft.replay(RIG, Traces("m.csv", measured.sample_rate, columns))


@pytest.mark.parametrize("name", ["command", "measured_force", "measured_velocity", "measured_displacement"])
@pytest.mark.parametrize("lost", [slice(9000, 9003), slice(None)])
def test_lost_samples_are_no_other_unit(run, name, lost):
    measured = Traces.from_run(run)
    signal = measured[name].copy()
    signal[lost] = np.nan
    columns = dict(measured.columns) | {name: signal}
    assert eft.replay(RIG, Traces("m.csv", measured.sample_rate, columns)).time.size > 0


def test_an_unstable_test_is_replayed():
    run = eft.simulate(RIG.replace({"servovalve.flow_gain_scale": 1.6}), COMMAND)
    assert not run.verdict.ok
    assert eft.replay(RIG, run).time.size > 0


def test_what_is_missing_is_named(run):
    with pytest.raises(ValueError, match="no signal acceleration"):
        eft.replay(RIG.replace({"controller.velocity_source": "accelerometer"}), run)
    with pytest.raises(ValueError, match="sample_rate = 100"):
        eft.replay(RIG, eft.simulate(RIG, eft.sine_sweep(100.0, 0.5, 4.0, 1.0, 100.0)))


# Sensor noise of 0.05 % of range.
NOISE = {"sensors.force.noise": 78.0, "sensors.velocity.noise": 5e-4, "sensors.spool.noise": 5e-4}


def learned(seed, command, factor):
    noise = {"sensors.seed": seed, **{key: factor * value for key, value in NOISE.items()}}
    run = eft.simulate(RIG.replace({"servovalve.flow_gain_scale": 0.95, **noise}), command)
    replay = eft.replay(RIG, run)
    names = ("flow_gain", "valve_gain", "response_delay")
    estimates = [getattr(replay, f"{name}_estimate")[-1] for name in names]
    return estimates, [getattr(replay, f"{name}_deviation")[-1] for name in names]


@pytest.mark.parametrize(("amplitude", "factor"), [(2200.0, 1.0), (2200.0, 4.0)])
def test_estimates_scatter_as_their_standard_deviations_say(amplitude, factor):
    command = eft.sine_sweep(amplitude, 0.5, 4.0, 6.0, 4096.0)
    estimates, deviations = np.array([learned(seed, command, factor) for seed in range(40)]).swapaxes(0, 1)
    quiet, left_out = learned(0, command, 0.0)
    # Gain and delay of the valve are those of its lead network in this motion, as in a test without noise.
    within = np.mean(np.abs(estimates - [0.95, *quiet[1:]]) <= 2.0 * deviations, axis=0)
    assert np.all(within >= 0.9), within
    # The rest is the scatter by noise, neither too small nor too large.
    scatter = np.sqrt(np.square(deviations).mean(axis=0) - np.square(left_out))
    within = np.mean(np.abs(estimates - [0.95, *quiet[1:]]) <= 2.0 * scatter, axis=0)
    assert np.all(within >= 0.9), within
    ratio = estimates.std(axis=0) / scatter
    assert np.all((ratio > 0.5) & (ratio < 1.25)), ratio


def test_before_anything_is_learned_the_standard_deviations_are_infinite(run):
    replay = eft.replay(RIG, run)
    assert np.isinf(replay.flow_gain_deviation[0]) and np.isinf(replay.response_delay_deviation[0])
    last = [replay.flow_gain_deviation[-1], replay.valve_gain_deviation[-1]]
    assert np.all(np.isfinite(last)) and np.all(np.array(last) > 0.0)
