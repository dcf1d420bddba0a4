"""Failures of a sensor that disturb its reading: dead, offset, drift and noise."""

import numpy as np
import pytest

import eft

RATE, START, LASTS = 4096.0, 0.5, 1.0
SWEEP = eft.sine_sweep(4000.0, 0.0, 10.0, 2.0, RATE)
FAILED = (np.arange(len(SWEEP.values)) >= START * RATE) & (
    np.arange(len(SWEEP.values)) < (START + LASTS) * RATE
)
SIGNALS = {
    "force": 500.0,
    "velocity": 0.01,
    "displacement": 1e-3,
    "spool": 0.02,
    "supply_pressure": 1e5,
    "acceleration": 0.5,
    "load_pressure": 1e5,
}


def added(signal: str, kind: str, size: float | None, **further: object) -> np.ndarray:
    """Reading of a failing sensor minus the truth."""
    fault = {"signal": signal, "kind": kind, "start": START, "duration": LASTS}
    fault |= {kind: size} if size is not None else {}
    changes = {f"sensors.fault.{key}": value for key, value in fault.items()} | further
    run = eft.simulate(eft.Rig.zhao2005().replace(changes), SWEEP)
    return getattr(run, f"measured_{signal}") - getattr(run, signal)


@pytest.mark.parametrize(("signal", "size"), SIGNALS.items())
def test_a_fault_disturbs_the_reading_of_its_sensor_while_it_lasts(signal, size):
    seconds = np.arange(FAILED.sum()) / RATE
    for kind, expected in (("offset", size), ("drift", size * seconds)):
        error = added(signal, kind, size)
        np.testing.assert_allclose(error[FAILED], np.broadcast_to(expected, FAILED.sum()), atol=1e-6 * size)
        assert not error[~FAILED].any()
    error = added(signal, "noise", size)
    # Four standard errors.
    assert error[FAILED].std() == pytest.approx(size, rel=4.0 / np.sqrt(2.0 * FAILED.sum()))
    assert not error[~FAILED].any()
    np.testing.assert_array_equal(error, added(signal, "noise", size))
    assert (error != added(signal, "noise", size, **{"sensors.seed": 5})).any()


def test_a_dead_load_cell_has_its_noise_without_the_force():
    fault = {"sensors.fault.signal": "force", "sensors.fault.kind": "dead", "sensors.fault.start": START}
    rig = eft.Rig.zhao2005().replace(fault | {"sensors.force.noise": 80.0, "sensors.force.bias": 200.0})
    read = eft.simulate(rig, SWEEP).measured_force[int(START * RATE) :]
    assert read.mean() == pytest.approx(200.0, abs=4.0 * 80.0 / np.sqrt(len(read)))
    assert read.std() == pytest.approx(80.0, rel=4.0 / np.sqrt(2.0 * len(read)))


@pytest.mark.parametrize("kind", ["offset", "drift", "noise"])
def test_a_fault_without_its_size_is_refused(kind):
    fault = {"sensors.fault.signal": "force", "sensors.fault.kind": kind, "sensors.fault.start": START}
    with pytest.raises(ValueError, match=f"sensors.fault.{kind}"):
        eft.Rig.zhao2005().replace(fault)
