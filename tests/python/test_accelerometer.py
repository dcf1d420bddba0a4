"""An accelerometer on the structure: its reading, its faults, and its traces."""

import numpy as np
import pytest

import eft
from buildings import building, command_of, record
from eft import _native, traces

RATE = 4096.0
SWEEP = eft.sine_sweep(8900.0, 0.0, 10.0, 4.0, RATE)
READ = {"controller.velocity_source": "accelerometer"}
RIG = eft.Rig.zhao2005().replace(READ)
NOISY = {
    "sensors.acceleration.noise": 0.01,
    "sensors.acceleration.range": 19.6,
    "sensors.acceleration.bits": 16,
}
EFFECTS = {
    "bilinear": {},
    "linear": {"structure.kind": "linear"},
    "digital": {"controller.realization": "digital"},
    "yielding": {
        "structure.kind": "bouc_wen",
        "structure.bouc_wen.yield_displacement": 0.005,
        "structure.bouc_wen.post_yield_ratio": 0.3,
        "structure.bouc_wen.exponent": 1.0,
        "structure.bouc_wen.shape": 0.5,
    },
    "friction": {
        "actuator.friction": 300.0,
        "structure.power_damper.coefficient": 2e3,
        "structure.power_damper.exponent": 0.5,
    },
}


def differentiated(run):
    """Central differences and their largest error, a sixth of their change from tick to tick."""
    slope = (run.velocity[..., 2:] - run.velocity[..., :-2]) * run.sample_rate / 2
    return slope, np.abs(np.diff(slope, n=2)).max() + 1e-9


@pytest.mark.parametrize("effect", EFFECTS)
def test_the_true_acceleration_is_the_velocity_s_derivative(effect):
    run = eft.simulate(RIG.replace(EFFECTS[effect]), SWEEP)
    slope, error = differentiated(run)
    assert np.abs(slope).max() > 1.0
    assert error < 0.05
    np.testing.assert_allclose(run.acceleration[1:-1], slope, atol=error)
    np.testing.assert_array_equal(run.measured_acceleration, run.acceleration)


def test_every_floor_has_one():
    rig = building(2, **READ, **NOISY)
    run = eft.simulate(rig, command_of(rig, record(seconds=2.0)))
    slope, error = differentiated(run)
    assert np.abs(slope).max() > 0.3
    assert error < 0.05
    np.testing.assert_allclose(run.acceleration[:, 1:-1], slope, atol=error)
    noise = run.measured_acceleration - run.acceleration
    assert noise.std() == pytest.approx(0.01, rel=0.02)
    assert not np.array_equal(noise[0], noise[1])
    np.testing.assert_array_equal(run.actuator(1).measured_acceleration, run.measured_acceleration[1])


def test_a_rig_without_one_has_no_trace_and_the_same_bits():
    plain = eft.simulate(eft.Rig.zhao2005(), SWEEP)
    assert plain.acceleration is None
    assert plain.measured_acceleration is None
    assert "acceleration" not in plain.to_pandas()
    # If nothing reads it, it changes nothing.
    noisy = eft.simulate(eft.Rig.zhao2005().replace(NOISY), SWEEP)
    np.testing.assert_array_equal(noisy.force, plain.force)
    assert (noisy.measured_acceleration - noisy.acceleration).std() == pytest.approx(0.01, rel=0.03)


def test_its_traces_go_where_the_others_go(tmp_path):
    run = eft.simulate(RIG.replace(NOISY), SWEEP)
    back = eft.TestRun.load(run.save(tmp_path / "run.eft"))
    written = traces.Traces.from_run(run).columns
    frame = run.to_pandas()
    for name in ("acceleration", "measured_acceleration"):
        np.testing.assert_array_equal(getattr(back, name), getattr(run, name))
        np.testing.assert_array_equal(frame[name], getattr(run, name))
        np.testing.assert_array_equal(written[name], getattr(run, name))


def test_a_plant_reads_it():
    rig = RIG.replace({"controller.realization": "digital"})
    run = eft.simulate(rig, SWEEP, method="runge-kutta")
    plant = eft.Plant(rig)
    for wanted, command in zip(run.acceleration[:2000], run.valve_command, strict=False):
        assert plant.state.acceleration == pytest.approx(wanted, abs=1e-6)
        plant.step(command)
    assert np.abs(run.acceleration[:2000]).max() > 0.1
    # With an external structure it is the derivative of that structure's velocity.
    own = eft.Plant(rig, structure=lambda force, dt: (0.0, 0.01))
    assert own.step(0.0).acceleration == pytest.approx(0.01 * RATE)
    assert own.step(0.0).acceleration == 0.0


def test_tests_side_by_side_read_it_as_alone():
    rigs = [RIG.replace({**NOISY, "structure.damping": 4330.0 * (1 + 0.1 * i)}) for i in range(8)]
    rigs += [rig.replace({"controller.realization": "digital"}) for rig in rigs]
    for rig, entry in zip(rigs, _native.simulate_batch(rigs, SWEEP), strict=True):
        assert entry.metrics == eft.simulate(rig, SWEEP).metrics()


@pytest.mark.parametrize("realization", ["analog", "digital"])
def test_when_it_fails_the_output_is_held_and_the_flag_raised(realization):
    fault = {
        "sensors.fault.signal": "acceleration",
        "sensors.fault.kind": "lost",
        "sensors.fault.start": 2.0,
        "sensors.fault.duration": 0.01,
    }
    run = eft.simulate(RIG.replace({**fault, "controller.realization": realization}), SWEEP)
    lost = np.isnan(run.measured_acceleration)
    assert lost.sum() == 41
    np.testing.assert_array_equal((run.status & eft.Status.INVALID_MEASUREMENT) != 0, lost)
    assert (np.diff(run.compensation)[lost[1:]] == 0.0).all()
    assert run.success
    # A wrong reading makes the estimate wrong until the displacement corrects it.
    for kind in ("zero", "stuck", "sign"):
        lying = {**fault, "sensors.fault.kind": kind, "sensors.fault.duration": 0.2}
        ended = eft.simulate(RIG.replace(lying), eft.sine_sweep(2000.0, 0.0, 10.0, 8.0, RATE))
        missed = np.abs(ended.measured_velocity - ended.velocity)
        assert ended.success, kind
        assert missed[int(2.0 * RATE) : int(2.3 * RATE)].max() > 10 * missed[int(5.0 * RATE) :].max(), kind


@pytest.mark.parametrize(("delay", "bandwidth"), [(0, None), (4, None), (0, 100.0), (3, 200.0)])
def test_its_own_delay_is_in_the_budget(delay, bandwidth):
    late = {"sensors.acceleration.delay": delay, "sensors.displacement.delay": delay}
    if bandwidth:
        late |= {"sensors.acceleration.bandwidth": bandwidth, "sensors.displacement.bandwidth": bandwidth}
    rig = RIG.replace(late)
    expected = eft.linear.delay_budget(rig).sensor
    # With equal delays the estimate has the same delay.
    alone = delay / RATE + (1 / (2 * np.pi * bandwidth) if bandwidth else 0.0)
    assert expected == pytest.approx(alone, rel=0.02, abs=1e-6)
    run = eft.simulate(rig.replace({"compensation.level": 0.9}), SWEEP)
    slope = np.gradient(run.velocity) * RATE
    found = -((run.measured_velocity - run.velocity) @ slope) / (slope @ slope)
    assert found == pytest.approx(expected, rel=0.05, abs=5e-6)


def test_its_drift_enters_the_gains():
    slow, fast = (
        eft.linear.observer_gains(RIG.replace({"controller.accelerometer_drift": d})) for d in (1.0, 10.0)
    )
    assert all(a < b for a, b in zip(slow, fast, strict=True))
    # An observer with the force as input does not use it.
    by_force = {"controller.velocity_source": "observer", "controller.observer_mass": 7040.0}
    rig = eft.Rig.zhao2005().replace(by_force)
    assert eft.linear.observer_gains(rig) == eft.linear.observer_gains(
        rig.replace({"controller.accelerometer_drift": 10.0})
    )
    with pytest.raises(ValueError, match="accelerometer_drift = 0: must be a number between"):
        RIG.replace({"controller.accelerometer_drift": 0.0})
    with pytest.raises(ValueError, match=r"sensors\.acceleration\.range"):
        RIG.replace({"sensors.acceleration.bits": 16})
