"""A test from Python: its traces, metrics and file, and that it does not block other threads."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

import eft

RIG = eft.Rig.zhao2005()
SHORT = eft.sine_sweep(2200.0, 0.0, 10.0, 4.0, 1024.0)


@pytest.fixture(scope="module")
def run():
    return eft.simulate(RIG, SHORT)


def test_every_trace_has_one_value_per_sample(run):
    assert len(run) == len(SHORT)
    for name in run._traces:
        trace = getattr(run, name)
        assert trace.shape == (len(SHORT),)
        assert trace.dtype == (np.uint32 if name == "status" else np.float64)
    np.testing.assert_array_equal(run.time, SHORT.time)
    np.testing.assert_array_equal(run.command, SHORT.values)
    np.testing.assert_allclose(run.force, 8.212e-3 * run.load_pressure, rtol=1e-12)
    assert run.force[0] == 0.0 and run.displacement[0] == 0.0
    time, force = run
    assert time is run.time and force is run.force


def test_velocity_is_the_derivative_of_displacement(run):
    slope = np.gradient(run.displacement, run.time)
    assert np.abs(slope - run.velocity)[1:-1].max() < 1e-3 * np.abs(run.velocity).max()


def test_ideal_sensors_report_what_is(run):
    for name in ("force", "velocity", "displacement", "spool"):
        np.testing.assert_array_equal(getattr(run, f"measured_{name}"), getattr(run, name))


def test_sensors_report_beside_the_truth():
    rig = RIG.replace({"sensors.force.noise": 50.0, "sensors.force.bias": 200.0, "sensors.seed": 3})
    run = eft.simulate(rig, SHORT)
    error = run.measured_force - run.force
    assert error.mean() == pytest.approx(200.0, abs=5 * 50.0 / np.sqrt(len(run)))
    assert error.std() == pytest.approx(50.0, rel=0.05)
    np.testing.assert_array_equal(run.measured_spool, run.spool)
    other = eft.simulate(rig.replace({"sensors.seed": 4}), SHORT)
    assert not np.array_equal(other.measured_force, run.measured_force)


def test_metrics_are_what_their_formulas_say(run):
    error = run.force - run.command
    metrics = run.metrics()
    assert metrics["nrmse"] == pytest.approx(np.sqrt((error**2).sum() / (run.command**2).sum()), rel=1e-12)
    assert metrics["peak_error"] == pytest.approx(np.abs(error).max() / np.abs(run.command).max(), rel=1e-12)
    assert metrics["max_spool"] == np.abs(run.spool).max()
    assert all(isinstance(value, float) and np.isfinite(value) for value in metrics.values())
    spectrum, wanted = np.fft.rfft(run.force), np.fft.rfft(run.command)
    power = np.abs(wanted) ** 2
    index = (spectrum * wanted.conj()).sum() / power.sum()
    frequency = (power * np.fft.rfftfreq(len(run), 1 / 1024.0)).sum() / power.sum()
    assert metrics["fei_amplitude"] == pytest.approx(abs(index), rel=1e-3)
    assert metrics["fei_delay"] == pytest.approx(-np.angle(index) / (2 * np.pi * frequency), rel=1e-2)


def test_the_delay_is_signed_and_finer_than_a_sample(run):
    # The force has no delay relative to itself, and three samples after a shift by three.
    from eft import _native

    assert _native.metrics(run.force, run.force, 1024.0)["delay"] == pytest.approx(0.0, abs=1e-9)
    later = _native.metrics(run.force[3:], run.force[:-3], 1024.0)["delay"]
    earlier = _native.metrics(run.force[:-3], run.force[3:], 1024.0)["delay"]
    assert later == pytest.approx(3 / 1024.0, rel=0.05)
    assert earlier == pytest.approx(-3 / 1024.0, rel=0.05)


def test_what_has_no_answer_is_nan_under_its_key():
    from eft import _native

    silent = _native.metrics([1.0, -2.0, 1.0], [0.0, 0.0, 0.0], 10.0)
    assert np.isnan(silent["delay"]) and silent["nrmse"] == 1.0
    assert silent.keys() == _native.metrics([1.0, -2.0, 1.0], [1.0, -1.0, 0.0], 10.0).keys()


def test_the_ratio_is_that_of_the_spectra(run):
    frequency, ratio = run.fft_ratio(1.0, 5.0)
    bins = np.fft.rfftfreq(len(run), 1 / 1024.0)
    inside = (bins >= 1.0) & (bins <= 5.0)
    expected = np.abs(np.fft.rfft(run.force) / np.fft.rfft(run.command))[inside]
    np.testing.assert_allclose(frequency, bins[inside], rtol=1e-12)
    np.testing.assert_allclose(ratio, expected, rtol=1e-9)
    with pytest.raises(ValueError, match=r"^f_high = 600: must lie within"):
        run.fft_ratio(1.0, 600.0)


def test_the_coherence_is_scipys(run):
    signal = pytest.importorskip("scipy.signal")
    found = run.coherence(segment=0.5)
    frequency, expected = signal.coherence(run.command, run.force, 1024.0, "hann", 512, detrend="constant")
    at = np.isin(frequency, found.frequency)
    assert at.sum() == found.frequency.size > 200
    np.testing.assert_allclose(found.coherence, expected[at], atol=1e-8)
    with pytest.raises(ValueError, match="segment = -1"):
        run.coherence(-1.0)
    with pytest.raises(ValueError, match="segment = "):
        run.coherence(100.0)


def test_a_command_of_zeros_runs_but_cannot_be_judged():
    run = eft.simulate(RIG, eft.Command(np.zeros(100), 1000.0))
    assert run.success
    assert not run.force.any()
    with pytest.raises(ValueError, match="zero at every sample"):
        run.metrics()


def test_a_run_says_how_it_went(run):
    assert run.success and run.flags == 0 and run.message == "completed"
    hard = eft.simulate(RIG, eft.sine_sweep(40e3, 0.0, 10.0, 8.0, 1024.0))
    assert eft.Status.SPOOL_WARNING in hard.flags
    opened = np.abs(hard.spool) > 0.6
    assert ((hard.status & eft.Status.SPOOL_WARNING) != 0)[opened].all()
    assert "spool_warning from " in hard.message and hard.message.startswith("stroke_exceeded after ")
    assert "spool_warning" in repr(hard)


def test_flags_have_the_names_of_the_core():
    from eft import _native

    assert {flag.name.lower(): int(flag) for flag in eft.Status} == _native.status_flags()
    assert {cause.name.lower(): int(cause) for cause in eft.Cause} == _native.trip_causes()


def test_pandas_and_control_get_the_same_numbers(run):
    frame = run.to_pandas()
    assert frame.index.name == "time" and list(frame.columns) == list(run._traces)
    np.testing.assert_array_equal(frame["force"].to_numpy(), run.force)
    np.testing.assert_array_equal(frame.index.to_numpy(), run.time)
    response = run.to_control()
    time, output = response
    np.testing.assert_array_equal(time, run.time)
    np.testing.assert_array_equal(output, run.force)
    np.testing.assert_array_equal(np.ravel(response.inputs), run.command)


def test_xarray_gets_the_traces_with_units_and_origin(run, tmp_path):
    dataset = run.to_xarray()
    assert dict(dataset.sizes) == {"time": len(run)} and list(dataset.data_vars) == list(run._traces)
    np.testing.assert_array_equal(dataset["time"], run.time)
    assert dataset["time"].attrs["units"] == "s" and dataset["spool"].attrs["units"] == "1"
    for name in run._traces:
        np.testing.assert_array_equal(dataset[name], getattr(run, name))
    assert dataset["load_pressure"].attrs == {"units": "Pa", "long_name": "Load pressure"}
    flags = dataset["status"].attrs
    assert dict(zip(flags["flag_meanings"].split(), flags["flag_masks"], strict=True))["tripped"] == (
        eft.Status.TRIPPED
    )
    told = dataset.attrs
    assert eft.Rig(told["rig"]) == run.rig and told["version"] == eft.__version__
    assert (told["sample_rate"], told["dtype"], told["seed"]) == (run.sample_rate, "f64", run.seed)
    # What a file of the dataset cannot store is left out.
    assert told["date"] == run.date and not {"record", "scale", "mass", "stopped"} & set(told)
    motion = eft.Record(0.5 * np.sin(np.arange(200) / 5.0), 0.02, "a quake")
    quake = eft.simulate(RIG, eft.effective_force(motion, mass=7040.0, sample_rate=1024.0, scale=0.5))
    told = quake.to_xarray().attrs
    assert (told["record"], told["scale"], told["mass"]) == ("a quake", 0.5, 7040.0)
    dataset.to_netcdf(tmp_path / "run.nc", engine="scipy")
    assert (tmp_path / "run.nc").stat().st_size > run.force.nbytes


def test_the_precision_is_the_controllers():
    single, double = (eft.simulate(RIG, SHORT, dtype) for dtype in ("f32", "f64"))
    apart = np.abs(single.force - double.force).max() / np.abs(double.force).max()
    assert 0.0 < apart < 1e-4
    np.testing.assert_array_equal(single.compensation, np.float32(single.compensation))
    with pytest.raises(ValueError, match=r'^dtype = "f16": must be "f32" or "f64"$'):
        eft.simulate(RIG, SHORT, "f16")


def test_the_same_test_gives_the_same_bits(run):
    again = eft.simulate(RIG, SHORT)
    for name in run._traces:
        np.testing.assert_array_equal(getattr(run, name), getattr(again, name))


def test_progress_is_told_and_may_stop_the_run():
    calls = []
    eft.simulate(RIG, SHORT, progress=lambda done, total: calls.append((done, total)))
    assert calls[0] == (0, len(SHORT)) and calls[-1] == (len(SHORT), len(SHORT))
    assert calls == sorted(calls)

    def stop(done, total):
        raise RuntimeError(f"enough at {done} of {total}")

    with pytest.raises(RuntimeError, match="enough at 0"):
        eft.simulate(RIG, SHORT, progress=stop)


def test_other_threads_go_on_while_a_test_runs():
    # A counting thread must be nearly as fast as alone. It would stop if the interpreter were locked.
    command = eft.sine_sweep(2200.0, 0.0, 10.0, 300.0, 4096.0)
    worker = threading.Thread(target=eft.simulate, args=(RIG, command))
    worker.start()
    ticks = 0
    while worker.is_alive():
        time.sleep(0.001)
        ticks += 1
    assert ticks > 20


LONG_CALLS = [
    "simulate(rig, command)",
    "check_feasibility(rig, command)",
    "ideal_response(rig, command)",
    "records.displacement_spectrum(eft.Record(command.values, 1e-4), range(1, 200))",
    "linear.stability_map(rig, ('compensation.level', [1.0] * 500), ('structure.mass', [7e3] * 500))",
]


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_stops_each_long_call():
    """In one process, which goes on after each of them."""
    script = textwrap.dedent(
        f"""
        import eft
        rig = eft.Rig.zhao2005()
        command = eft.sine_sweep(2200.0, 0.0, 10.0, 1000.0, 10000.0)
        for call in ({", ".join(f"lambda: eft.{call}" for call in LONG_CALLS)}):
            print("ready", flush=True)
            try:
                call()
            except KeyboardInterrupt:
                print("interrupted", flush=True)
        """
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        for call in LONG_CALLS:
            assert process.stdout.readline() == "ready\n", call
            time.sleep(0.1)
            asked = time.monotonic()
            process.send_signal(signal.SIGINT)
            assert process.stdout.readline() == "interrupted\n", call
            assert time.monotonic() - asked < 2.0, call
        assert process.wait(timeout=10) == 0


def test_the_ideal_response_is_that_of_the_structure_alone():
    # A slow ramp is followed statically: x = F/k but for the inertia at its start.
    rig = RIG.replace({"structure.kind": "linear", "structure.damping": 5e4})
    ramp = eft.Command(np.linspace(0.0, 10e3, 4000), 100.0)
    time, displacement, velocity = eft.ideal_response(rig, ramp)
    slope = 10e3 / time[-1] / 693.8e3
    np.testing.assert_allclose(velocity[-100:], slope, rtol=1e-6)
    lag = 5e4 / 693.8e3
    np.testing.assert_allclose(displacement[-100:], slope * (time[-100:] - lag), rtol=1e-6)


def test_the_converged_run_is_one_switch_away():
    rig, command = RIG, eft.sine_sweep(8900.0, 0.0, 10.0, 4.0, 4096.0)
    converged = eft.simulate(rig, command, converged=True).force
    peak = np.abs(converged).max()

    def error(**choice):
        return float(np.abs(eft.simulate(rig, command, **choice).force - converged).max() / peak)

    assert 0.0 < error() < 1e-4
    assert error(largest_step=1 / 8192) < error() / 3
    assert 0.0 < error(method="runge-kutta") < error()
    with pytest.raises(ValueError, match=r"^method = 'runge-kutta': must be left out"):
        eft.simulate(rig, command, method="runge-kutta", converged=True)
    with pytest.raises(ValueError, match=r"^largest_step = 0"):
        eft.simulate(rig, command, largest_step=0.0)
