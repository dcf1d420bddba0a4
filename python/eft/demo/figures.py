"""The figures of the demonstration and their captions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from eft import plots
from eft._files import atomic_write
from eft.demo.experiments import Earthquake, SweepResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from eft import TestRun


@dataclass(frozen=True)
class Shown:
    """A figure of the report."""

    name: str
    title: str
    caption: str
    figure: Figure

    def save(self, folder: Path) -> Path:
        """Write the figure as PNG, under another name first, and rename it."""
        path = folder / f"{self.name}.png"
        with atomic_write(path) as temporary:
            self.figure.savefig(temporary, format="png")
        return path


def sweeps(results: Sequence[SweepResult]) -> Iterator[Shown]:
    """Figs. 8, 11a and 11b, as far as their sweeps were run."""
    by_figure: dict[str, dict[str, TestRun]] = {}
    for result in results:
        for name in result.case.figures:
            by_figure.setdefault(name, {})[_label(result, name)] = result.run
    if runs := by_figure.get("8"):
        yield Shown(
            "fig08-sweep",
            "8.9 kN sweep under each scheme (like Fig. 8)",
            "Force against command from 4 to 8 s, where the sweep passes the structure's natural "
            "frequency, and the spectra of the whole sweep. The paper found no obvious difference with "
            "nonlinear compensation and a sharp drop around 1.6 Hz with linear compensation.",
            plots.figure_8(runs),
        )
        yield Shown(
            "fig08-ratio",
            "8.9 kN sweep: force over command, and the spool opening",
            "The same sweeps. The paper's spool opened to about 55 % with nonlinear compensation.",
            plots.figure_8_ratio(runs),
        )
    if runs := by_figure.get("11a"):
        yield Shown(
            "fig11a-level",
            "2.2 kN sweep at three compensation levels (like Fig. 11a)",
            "Two percent too little lowers the force at the natural frequency, two percent more raises it.",
            plots.figure_11(dict(sorted(runs.items()))),
        )
    if runs := by_figure.get("11b"):
        yield Shown(
            "fig11b-delay",
            "2.2 kN sweep with three delays in the lead network (like Fig. 11b)",
            "Too little delay compensation shows as a peak before a valley, too much as a peak after it.",
            plots.figure_11(dict(sorted(runs.items()))),
        )


def _label(result: SweepResult, figure: str) -> str:
    # The tuned case is in both halves of Fig. 11, labelled by the setting that each half varies.
    return "delay 5 ms" if figure == "11b" and result.case.key == "2.2-nominal" else result.case.label


def earthquake(test: Earthquake) -> Iterator[Shown]:
    """Figs. 9 and 10, and the load of valve and structure in the test."""
    window = _strong_part(test)
    yield Shown(
        "fig09-force",
        "Earthquake test: force (like Fig. 9)",
        "Without compensation the force seems to follow over time. The missing part is near the resonance, "
        "which causes most of the structure's motion.",
        plots.figure_9(test.runs, window=window),
    )
    yield Shown(
        "fig10-response",
        "Earthquake test: displacement and velocity (like Fig. 10)",
        "The ideal response is that of the same structure under the command applied exactly.",
        plots.figure_10(test.runs, test.ideal, window=window),
    )
    yield Shown(
        "earthquake-rig",
        "Earthquake test, nonlinear: spool opening, and the structure's restoring force",
        "The paper advises to stay below 60 % of the spool's stroke. The spring softens beyond 25 mm.",
        plots.figure_structure(test.runs["nonlinear"], window=window),
    )


def _strong_part(test: Earthquake) -> tuple[float, float]:
    """From the start to the time with 95 % of the displacement's energy, s."""
    energy = (test.ideal.displacement**2).cumsum()
    end = float(test.ideal.time[(energy < 0.95 * energy[-1]).sum()]) if energy[-1] > 0 else 0.0
    return 0.0, max(end, 1.0)
