"""The flow curve of a valve from tests of the virtual rig, and from late, noisy, drifting or useless data."""

import numpy as np
import pytest

import eft
from strokes import RIG, STROKE, strokes

AREA = RIG["actuator.piston_area"]


@pytest.fixture(scope="module")
def flow_tests():
    runs = strokes()
    return [run.spool for run in runs], [run.displacement for run in runs]


def test_flow_curve_of_the_virtual_rig(flow_tests):
    estimate = eft.identify_flow_curve(*flow_tests, 2048.0, AREA)
    truth = np.array(RIG["servovalve.flow_table"]["flows"])
    error = abs(estimate.flows - truth) / truth[-1]
    assert estimate.measured.sum() >= 15
    assert error[estimate.measured].max() < 0.01
    table = eft.identify_flow_curve(*flow_tests, 2048.0, AREA)
    assert isinstance(table, eft.FlowTable)
    assert table == estimate
    assert RIG.replace({"servovalve.flow_table": table})["servovalve.flow_table"]["flows"] == list(
        table.flows
    )
    # Points beyond the data lie on the line through the last two.
    last = np.flatnonzero(estimate.measured)[-1]
    slope = np.diff(table.flows)[last - 1]
    np.testing.assert_allclose(np.diff(table.flows)[last:], slope, rtol=1e-9)


def _under_a_falling_supply(pressure):
    """Flow tests whose supply falls to a share of its pressure, with noise of 0.1 mm."""
    times, pressures = [0.0, 4.0], [RIG["supply.pressure"], pressure * RIG["supply.pressure"]]
    rig = RIG.replace({"truth.supply.schedule.times": times, "truth.supply.schedule.pressures": pressures})
    rng = np.random.default_rng(0)
    tests = [eft.identification.flow_test(rig, share * STROKE) for share in (0.8, 0.55, 0.35, 0.15)]
    moved = [test.displacement + 1e-4 * rng.standard_normal(test.displacement.size) for test in tests]
    return [test.spool for test in tests], moved


def test_the_uncertainty_of_a_flow_curve_contains_a_falling_supply():
    truth = np.array(RIG["servovalve.flow_table"]["flows"])
    for pressure in (0.97, 0.9):
        found = eft.identify_flow_curve(*_under_a_falling_supply(pressure), 2048.0, AREA)
        reached = np.array(found.measured) & (truth != 0.0)
        missed = ((np.array(found.flows) - truth) / found.uncertainty)[reached]
        assert np.sqrt(np.mean(missed**2)) < 1.5
        # The flow at the end differs from that in the middle by half of the change.
        change = 0.5 * (1.0 - np.sqrt(pressure))
        assert (found.uncertainty > 0.9 * change * abs(truth))[reached].all()
    with pytest.raises(ValueError, match=r"flow = -17 % from the first to the last sample: must change by"):
        eft.identify_flow_curve(*_under_a_falling_supply(0.7), 2048.0, AREA)


def _deviations(changes, noise, of_opening=lambda spool: spool):
    """Largest error of the measured flows of a changed rig's flow tests, in stated uncertainties."""
    rng = np.random.default_rng(3)
    tests = strokes(*changes.items())
    spool = [of_opening(test.spool) + 1e-3 * noise * rng.standard_normal(test.spool.size) for test in tests]
    moved = [test.displacement + 5e-5 * noise * rng.standard_normal(test.spool.size) for test in tests]
    found = eft.identify_flow_curve(spool, moved, 2048.0, AREA)
    reached = found.measured & (found.openings != 0.0)
    truth = np.array(RIG["servovalve.flow_table"]["flows"])
    return np.max(np.abs(found.flows - truth)[reached] / found.uncertainty[reached])


def test_what_the_uncertainty_of_a_flow_curve_contains():
    assert _deviations({}, 1.0) < 3.0
    assert _deviations({"truth.actuator.leakage": 1e-10}, 1.0) < 3.0
    assert _deviations({}, 0.0, lambda spool: np.round(spool * 2048) / 2048) < 3.0
    overlapped, biased = ({f"truth.servovalve.{name}": 0.01} for name in ("overlap", "null_bias"))
    for changes in (overlapped, biased):
        few, many = (_deviations(changes, noise) for noise in (0.0, 1.0))
        assert 4.9 < few < 60.0 and 4.9 < many < 60.0
    assert _deviations({}, 1.0, lambda spool: spool + 0.01) > 5.0
    assert _deviations({}, 1.0, lambda spool: 1.02 * spool) > 5.0

    def corrected(spool):
        opening = spool - 0.01
        return opening - np.clip(opening, -0.01, 0.01)

    assert _deviations(overlapped | biased, 1.0, corrected) < 3.0


def test_flow_curve_with_noise_drift_and_gaps(flow_tests):
    rng = np.random.default_rng(2)
    spool = [s + 0.01 * rng.standard_normal(s.size) for s in flow_tests[0]]
    displacement = [
        x + 0.01 * STROKE * rng.standard_normal(x.size) + 0.002 + 1e-6 * np.arange(x.size)
        for x in flow_tests[1]
    ]
    displacement[0][3000:3100] = np.nan
    spool[2][100:200] = np.nan
    estimate = eft.identify_flow_curve(spool, displacement, 2048.0, AREA)
    truth = np.array(RIG["servovalve.flow_table"]["flows"])
    error = abs(estimate.flows - truth)
    assert (error / truth[-1])[estimate.measured].max() < 0.02
    assert (error < 6 * estimate.uncertainty + 0.01 * truth[-1])[estimate.measured].all()
    gain = eft.identification.identify_flow_gain(spool, displacement, 2048.0, AREA)
    assert gain == pytest.approx(1016 * 1.6387064e-5, rel=0.02)


@pytest.mark.parametrize("masked", [False, True])
def test_lost_samples_do_not_change_the_flow_curve(masked):
    rng = np.random.default_rng(4)
    test = eft.identification.flow_test(RIG, 0.8 * STROKE)
    noisy = test.spool + 1e-3 * rng.standard_normal(test.spool.size)
    whole = eft.identify_flow_curve(noisy, test.displacement, 2048.0, AREA)
    lost = rng.random((2, noisy.size)) < 0.05
    # A recorder leaves a number in place of a lost sample, which only the mask tells.
    given = [
        np.where(gone, np.nan, kept) for gone, kept in zip(lost, (noisy, test.displacement), strict=True)
    ]
    if masked:
        given = [np.ma.masked_invalid(one) for one in given]
        given = [np.ma.array(np.where(one.mask, 0.3, one.data), mask=one.mask) for one in given]
    found = eft.identify_flow_curve(*given, 2048.0, AREA)
    assert (found.measured == whole.measured).all()
    off = abs(found.flows - whole.flows)[found.measured]
    assert (off <= 2.0 * whole.uncertainty[found.measured] + 1e-3 * whole.flows[-1]).all()
    gain = eft.identification.identify_flow_gain(*given, 2048.0, AREA)
    assert gain == pytest.approx(1016 * 1.6387064e-5, rel=0.02)


def test_gaps_throughout_are_refused_with_the_reason():
    spool, moved = np.zeros(2000), np.zeros(2000)
    spool[::5] = moved[1::5] = moved[2::5] = np.nan
    spool[3::40] = spool[4::40] = spool[2::40] = spool[1::40] = np.nan
    with pytest.raises(ValueError, match=r"^spool and displacement = gaps throughout: must have 100 samples"):
        eft.identify_flow_curve(spool, moved, 2048.0, AREA)


def test_a_flow_that_is_more_uncertain_than_large_is_refused():
    # One stroke beyond the pump and the valve: the pressure falls, and few samples are near null.
    rig = eft.data_sheets.rig(
        {
            "structure": {"mass": "3 t", "frequency": "3 Hz", "damping_ratio": "2 %"},
            "actuator": {"force": "100 kN", "stroke": "150 mm"},
            "servovalve": {"rated_flow": "40 gpm", "rated_drop": "1000 psi", "phase_90_frequency": "70 Hz"},
            "supply": {
                "pressure": "3000 psi",
                "pump_flow": "20 gpm",
                "accumulator_volume": "10 gal",
                "precharge": "1500 psi",
            },
        }
    )
    _, moved, spool = eft.identification.flow_test(rig, 0.06)
    area = rig["actuator.piston_area"]
    table = rig["servovalve.flow_table"]
    found = eft.identify_flow_curve(spool, moved, 2048.0, area)
    reached = found.measured & (found.openings != 0.0)
    missed = found.flows - np.interp(found.openings, table["openings"], table["flows"])
    assert (abs(missed) < 2.0 * found.uncertainty)[reached].all()
    # Knots too near to null for a recording with much noise.
    spool = spool + 1e-2 * np.random.default_rng(0).standard_normal(spool.size)
    with pytest.raises(ValueError, match=r"flow at the opening .* ± .* must exceed its uncertainty"):
        eft.identify_flow_curve(spool, moved, 2048.0, area, 63)
    with pytest.raises(ValueError, match=r"flow_gain = .* ± .* must exceed its uncertainty"):
        eft.identification.identify_flow_gain(spool, moved, 2048.0, area, limit=0.01)


def test_the_paper_s_flow_curve_compared_with_ours(flow_tests):
    truth = np.array(RIG["servovalve.flow_table"]["flows"])
    by_difference = eft.identify_flow_curve(*flow_tests, 2048.0, AREA, method="difference")
    error = abs(by_difference.flows - truth) / truth[-1]
    assert by_difference.measured.sum() >= 15
    assert error[by_difference.measured].max() < 0.01
    # NumPy's own mean of central differences at a few control points.
    spool = np.concatenate(flow_tests[0])
    flow = np.concatenate([AREA * np.gradient(x, 1 / 2048.0) for x in flow_tests[1]])
    for point in (-0.6, 0.3, 0.7):
        near = abs(spool - point) < 0.02
        at = np.argmin(abs(by_difference.openings - point))
        assert by_difference.flows[at] == pytest.approx(flow[near].mean(), rel=2e-3)
    # With 1 % of noise on both sensors it finds no curve; the fit still does.
    rng = np.random.default_rng(2)
    noisy = [x + 0.01 * STROKE * rng.standard_normal(x.size) for x in flow_tests[1]]
    blurred = [s + 0.01 * rng.standard_normal(s.size) for s in flow_tests[0]]
    with pytest.raises(ValueError, match="must rise with the opening"):
        eft.identify_flow_curve(blurred, noisy, 2048.0, AREA, method="difference")
    good = eft.identify_flow_curve(blurred, noisy, 2048.0, AREA)
    assert (abs(good.flows - truth) / truth[-1])[good.measured].max() < 0.02
    with pytest.raises(ValueError, match='method = "mean": must be "integral" or "difference"'):
        eft.identify_flow_curve(*flow_tests, 2048.0, AREA, method="mean")
