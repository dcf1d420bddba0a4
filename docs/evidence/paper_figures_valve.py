"""Figs. 4 and 6 of the paper: the identification tests, and the valve with its inverse."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from paper_figures_page import Shown, table

import eft
from eft import plots

RATE = 2048.0
CUBIC_INCH = 1.6387064e-5


def figure_4() -> Iterator[Shown]:
    """The paper's identification tests on the virtual rig."""
    rig = eft.Rig.zhao2005()
    delay = eft.identify_delay(*eft.identification.valve_test(rig, amplitude=0.0254, sample_rate=RATE), RATE)
    budget = eft.linear.delay_budget(rig, RATE)
    stroke, area = rig["actuator.stroke"], rig["actuator.piston_area"]
    runs = [
        eft.identification.flow_test(rig, share * stroke, sample_rate=RATE)
        for share in (0.9, 0.8, 0.6, 0.4, 0.2)
    ]
    spools, moved = [run[2] for run in runs], [run[1] for run in runs]
    # The second half, after the transient of the start.
    settled = slice(runs[0][0].size // 2, None)
    fitted = eft.identify_flow_curve(spools, moved, RATE, area)
    averaged = eft.identify_flow_curve(spools, moved, RATE, area, method="difference")
    gain = eft.identification.identify_flow_gain(spools, moved, RATE, area)
    pages = plots.figure_4(
        delay, fitted, spool=spools[0], displacement=moved[0], sample_rate=RATE, piston_area=area
    )
    yield Shown(
        "4a",
        "response delay of the servovalve",
        "the main stage is shut off, and a sweep of 25 mm goes from 0 to 10 Hz in 32 s. The phase lag of "
        "the spool is proportional to the frequency. The slope of the regression line over 2π is a delay "
        "of 4.7 ms. The parameters give 2ζ/ω_n = 5.2 ms. A small demand makes the pilot stage faster.",
        f"the same test on the virtual valve gives {float(delay) * 1e3:.3f} ± {delay.uncertainty * 1e3:.3f} "
        f"ms (coherence {delay.details['coherence']:.4f}). Its pilot stage does not depend on the demand. "
        f"The valve's phase slope over the band is {budget.valve * 1e3:.3f} ms. The hold of the command "
        f"adds half a sample, {budget.hold * 1e3:.3f} ms.",
        {"fig04a": pages[0]},
    )
    truth = np.array(rig["servovalve.flow_table"]["flows"])
    rows = [
        (
            f"{x:+.1f}",
            f"{q / CUBIC_INCH:.1f}",
            f"{a / CUBIC_INCH:.1f}",
            f"{b / CUBIC_INCH:.1f}",
            f"{100 * (a - q) / truth[-1]:+.2f} %",
            "yes" if seen else "extrapolated",
        )
        for x, q, a, b, seen in zip(
            fitted.openings,
            truth,
            fitted.flows,
            averaged.flows,
            fitted.measured,
            strict=True,
        )
    ]
    reached = [abs(spool[settled]).max() for spool in spools]
    shares = [float(abs(c - x)[settled].max() / abs(c).max()) for c, x, _ in runs]
    errors = {
        name: float((abs(curve.flows - truth) / truth[-1])[curve.measured].max())
        for name, curve in (("fit", fitted), ("means", averaged))
    }
    yield Shown(
        "4b and Table 2",
        "flow curve of the servovalve",
        "the tests are 3 Hz sines of 90, 80, 60, 40 and 20 % of the stroke, without load, in displacement "
        "control. The flow is the piston area times the velocity by central differences. 21 control points "
        "are means of the measured flows. The points beyond 80 % are a linear extrapolation. The valve "
        "command is at most 90 % of the command. The curve is straight within ±10 % and flattens beyond "
        "±60 %, which should not be exceeded.",
        f"in steady motion the five tests open the spool to {', '.join(f'{100 * x:.0f}' for x in reached)} "
        f"%. The valve command is {100 * min(shares):.0f} to {100 * max(shares):.0f} % of the command. The "
        "curve is identified in two ways. `eft` fits the displacement, because the fit is less sensitive "
        "to noise. The paper uses means of central differences. At the control points that the tests "
        f"reached, they differ from Table 2 by at most {100 * errors['fit']:.2f} % and "
        f"{100 * errors['means']:.2f} % of full scale. The slope at the origin is K_v = "
        f"{float(gain) / CUBIC_INCH:.0f} ± {gain.uncertainty / CUBIC_INCH:.1f} in³/s. Table 2 has 1022 and "
        "1010, and Table 1 has 1003."
        + table(
            ("opening", "Table 2, in³/s", "fit", "means of differences", "fit minus Table 2", "measured"),
            rows,
        ),
        {"fig04b": pages[1]},
    )


def figure_6() -> Shown:
    """The valve and its inverse."""
    rig = eft.Rig.zhao2005()
    valve, lead = eft.linear.inverse_dynamics(rig, [0.0, 10.0, 20.0])
    both = valve * lead / (valve[0] * lead[0])
    phase = np.degrees(np.angle(both))
    return Shown(
        "6",
        "the servovalve and its inverse",
        "amplitude and phase of valve and phase-lead network in series are flat up to 20 Hz.",
        f"the gain is {abs(both[1]):.3f} and the phase {phase[1]:.2f}° at 10 Hz. At 20 Hz they are "
        f"{abs(both[2]):.3f} and {phase[2]:.1f}°.",
        {"fig06": plots.figure_6(rig)},
    )
