"""Identification from tests of the virtual rig, and from late, noisy, drifting or useless data."""

import pickle
from functools import cache

import numpy as np
import pytest

import eft
import eft.traces

RIG = eft.Rig.zhao2005()
AREA = RIG["actuator.piston_area"]
STROKE = RIG["actuator.stroke"]


def test_an_estimate_is_a_number():
    estimate = eft.identification.Estimate(5e-3, 1e-4)
    assert estimate * 2 == 1e-2
    assert isinstance(estimate, float)
    copy = pickle.loads(pickle.dumps(estimate))
    assert (copy, copy.uncertainty, copy.details) == (5e-3, 1e-4, {})


@pytest.fixture(scope="module")
def flow_tests():
    runs = _strokes()
    return [run[2] for run in runs], [run[1] for run in runs]


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


@cache
def _strokes(*changes):
    """Flow tests of a rig with these changes."""
    rig = RIG.replace(dict(changes))
    return [eft.identification.flow_test(rig, share * STROKE) for share in (0.9, 0.8, 0.6, 0.4, 0.2)]


def _deviations(changes, noise, of_opening=lambda spool: spool):
    """Largest error of the measured flows of a changed rig's flow tests, in stated uncertainties."""
    rng = np.random.default_rng(3)
    tests = _strokes(*changes.items())
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


def test_damping():
    free = eft.identification.free_vibration(RIG, 0.02)
    damping = eft.identification.identify_damping(free, 512.0)
    structure = RIG["structure"]
    critical = 2 * np.sqrt(structure["stiffness"] * structure["mass"])
    assert damping == pytest.approx(structure["damping"] / critical, rel=1e-3)
    noisy = free + 2e-4 * np.random.default_rng(3).standard_normal(free.size) + 1e-3
    assert eft.identification.identify_damping(noisy, 512.0) == pytest.approx(
        structure["damping"] / critical, rel=0.02
    )
    natural = np.sqrt(structure["stiffness"] / structure["mass"]) / (2 * np.pi)
    assert damping.frequency == pytest.approx(natural, rel=1e-4)


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


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: eft.identify_delay([1.0] * 100, [1.0] * 99, 100.0), "response = 99 samples"),
        (lambda: eft.identify_delay([1.0] * 100, [1.0] * 100, 100.0), "command = 0 excited frequencies"),
        (lambda: eft.identify_delay(np.ones(100), np.ones(100), 10.0), "band = "),
        (
            lambda: eft.identify_flow_curve(np.ones(200) * 50, np.ones(200), 100.0, AREA),
            "spool = 50: must be a fraction",
        ),
        (lambda: eft.identify_flow_curve(np.zeros(200), np.zeros(200), 100.0, AREA), "spool"),
        (lambda: eft.identify_flow_curve([], [], 100.0, AREA), "spool"),
        (lambda: eft.identify_flow_curve(np.zeros(200), np.zeros(200), 100.0, AREA, knots=20), "knots = 20"),
        (
            lambda: eft.identification.identify_damping(np.ones(1000), 100.0),
            "displacement = constant: must vibrate",
        ),
    ],
)
def test_data_that_cannot_carry_an_answer_is_refused(call, says):
    with pytest.raises(ValueError, match=says):
        call()


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


def sweep_test(changes):
    rig = RIG.replace(changes)
    run = eft.simulate(rig, eft.sine_sweep(2200.0, 0.0, 10.0, 32.0, 2048.0))
    return rig, run


def tune(rig, run):
    return eft.identification.fine_tune(
        rig, run.command, run.measured_force, run.measured_velocity, run.sample_rate
    )


@pytest.mark.parametrize(
    ("level", "delay"), [(0.98, 5e-3), (1.02, 5e-3), (1.0, 3e-3), (1.0, 7e-3), (1.02, 7e-3)]
)
def test_the_settings_of_fig_11_are_tuned_back(level, delay):
    rig, run = sweep_test({"compensation.level": level, "compensation.response_delay": delay})
    found = tune(rig, run)
    exact = eft.linear.delay_budget(rig, 2048.0, (1.0, 2.5)).path
    assert found.level == pytest.approx(1.0, abs=0.005)
    assert found.response_delay == pytest.approx(exact, abs=0.15e-3)
    if level == 1.0:
        assert found.peak_before_valley == (delay < exact)
    else:
        assert (found.force_ratio < 1.0) == (level < 1.0)
    # With the proposed values little remains to tune, and the force is better.
    better = eft.simulate(found.apply(rig), eft.sine_sweep(2200.0, 0.0, 10.0, 32.0, 2048.0))
    assert better.metrics()["nrmse"] < run.metrics()["nrmse"]
    ratio = better.fft_ratio(1.2, 2.0).ratio
    assert ratio.min() > 0.95 and ratio.max() < 1.05


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_tuning_works_with_noise(seed):
    noise = {"sensors.force.noise": 40.0, "sensors.velocity.noise": 2e-3, "sensors.seed": seed}
    rig, run = sweep_test({"compensation.level": 0.98, "compensation.response_delay": 3e-3, **noise})
    found = tune(rig, run)
    exact = eft.linear.delay_budget(rig, 2048.0, (1.0, 2.5)).path
    assert found.level == pytest.approx(1.0, abs=0.006)
    assert found.response_delay == pytest.approx(exact, abs=0.3e-3)


def test_what_cannot_be_tuned_is_refused():
    rig, run = sweep_test({})
    with pytest.raises(ValueError, match="wrong sign"):
        eft.identification.fine_tune(rig, run.command, run.force, -run.velocity, run.sample_rate)
    with pytest.raises(ValueError, match="check the units"):
        eft.identification.fine_tune(rig, run.command, run.force / 1e3, run.velocity, run.sample_rate)
    for wrong in (1e-3, 1 / 4448.2):
        with pytest.raises(ValueError, match=r"as large as the force makes it: .* check units"):
            eft.identification.fine_tune(
                rig, wrong * run.command, wrong * run.force, run.velocity, run.sample_rate
            )
    for wrong in (1e3, 1 / 0.0254):
        with pytest.raises(ValueError, match=r"as large as the force makes it: .* check units"):
            eft.identification.fine_tune(rig, run.command, run.force, wrong * run.velocity, run.sample_rate)
    with pytest.raises(ValueError, match=r"compensation\.mode"):
        tune(rig.replace({"compensation.mode": "off"}), run)


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory, flow_tests):
    """Files of a laboratory in its own units, with offsets, drifts and empty cells."""
    folder = tmp_path_factory.mktemp("laboratory")

    def write(name, header, *columns):
        rows = [
            ",".join("" if np.isnan(x) else f"{x:.9g}" for x in row) for row in zip(*columns, strict=True)
        ]
        (folder / name).write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
        return folder / name

    command, spool = eft.identification.valve_test(RIG, sample_rate=1024.0)
    time = np.arange(command.size) / 1024.0
    spool = spool * 100 + 0.4
    spool[5000:5030] = np.nan
    files = {"valve": write("valve.csv", "time (s),valve command (V),spool (%)", time, command, spool)}
    files["flow"] = []
    for n, (opening, x) in enumerate(zip(*flow_tests, strict=True)):
        time = np.arange(x.size) / 2048.0
        moved = (x / 0.0254) + 0.1 + 1e-3 * time
        moved[1000:1003] = np.nan
        header = "time (s),spool,displacement (in)"
        files["flow"].append(write(f"flow{n}.csv", header, time, opening, moved))
    free = eft.identification.free_vibration(RIG, 0.02, sample_rate=256.0) * 1e3
    time = np.arange(free.size + 256) / 256.0
    held = np.concatenate([np.full(256, free[0]), free]) + 0.5
    files["release"] = write("release.csv", "time (s),displacement (mm)", time, held)
    _, run = sweep_test({"compensation.level": 0.98, "compensation.response_delay": 4e-3})
    kip = 4448.2216152605
    header = "time (s),command (kip),force (kip),velocity (in/s)"
    files["test"] = write(
        "test.csv", header, run.time, run.command / kip, run.force / kip, run.velocity / 0.0254
    )
    return files


def test_a_rig_is_identified_from_the_files_of_a_laboratory(laboratory):
    unknown = RIG.replace(
        {
            "compensation.response_delay": 2e-3,
            "compensation.flow_gain": 0.03,
            "servovalve.flow_table": {"openings": [-1.0, 0.0, 1.0], "flows": [-0.01, 0.0, 0.01]},
            "actuator.area_ratio": 1.3,
            "structure.damping": 1.0,
        }
    )
    found = eft.identify(
        unknown,
        valve=laboratory["valve"],
        flow=laboratory["flow"],
        release=laboratory["release"],
        released_at=1.0,
    )
    assert found.tuning is None
    slope = eft.linear.delay_budget(RIG).valve + 0.5 / 1024.0
    assert found.response_delay == pytest.approx(slope, rel=0.02)
    assert found.flow_gain == pytest.approx(1016 * 1.6387064e-5, rel=0.01)
    rig = found.rig
    assert rig["compensation.response_delay"] == float(found.response_delay)
    assert rig["compensation.flow_gain"] == float(found.flow_gain)
    assert rig["structure.damping"] == pytest.approx(RIG["structure.damping"], rel=0.02)
    truth = np.array(RIG["servovalve.flow_table"]["flows"])
    # A measured curve contains the ratio of the areas.
    assert rig["actuator.area_ratio"] == 1.0
    error = abs(np.array(rig["servovalve.flow_table"]["flows"]) - truth) / truth[-1]
    assert error[found.flow_curve.measured].max() < 0.01


def test_a_vibration_of_another_frequency_is_refused(laboratory):
    # The critical damping of the configured specimen would turn the ratio into a wrong damping.
    heavy = RIG.replace({"structure.mass": 4.0 * RIG["structure.mass"]})
    for rig in (heavy, RIG.replace({"structure.stiffness": 4.0 * RIG["structure.stiffness"]})):
        with pytest.raises(ValueError, match=r"release\.csv: .* free vibration at 1\.58 Hz: must be"):
            eft.identify(rig, release=laboratory["release"], released_at=1.0)


def test_a_test_in_kip_and_inches_tunes_the_rig(laboratory):
    rig = RIG.replace({"compensation.level": 0.98, "compensation.response_delay": 4e-3})
    found = eft.identify(rig, test=laboratory["test"])
    assert found.rig["compensation.level"] == pytest.approx(1.0, abs=0.005)
    assert found.rig == found.tuning.apply(rig)


def test_bad_files_are_refused_by_name_and_reason(laboratory, tmp_path):
    with pytest.raises(ValueError, match=r"release\.csv: no signal spool; the signals are displacement"):
        eft.identify(RIG, flow=[laboratory["release"]])
    flat = tmp_path / "flat.csv"
    flat.write_text("time (s),displacement (m)\n" + "\n".join(f"{i / 100},1" for i in range(400)))
    with pytest.raises(ValueError, match=r"flat\.csv: displacement = constant: must vibrate"):
        eft.identify(RIG, release=flat)
    text = tmp_path / "words.csv"
    text.write_text("time (s),displacement (m)\n0,1\n0.1,much\n")
    with pytest.raises(ValueError, match=r"words\.csv, line 3, column 2: `much` is not a number"):
        eft.identify(RIG, release=text)
    with pytest.raises(FileNotFoundError):
        eft.identify(RIG, release=tmp_path / "nowhere.csv")
    # In other functions a missing sample is an error.
    with pytest.raises(ValueError, match="column 3"):
        eft.traces.read_traces(laboratory["valve"])
