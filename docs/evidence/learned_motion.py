"""Gain and delay of a true valve in the motion from which a test has learned them.

A valve of three stages has another gain and another delay at each frequency. The learner estimates those of
the lead network whose inverse follows the spool best, by least squares over the motion that it remembers.
`gain_and_delay` finds them from the true spool and the true valve, without noise and at once.
"""

import re
from pathlib import Path

import numpy as np

import eft

TUNING = Path(__file__).parents[2] / "crates" / "eft-core" / "src" / "learning" / "tuning.rs"
WINDOW = 16
"""Samples of a window at 4096 Hz."""
ITERATIONS = 5


def tuning(name: str) -> float:
    """A constant of the learner."""
    found = re.search(rf"const {name}: f64 = ([\d.e-]+);", TUNING.read_text(encoding="utf-8"))
    assert found is not None, name
    return float(found[1])


def valve(rig: eft.Rig, omega: np.ndarray) -> np.ndarray:
    """Spool over its command of the true three-stage valve, with the hold, over the configured gain."""
    servovalve = rig.plant.to_dict()["servovalve"]
    gain = 1 / (servovalve["spool_sensitivity"] * servovalve["spool_stroke"])
    delay = servovalve["spool_area"] / (servovalve["spool_sensitivity"] * servovalve["pilot_flow_gain"])
    s = 1j * omega
    stages = 1 + s * delay + servovalve["pilot_time_constant"] * delay * s**2
    return gain / rig["compensation.valve_gain"] / stages * np.exp(-s * 0.5 / rig["controller.sample_rate"])


def network(rig: eft.Rig, omega: np.ndarray, delay: float) -> np.ndarray:
    """The lead network for a delay (s), Eq. (8)."""
    alpha, s = rig["compensation.lead_alpha"], 1j * omega
    lead = delay / (1 - alpha)
    return (1 + s * lead) / (1 + s * alpha * lead)


def band(omega: np.ndarray, period: float) -> np.ndarray:
    """The filter of the estimators: a zero at the mains' hum, two low-passes and a high-pass."""
    step = np.exp(-1j * omega * period)

    def low_pass(corner: float) -> np.ndarray:
        angle = 2 * np.pi * corner * period
        share = angle / (1 + angle / 2)
        return share / (1 - (1 - share) * step)

    ends = 0.5 / (1 - np.cos(2 * np.pi * tuning("MAINS") * period))
    taps = ends + (1 - 2 * ends) * step + ends * step**2
    return taps * low_pass(tuning("LOW_PASS")) ** 2 * (1 - low_pass(tuning("HIGH_PASS")))


def remembered(opening: np.ndarray, period: float) -> np.ndarray:
    """Weight of each window in the learner's sums at the end."""
    kept, half = tuning("KEPT_EVIDENCE"), tuning("HALF_EVIDENCE")
    forgotten, amount = period / tuning("MEMORY"), 0.0
    shares = np.ones(opening.size)
    for n, square in enumerate(np.square(opening)):
        shares[n] = 1 - forgotten * max(amount - kept, 0.0) / (amount + half)
        amount = shares[n] * amount + square * period
    return np.append(np.cumprod(shares[:0:-1])[::-1], 1.0)


def gain_and_delay(run: eft.TestRun) -> tuple[float, float]:
    """Gain over the configured one (1) and delay (s) of the valve in the motion that a test remembers."""
    period = WINDOW / run.rig["controller.sample_rate"]
    count = run.spool.size // WINDOW
    spool = run.spool[: count * WINDOW].reshape(count, WINDOW).mean(axis=1)
    # As many zeros after the end keep it apart from the start.
    omega = 2 * np.pi * np.fft.rfftfreq(2 * count, period)
    spectrum = np.fft.rfft(spool, 2 * count) * band(omega, period)

    def midway(values: np.ndarray) -> np.ndarray:
        return (values[1:] + values[:-1]) / 2

    measured = np.fft.irfft(spectrum)[:count]
    root = np.sqrt(remembered(measured, period)[1:])
    gain, delay = 1.0, run.rig["compensation.response_delay"]
    for _ in range(ITERATIONS):
        # The opening of which this network and the true valve make the spool's.
        command = np.fft.irfft(spectrum / (network(run.rig, omega, delay) * valve(run.rig, omega)))[:count]
        regressors = np.array([midway(command), -np.diff(command) / period]) * root
        gain, late = np.linalg.lstsq(regressors.T, midway(measured) * root, rcond=None)[0]
        delay += late / gain
    return float(gain), float(delay)
