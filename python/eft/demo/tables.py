"""The results as tables: built once, shown in the terminal and written into the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich import box
from rich.table import Table as RichTable

from eft._display import shown
from eft.demo.experiments import Earthquake, EarthquakeNumbers, SweepResult, observe
from eft.paper import Numbers, load

EARTHQUAKE_SAID = {
    "off": "low near resonance, responses much too small",
    "linear": "better, below nonlinear",
    "nonlinear": "force follows closely, some peaks not fully reached",
}
"""The paper's words on its earthquake test (Figs. 9 and 10), by scheme."""


@dataclass(frozen=True)
class Table:
    """Cells of text, with numbers aligned right and words left."""

    title: str
    columns: tuple[str, ...]
    words: frozenset[int]
    """Columns with words."""
    rows: tuple[tuple[str, ...], ...]
    groups: int = 1
    """Rows that belong together."""

    def rich(self) -> RichTable:
        """For a terminal."""
        table = RichTable(title=self.title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
        for index, name in enumerate(self.columns):
            table.add_column(name, justify="left" if index in self.words else "right")
        for index, row in enumerate(self.rows, start=1):
            table.add_row(*row, end_section=index % self.groups == 0 and self.groups > 1)
        return table

    def markdown(self) -> str:
        """For the report."""
        rule = ["---" if index in self.words else "---:" for index in range(len(self.columns))]
        lines = [self.columns, rule, *self.rows]
        return "\n".join(
            "| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines
        )


def sweeps(results: Sequence[SweepResult]) -> Table:
    """The sweeps: the paper's words, the reference, this run."""
    rows: list[tuple[str, ...]] = []
    for result in results:
        case = result.case
        comparisons = result.comparisons()
        worst = max((c.deviation for c in comparisons if not c.name.endswith("_at")), default=0.0)
        verdict = (
            "" if not comparisons else f"{worst:.1%}" + ("" if all(c.within for c in comparisons) else " !")
        )
        rows.append((case.title, "reference", *_cells(case.reference), "", case.paper))
        rows.append(("", "this run", *_cells(result.numbers), verdict, ""))
    low, high = load().sweep.ratio_band
    return Table(
        title=f"Sine sweeps, 0-10 Hz in 32 s; force over command, extremes over {low:g}-{high:g} Hz",
        columns=(
            "test",
            "",
            "spool",
            f"|x| {shown('length').unit}",
            "NRMSE",
            "lowest at Hz",
            "highest at Hz",
            "apart",
            "the paper",
        ),
        words=frozenset({0, 1, 8}),
        rows=tuple(rows),
        groups=2,
    )


def earthquake(test: Earthquake) -> Table:
    """The earthquake test under each scheme."""
    rows = []
    for scheme, run in test.runs.items():
        rows.append((scheme, *_earthquake_cells(observe(run, test.ideal)), EARTHQUAKE_SAID[scheme]))
    return Table(
        title=f"Earthquake: {test.record.name}, scaled by {test.scale:g}",
        columns=(
            "scheme",
            "spool",
            "force NRMSE",
            f"|x| {shown('length').unit}",
            "of ideal",
            "x NRMSE",
            "the paper, of its own test",
        ),
        words=frozenset({0, 6}),
        rows=tuple(rows),
    )


def _cells(numbers: Numbers | None) -> tuple[str, ...]:
    if numbers is None:
        return ("-",) * 5
    return (
        f"{numbers.max_spool:.4f}",
        _length(numbers.max_displacement),
        f"{numbers.nrmse:.4f}",
        f"{numbers.ratio_min:.4f} at {numbers.ratio_min_at:.3f}",
        f"{numbers.ratio_max:.4f} at {numbers.ratio_max_at:.3f}",
    )


def _earthquake_cells(numbers: EarthquakeNumbers) -> tuple[str, ...]:
    return (
        f"{numbers.max_spool:.1%}",
        f"{numbers.force_nrmse:.4f}",
        _length(numbers.max_displacement),
        f"{numbers.peak_reached:.0%}",
        f"{numbers.displacement_nrmse:.4f}",
    )


def _length(value: float) -> str:
    """Four digits in the unit of the heading."""
    return f"{value * shown('length').factor:.4g}"
