"""The benchmark of force tracking: its rows, and the tables of the page.

``python docs/evidence/benchmark.py`` runs the rigs that are not in ``data/benchmark.csv`` yet (some seconds
of one core per rig). It ignores ``EFT_RECORDS``, so that everyone has the same commands. `report` makes the
tables and the picture.
"""

import math
import os
from collections.abc import Iterable
from pathlib import Path

from matplotlib.figure import Figure

import eft
from eft._files import write_text
from eft.benchmark import COMPETITORS, Benchmark, Row, _loop_shaping
from eft.benchmark._run import cases

HERE = Path(__file__).parent
RESULTS = HERE / "data" / "benchmark.csv"
CANDIDATES = {"robust": "(a) fixed", "loop-shaping-fixed": "(b) fixed", "robust-curve": "(a) adaptive"}
CANDIDATES |= {"loop-shaping-adaptive": "(b) adaptive"}
BLUE, ORANGE, GREY = "#0072B2", "#D55E00", "0.45"


def run_missing() -> None:
    """The rigs that have no rows yet."""
    os.environ.pop("EFT_RECORDS", None)
    found = Benchmark.load(RESULTS) if RESULTS.exists() else Benchmark(())
    for case in cases():
        done = {row.controller for row in found.rows if row.case == case.name}
        if not (missing := [name for name in COMPETITORS if name not in done]):
            continue
        found = Benchmark(found.rows + eft.benchmark.run(missing, on=[case]).rows)
        found.save(RESULTS)
        print(case.name, flush=True)


def percent(value: float) -> str:
    """A share, or "lost" if too many tests are lost."""
    return f"{100 * value:.1f} %" if math.isfinite(value) else "lost"


def summary(found: Benchmark) -> str:
    """A line for each controller, best median first."""
    lines = [
        "| controller | lost | error, median | 90 % | below 20 Hz | delay (ms) | peak | sweeps in band "
        "| displacement | largest spool | energy (kJ) | instructions |",
        "| --- " * 12 + "|",
    ]
    for one in found.summary():
        title = COMPETITORS[one.controller].title
        cells = [
            f"{title} (`{one.controller}`)",
            f"{one.lost} of {one.tests}",
            *(percent(value) for value in (one.nrmse, one.nrmse_90, one.slow_error)),
            f"{1e3 * one.delay:.2f}" if math.isfinite(one.delay) else "lost",
            percent(one.peak_error),
            f"{100 * one.within_band:.0f} %",
            percent(one.displacement_error),
            f"{100 * one.max_spool:.0f} %",
            f"{1e-3 * one.energy:.0f}",
            str(one.instructions or "–"),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def of(found: Benchmark, case: str, controller: str) -> list[Row]:
    """The tests of a controller on a rig."""
    return [row for row in found.rows if (row.case, row.controller) == (case, controller)]


def candidates(found: Benchmark) -> str:
    """Both candidates of the force loop: the sweeps' force errors on each named rig."""
    lines = [f"| rig | {' | '.join(CANDIDATES.values())} |", "| --- " * (1 + len(CANDIDATES)) + "|"]
    named = dict.fromkeys(row.case for row in found.rows if not row.case.startswith("random"))
    for case in named:
        cells = []
        for controller in CANDIDATES:
            sweeps = [row for row in of(found, case, controller) if row.test.startswith("sweep")]
            cells.append(" / ".join(percent(row.nrmse) for row in sweeps))
        lines.append(f"| {case} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def margins() -> str:
    """Both candidates with the piston at rest."""
    lines = ["| piston at rest, 4096 Hz | (a) | (b) |", "| --- | --- | --- |"]
    rig = eft.Rig.zhao2005()
    loop, shaped = eft.design_force_loop(rig), _loop_shaping.shape_loop(rig, 4096.0)
    designed = loop.margins
    # The last force error, and the integral if there is one.
    states = 1 + (loop.coefficients["controller.integral_gain"] > 0)
    lines.append(f"| gain margin | {designed.gain:.1f} | {shaped.margins.gain:.1f} |")
    lines.append(f"| normalised coprime margin | {designed.e_max:.2f} | {shaped.margins.e_max:.2f} |")
    lines.append(f"| states of the force loop | {states} | {len(shaped.controller.a)} |")
    return "\n".join(lines) + "\n"


def figure(found: Benchmark, folder: Path) -> None:
    """The force errors of every test, a line for each controller."""
    ranked = [one.controller for one in found.summary()][::-1]
    shown = Figure(figsize=(6.7, 4.6), layout="constrained")
    axes = shown.subplots()
    for place, controller in enumerate(ranked):
        rows = [row for row in found.rows if row.controller == controller]
        errors = [100 * row.nrmse for row in rows if not row.lost]
        color = ORANGE if COMPETITORS[controller].make else BLUE
        axes.plot(errors, [place] * len(errors), "|", color=color, ms=9, mew=0.9)
        lost = sum(bool(row.lost) for row in rows)
        axes.text(135, place, f"{lost} lost" if lost else "", va="center", fontsize=7, color=GREY)
    axes.set_yticks(range(len(ranked)), ranked, fontsize=8)
    axes.set(xscale="log", xlim=(0.7, 250), xlabel="force error of a test (%)")
    axes.set_xticks([1, 2, 5, 10, 20, 50, 100], ["1", "2", "5", "10", "20", "50", "100"], minor=False)
    axes.grid(axis="x", color="0.9", lw=0.6)
    shown.savefig(folder / "benchmark.png", dpi=150)


def lost_on(found: Benchmark, controllers: Iterable[str]) -> str:
    """The rigs on which controllers lose tests."""
    lines = []
    for controller in controllers:
        lost = dict.fromkeys(row.case for row in found.rows if row.controller == controller and row.lost)
        if lost:
            lines.append(f"- `{controller}`: {', '.join(lost)}.")
    return "\n".join(lines) + "\n"


def report(folder: Path) -> None:
    """The generated parts of the page, and its picture."""
    found = Benchmark.load(RESULTS)
    figure(found, folder)
    write_text(folder / "benchmark_summary.md", summary(found))
    write_text(folder / "benchmark_candidates.md", candidates(found))
    write_text(folder / "benchmark_margins.md", margins())
    ranked = [one.controller for one in found.summary()]
    write_text(folder / "benchmark_lost.md", lost_on(found, ranked))


if __name__ == "__main__":
    run_missing()
