"""Identification on the virtual rig's own tests, and on data that is late, noisy, drifting or useless."""

import pickle

import numpy as np
import pytest
from scipy import signal

import eft

RIG = eft.Rig.zhao2005()
AREA = RIG["actuator.piston_area"]
STROKE = RIG["actuator.stroke"]


def second_order_valve(delay, rate, seconds=32.0):
    """A sweep through a second-order valve integrated by SciPy, and its phase slope over 0.25-10 Hz."""
    omega, zeta = 2 * 0.96 / delay, 0.96
    system = signal.TransferFunction([omega**2], [1, 2 * zeta * omega, omega**2])
    time = np.arange(round(seconds * rate)) / rate
    sweep = np.sin(2 * np.pi * 0.5 * 10 / seconds * time**2)
    _, response, _ = signal.lsim(system, sweep, time)
    f = np.linspace(0.25, 10, 500)
    phase = np.unwrap(np.angle(signal.freqresp(system, 2 * np.pi * f)[1]))
    return sweep, response, -np.polyfit(f, phase, 1)[0] / (2 * np.pi)


@pytest.mark.parametrize("delay", [2e-3, 3e-3, 5e-3, 7e-3, 10e-3])
def test_delay_is_the_phase_slope(delay):
    sweep, response, slope = second_order_valve(delay, 1000.0)
    found = eft.identify_delay(sweep, response, 1000.0)
    assert found == pytest.approx(slope, rel=0.02)
    assert found.uncertainty < 0.02 * found
    rng = np.random.default_rng(1)
    dirty = response + 0.02 * rng.standard_normal(response.size) + 0.3 + 1e-5 * np.arange(response.size)
    dirty[4000:4050] = np.nan
    dirty[20000:20600] = np.nan
    found = eft.identify_delay(sweep, dirty, 1000.0)
    assert found == pytest.approx(slope, rel=0.02, abs=4 * found.uncertainty)


def test_delay_of_the_virtual_rig_and_its_sign():
    command, spool = eft.valve_test(RIG)
    delay = eft.identify_delay(command, spool, 2048.0)
    assert delay == pytest.approx(eft.delay_budget(RIG)["valve"] + 0.5 / 2048, rel=0.02)
    assert eft.identify_delay(spool, command, 2048.0) == pytest.approx(-delay, rel=1e-3)
    assert delay.details["coherence"] > 0.99
    assert delay.details["lag"].shape == delay.details["frequency"].shape


def test_an_estimate_is_a_number():
    estimate = eft.Estimate(5e-3, 1e-4, coherence=0.9)
    assert estimate * 2 == 1e-2
    assert isinstance(estimate, float)
    copy = pickle.loads(pickle.dumps(estimate))
    assert (copy, copy.uncertainty, copy.details) == (5e-3, 1e-4, {"coherence": 0.9})


@pytest.fixture(scope="module")
def flow_tests():
    runs = [eft.flow_test(RIG, amplitude=share * STROKE) for share in (0.9, 0.8, 0.6, 0.4, 0.2)]
    return [run[2] for run in runs], [run[1] for run in runs]


def test_flow_curve_of_the_virtual_rig(flow_tests):
    estimate = eft.flow_curve_estimate(*flow_tests, 2048.0, AREA)
    truth = np.array(RIG["servovalve.flow_table"]["flows"])
    error = abs(estimate.table.flows - truth) / truth[-1]
    assert estimate.measured.sum() >= 15
    assert error[estimate.measured].max() < 0.01
    table = eft.identify_flow_curve(*flow_tests, 2048.0, AREA)
    assert isinstance(table, eft.FlowTable)
    assert table == estimate.table
    assert RIG.replace({"servovalve.flow_table": table})["servovalve.flow_table"]["flows"] == list(
        table.flows
    )
    # Points beyond the data lie on the line through the last two.
    last = np.flatnonzero(estimate.measured)[-1]
    slope = np.diff(table.flows)[last - 1]
    np.testing.assert_allclose(np.diff(table.flows)[last:], slope, rtol=1e-9)


def test_flow_curve_with_noise_drift_and_gaps(flow_tests):
    rng = np.random.default_rng(2)
    spool = [s + 0.01 * rng.standard_normal(s.size) for s in flow_tests[0]]
    displacement = [
        x + 0.01 * STROKE * rng.standard_normal(x.size) + 0.002 + 1e-6 * np.arange(x.size)
        for x in flow_tests[1]
    ]
    displacement[0][3000:3100] = np.nan
    spool[2][100:200] = np.nan
    estimate = eft.flow_curve_estimate(spool, displacement, 2048.0, AREA)
    truth = np.array(RIG["servovalve.flow_table"]["flows"])
    error = abs(estimate.table.flows - truth)
    assert (error / truth[-1])[estimate.measured].max() < 0.02
    assert (error < 6 * estimate.uncertainty + 0.01 * truth[-1])[estimate.measured].all()
    gain = eft.identify_flow_gain(spool, displacement, 2048.0, AREA)
    assert gain == pytest.approx(1016 * 1.6387064e-5, rel=0.02)


def test_damping():
    free = eft.free_vibration(RIG, 0.02)
    damping = eft.identify_damping(free, 512.0)
    structure = RIG["structure"]
    critical = 2 * np.sqrt(structure["stiffness"] * structure["mass"])
    assert damping == pytest.approx(structure["damping"] / critical, rel=1e-3)
    noisy = free + 2e-4 * np.random.default_rng(3).standard_normal(free.size) + 1e-3
    assert eft.identify_damping(noisy, 512.0) == pytest.approx(structure["damping"] / critical, rel=0.02)
    natural = np.sqrt(structure["stiffness"] / structure["mass"]) / (2 * np.pi)
    assert damping.details["frequency"] == pytest.approx(natural, rel=1e-4)


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
        (lambda: eft.identify_damping(np.ones(1000), 100.0), "displacement = constant: must vibrate"),
    ],
)
def test_data_that_cannot_carry_an_answer_is_refused(call, says):
    with pytest.raises(ValueError, match=says):
        call()
