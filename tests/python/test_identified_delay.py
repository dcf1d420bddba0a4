"""Delays of a valve, from SciPy's integration and from the virtual rig."""

import numpy as np
import pytest
from scipy import signal

import eft

RIG = eft.Rig.zhao2005()


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
    command, spool = eft.identification.valve_test(RIG)
    delay = eft.identify_delay(command, spool, 2048.0)
    assert delay == pytest.approx(eft.linear.delay_budget(RIG).valve + 0.5 / 2048, rel=0.02)
    assert eft.identify_delay(spool, command, 2048.0) == pytest.approx(-delay, rel=1e-3)
    assert delay.coherence > 0.99
    assert delay.lag.shape == delay.frequency.shape


@pytest.mark.parametrize(("damping_ratio", "duration"), [(0.02, 8.0), (0.005, 32.0)])
def test_the_delay_of_a_resonant_motion_is_found(damping_ratio, duration):
    critical = 2.0 * np.sqrt(RIG["structure.stiffness"] * RIG["structure.mass"])
    rig = RIG.replace({"structure.damping": damping_ratio * critical})
    run = eft.simulate(rig, eft.sine_sweep(2200.0, 0.0, 10.0, duration, 4096.0))
    found = eft.identify_delay(run.valve_command, run.spool, 4096.0)
    assert found == pytest.approx(eft.linear.delay_budget(rig).valve, rel=0.2)
