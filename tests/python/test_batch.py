"""Many tests in one native call: each has the bits of a single test."""

import _thread
import threading
import time

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import eft
from eft import _native
from eft._samples import Samples
from eft._table import METRICS

RATE = 4096.0
WITHOUT_FFT = {name for name, metric in METRICS.items() if not metric.costly}


def sweep(amplitude=8900.0, duration=2.0):
    return eft.sine_sweep(amplitude, 0.0, 10.0, duration, RATE)


@pytest.fixture(scope="module")
def rigs():
    rig = eft.Rig.zhao2005()
    robust = rig.replace({"controller.force_loop": "robust", "compensation.feedforward": True})
    return [
        rig,
        rig.replace({"compensation.mode": "linear"}),
        rig.replace({"compensation.mode": "off", "servovalve.flow_gain_scale": 0.9}),
        rig.replace({"controller.realization": "digital"}),
        rig.replace({"sensors.force.noise": 20.0}),
        rig.replace({"compensation.adaptive": True}),
        rig.replace({"structure.mass": 8000.0}),
        rig.replace({"supply.droop": 2e8, "supply.accumulator": 7e-10}),
        *(
            robust.replace(
                {"servovalve.overlap": overlap, "actuator.friction": rubs, "controller.force_delay": late}
            )
            for overlap, rubs, late in (
                (0.0, 0.0, 0.0),
                (1e-3, 300.0, 8e-4),
                (0.0, 900.0, 2e-3),
                (4e-4, 0.0, 0.0),
            )
        ),
    ]


@pytest.mark.parametrize("dtype", ["f64", "f32"])
@pytest.mark.parametrize("threads", [1, 2])
def test_each_has_the_bits_of_a_single_test(rigs, dtype, threads):
    commands = [sweep(1000.0 * (i + 1), 2.0 + 0.5 * (i % 2)) for i in range(len(rigs))]
    entries = _native.simulate_batch(rigs, commands, dtype=dtype, threads=threads, traces=True)
    for rig, command, entry in zip(rigs, commands, entries, strict=True):
        alone = eft.simulate(rig, command, dtype)
        assert entry.metrics == alone.metrics()
        assert list(entry.metrics) == list(alone.metrics())
        assert (entry.status, entry.samples, entry.finished) == (alone.flags, len(alone), True)
        assert entry.traces is not None
        energy = entry.traces.pop("energy")
        assert energy is None or eft.EnergyBalance(**energy) == alone.energy
        assert entry.traces.pop("calibrations") == [alone.calibration]
        for name, trace in (entry.traces | dict(Samples(entry.traces))).items():
            assert_array_equal(trace, getattr(alone, name), strict=True)


def test_without_transforms_the_other_metrics_are_the_same(rigs):
    command = sweep()
    full = _native.simulate_batch(rigs, command)
    for entry, all_of_it in zip(_native.simulate_batch(rigs, command, fft=False), full, strict=True):
        assert set(entry.metrics) == WITHOUT_FFT
        assert entry.metrics == {name: all_of_it.metrics[name] for name in entry.metrics}
        assert entry.traces is None


def test_a_refused_test_does_not_affect_the_others():
    rig = eft.Rig.zhao2005()
    building = rig.replace(
        {
            "structure.kind": "shear_building",
            "structure.stories": {"masses": [7e3], "dampings": [4e3], "stiffnesses": [7e5]},
        }
    )
    silence = eft.Command(np.zeros(100), RATE)
    commands = [sweep(), sweep(), silence, sweep(100.0)]
    good, refused, unjudged, last = _native.simulate_batch([rig, building, rig, rig], commands, threads=1)
    assert refused.startswith("command = one actuator")
    assert unjudged.startswith("command = zero at every sample")
    for entry, command in ((good, commands[0]), (last, commands[3])):
        assert entry.metrics == eft.simulate(rig, command).metrics()


def test_a_diverged_test_differs_from_a_finished_one():
    rig = eft.Rig.zhao2005()
    wild = rig.replace({"structure.mass": 1e-3})
    entries = _native.simulate_batch([wild, rig], sweep(duration=1.0), fft=False)
    diverged, finished = entries
    alone = eft.simulate(wild, sweep(duration=1.0))
    assert not alone.success
    assert not diverged.finished
    assert diverged.samples == len(alone) < finished.samples
    assert diverged.status == alone.flags
    assert finished.finished


def test_wrong_arguments_are_named():
    rig = eft.Rig.zhao2005()
    with pytest.raises(
        ValueError, match=r"^commands = 1 commands: must be one, or one for each of the 2 rigs"
    ):
        _native.simulate_batch([rig, rig], [sweep()])
    with pytest.raises(ValueError, match=r'^method = "euler": must be "exponential" or "runge-kutta"'):
        _native.simulate_batch([rig], sweep(), method="euler")
    with pytest.raises(ValueError, match=r"^threads = 0"):
        _native.simulate_batch([rig], sweep(), threads=0)
    assert _native.simulate_batch([], sweep()) == []
    refused = _native.simulate_batch([rig], sweep(), largest_step=-1.0)[0]
    assert refused.startswith("largest_step = -1")


def test_ctrl_c_stops_a_batch():
    rig = eft.Rig.zhao2005()
    command = sweep(duration=60.0)
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    start = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        _native.simulate_batch([rig] * 4000, command, fft=False)
    timer.join()
    assert time.perf_counter() - start < 10.0
