"""Figs. 8 and 11 of the paper, the sine sweeps, and its statements about stability as maps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from paper_figures_page import Shown, table

import eft
from eft import paper, plots
from eft.demo.experiments import SCHEMES

if TYPE_CHECKING:
    from eft import TestRun


def sweeps(number: str) -> tuple[dict[str, paper.Case], dict[str, TestRun]]:
    """The sweeps of one figure, by label."""
    settings = paper.load().sweep
    cases = {case.label: case for case in paper.load().cases if number in case.figures}
    runs = {
        label: eft.simulate(case.rig(), settings.command(case.amplitude)) for label, case in cases.items()
    }
    return cases, runs


def sweep_rows(runs: dict[str, TestRun]) -> list[tuple[str, ...]]:
    """The results of the sweeps as rows of a table."""
    band = paper.load().sweep.ratio_band
    rows = []
    for label, run in runs.items():
        n = paper.observe(run, band)
        rows.append(
            (
                label,
                f"{n.max_spool:.1%}",
                f"{n.ratio_min:.3f} at {n.ratio_min_at:.2f} Hz",
                f"{n.ratio_max:.3f} at {n.ratio_max_at:.2f} Hz",
                f"{n.nrmse:.1%}",
            )
        )
    return rows


SWEEP_HEADER = (
    "",
    "largest spool opening",
    "smallest force/command",
    "largest force/command",
    "force error (rms)",
)


def figure_8() -> Shown:
    """The large sweep under each scheme."""
    _, runs = sweeps("8")
    order = {label: runs[label] for label in SCHEMES}
    return Shown(
        "8",
        "8.9 kN sine sweep under each scheme",
        "with nonlinear compensation there is no obvious difference between force and command from 4 to 8 "
        "s, and no obvious drop in the spectrum. The spool opens to about 55 %. With the linearized scheme "
        "the spectrum drops sharply near 1.6 Hz.",
        "the table has the results. The extremes of the ratio are those from 1.2 to 2 Hz."
        + table(SWEEP_HEADER, sweep_rows(order)),
        {"fig08": plots.figure_8(order), "fig08-ratio": plots.figure_8_ratio(order)},
    )


def figure_11() -> Iterator[Shown]:
    """The small sweep with wrong levels and delays, and the proposals of fine tuning."""
    statements = {
        "11a": (
            "compensation level",
            "a level that is 2 % too low reduces the force at the natural frequency. A level that is 2 % "
            "too high increases it.",
        ),
        "11b": (
            "compensated delay",
            "a delay of 3 ms is too short, and gives a peak below the natural frequency and a valley above "
            "it. A delay of 7 ms is too long, and reverses the order. A delay of 5 ms was the best.",
        ),
    }
    for number, (title, statement) in statements.items():
        cases, runs = sweeps(number)
        rows, named = [], {}
        for label, run in runs.items():
            # Both halves of the figure have the tuned case.
            shown = "delay 5 ms" if (number, label) == ("11b", "level 1.00") else label
            tuned = eft.identification.fine_tune(
                cases[label].rig(), run.command, run.force, run.velocity, run.sample_rate
            )
            named[shown] = run
            order = "before" if tuned.peak_before_valley else "after"
            rows.append(
                (
                    shown,
                    f"{tuned.force_ratio:.3f} at {tuned.natural_frequency:.2f} Hz",
                    f"{tuned.peak:.2f} Hz, {order} the valley at {tuned.valley:.2f} Hz",
                    f"{float(tuned.level):.4f}",
                    f"{float(tuned.response_delay) * 1e3:.2f} ms",
                )
            )
        header = ("", "force/command at resonance", "peak", "`fine_tune`: level", "`fine_tune`: delay")
        path = eft.linear.delay_budget(eft.Rig.zhao2005(), paper.load().sweep.sample_rate, (1.0, 2.5)).path
        yield Shown(
            number,
            f"2.2 kN sine sweep with the {title} varied",
            statement,
            "the table also has the proposals of `eft.identification.fine_tune` from each run. Valve and "
            f"hold together delay by {path * 1e3:.2f} ms near the natural frequency. The paper subtracts "
            "the lead of the derivative and uses 5 ms." + table(header, rows),
            {f"fig{number}": plots.figure_11(named)},
        )


def stability() -> Shown:
    """The paper's statements about stability, as maps."""
    rig = eft.Rig.zhao2005()
    fast = {
        delay: next(
            p
            for p in eft.linearize(rig.replace({"compensation.response_delay": delay})).poles()
            if p.imag > 300
        )
        for delay in (5e-3, 3e-3, 0.0)
    }
    modes = ", ".join(f"{p.real:.1f} ± {p.imag:.0f}j 1/s at {d * 1e3:g} ms" for d, p in fast.items())
    damped = rig.replace({"structure.damping": 2 * rig["structure.damping"]})
    digital = rig.replace({"controller.realization": "digital"})
    return Shown(
        "",
        "Stability: limits of the settings",
        "the allowed overcompensation increases with the structure's damping. The margin of the response "
        "delay is wider than that of the flow gain. Too little delay compensation can destabilise a mode "
        "near 60 Hz, which does not harm the structure.",
        f"the largest stable level is {eft.stability_margin(rig):.4f}, and "
        f"{eft.stability_margin(damped):.4f} with twice the damping. The loop is stable for response delays "
        f"up to {1e3 * eft.linear.stability_margins(rig, sampled=True).response_delay[1]:.0f} ms. The fast "
        f"mode is at {modes}. The maps apply to the sampled loop. The first has level and damping, the "
        "second response delay and sample rate of a digital force loop. At low rates the fast mode of this "
        "loop is unstable. The limit of the rate increases as less delay is compensated.",
        {
            "maps": plots.figure_maps(
                eft.linear.stability_map(rig, "level-damping"),
                eft.linear.stability_map(digital, "delay-rate"),
                eft.linear.stability_map(rig, "rate-realization"),
            )
        },
    )
