"""Prepared records, spectra and the feasibility check, compared with SciPy and the paper."""

import numpy as np
import pytest
from scipy import signal

import eft

RIG = eft.Rig.zhao2005()
RNG = np.random.default_rng(5)
RECORD = eft.Record(signal.lfilter([0.2], [1, -0.8], RNG.standard_normal(3000)), 0.01, "noise")


def test_spectrum_is_that_of_scipy_s_oscillator():
    periods, damping = np.array([0.2, 0.8, 2.0]), 0.05
    found = eft.records.displacement_spectrum(RECORD, periods, damping)
    step = RECORD.dt / 20
    ground = np.interp(np.arange(0, RECORD.time[-1], step), RECORD.time, RECORD.acceleration)
    for period, peak in zip(periods, found, strict=True):
        omega = 2 * np.pi / period
        # Exact for an acceleration that is linear between its samples.
        oscillator = ([-1.0], [1.0, 2 * damping * omega, omega**2])
        numerator, denominator, _ = signal.cont2discrete(oscillator, step, "foh")
        displacement = signal.lfilter(numerator[0], denominator, ground)
        assert peak == pytest.approx(abs(displacement).max(), rel=5e-3)


def test_band_pass_is_that_of_scipy_run_both_ways():
    found = RECORD.band_passed(0.5, 15.0, order=4).acceleration
    high = signal.butter(4, 0.5, "high", fs=100.0, output="sos")
    low = signal.butter(4, 15.0, "low", fs=100.0, output="sos")
    expected = signal.sosfiltfilt(low, signal.sosfiltfilt(high, RECORD.acceleration))
    inside = slice(600, -600)
    # SciPy's filter is warped by the bilinear transform; the corner at 15 Hz of 50 shifts a little.
    error = np.linalg.norm((found - expected)[inside]) / np.linalg.norm(expected[inside])
    assert error < 0.05


def test_resampling_is_the_fourier_interpolation():
    smooth = RECORD.band_passed(0.5, 15.0)
    found = smooth.resampled(250.0)
    assert found.dt == 1 / 250
    expected = signal.resample(smooth.acceleration, int(len(smooth) * 2.5))
    inside = slice(500, 6500)
    np.testing.assert_allclose(found.acceleration[inside], expected[inside], atol=5e-3 * smooth.pga)


def test_baseline_scale_and_taper():
    drifting = eft.Record(RECORD.acceleration + 0.2 - 1e-4 * np.arange(len(RECORD)), RECORD.dt)
    np.testing.assert_allclose(
        drifting.baseline_corrected().acceleration, signal.detrend(drifting.acceleration), atol=1e-9
    )
    half = RECORD.scaled(acceleration=2.0, time=np.sqrt(0.25))
    assert half.dt == pytest.approx(0.005)
    np.testing.assert_array_equal(half.acceleration, 2 * RECORD.acceleration)
    faded = RECORD.tapered(1.0, 2.0)
    assert faded.acceleration[0] == faded.acceleration[-1] == 0
    np.testing.assert_array_equal(faded.acceleration[100:-201], RECORD.acceleration[100:-201])


def test_feasibility_of_the_paper_s_sweeps():
    sweep = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0)
    answer = eft.check_feasibility(RIG, sweep)
    assert answer.verdict == "go"
    demands = {demand.name: demand for demand in answer.demands}
    run = eft.simulate(RIG, sweep)
    assert demands["spool opening"].required == pytest.approx(abs(run.spool).max(), rel=0.1)
    assert demands["displacement"].required == pytest.approx(abs(run.displacement).max(), rel=0.1)
    assert demands["force"].required == pytest.approx(8900.0, rel=1e-3)
    assert answer.scheme == "nonlinear"
    assert answer.smallest_sample_rate < 4096
    assert answer.lowest_supply_pressure == RIG["supply.pressure"]
    refused = eft.check_feasibility(RIG, eft.sine_sweep(40e3, 0.0, 10.0, 32.0, 4096.0))
    assert refused.verdict == "no"
    assert any(reason.startswith("Displacement exceeds") for reason in refused.reasons)


@pytest.mark.parametrize(
    ("accumulator", "droop", "pump", "verdict"),
    [
        (1e-12, 3e9, 1.0, "caution"),
        (1e-10, 3e9, 1.0, "caution"),
        (1e-9, 1e9, 1.0, "go"),
        (5e-10, 1e8, 2e-4, "no"),
        (1e-10, 1e10, 1.0, "no"),
    ],
)
def test_the_supply_pressure_falls_as_in_the_test(accumulator, droop, pump, verdict):
    supply = {"supply.accumulator": accumulator, "supply.droop": droop, "supply.pump_flow": pump}
    learns = {
        "compensation.adaptive": True,
        "compensation.feedforward": True,
        "compensation.look_ahead": True,
    }
    rig = RIG.replace(supply | learns | {"compensation.supply_correction": True})
    sweep = eft.sine_sweep(2000.0, 0.0, 10.0, 16.0, 4096.0)
    answer, run = eft.check_feasibility(rig, sweep), eft.simulate(rig, sweep)
    fall = rig["supply.pressure"] - run.metrics()["min_supply_pressure"]
    assert rig["supply.pressure"] - answer.lowest_supply_pressure == pytest.approx(fall, rel=0.15)
    assert answer.verdict == run.verdict.grade == verdict
    if verdict != "go":
        assert any(reason.startswith("The supply pressure falls to") for reason in answer.reasons)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: RECORD.band_passed(5.0, 1.0), "band = "),
        (lambda: RECORD.band_passed(1e-9, 1.0), "must begin at 0.0002 Hz or above"),
        (lambda: RECORD.resampled(0.0), "rate = 0"),
        (lambda: RECORD.tapered(100.0, 0.0), "start = 100"),
        (lambda: RECORD.scaled(time=-1.0), "time = -1"),
        (lambda: eft.records.displacement_spectrum(RECORD, [0.0]), "period = 0"),
    ],
)
def test_bad_arguments_are_named(call, says):
    with pytest.raises(ValueError, match=says):
        call()
