"""Measured tests in a report, each compared with the virtual one."""

from __future__ import annotations

from collections.abc import Mapping

from eft._display import shown
from eft._run import TestRun
from eft.report._charts import COMMAND_COLOR, Page, cycle
from eft.traces import Comparison, Traces, compare

_CHARTED = ("force", "displacement")


def compared(runs: Mapping[str, TestRun], measured: Mapping[str, Traces]) -> dict[str, Comparison]:
    """Each measured test with the first run, aligned, by a title for both."""
    if not measured:
        return {}
    name, run = next(iter(runs.items()))
    if run._building is not None:
        raise ValueError("measured: must be left out for a run of several actuators")
    return {f"{name} against {label}": compare(one, run, align=True) for label, one in measured.items()}


def draw_measured(page: Page, found: Mapping[str, Comparison]) -> None:
    """The signals of both tests and their difference, on the clock of the measured one."""
    color = cycle(1)[0]
    for title, one in found.items():
        for quantity in (name for name in _CHARTED if name in one):
            unit = shown(one[quantity].unit)
            wanted, values = (traces[quantity] * unit.factor for traces in (one.reference, one.other))
            curves = [
                page.history("measured", COMMAND_COLOR, wanted, one.reference, width=2.4),
                page.history("virtual", color, values, one.other),
            ]
            labels = ("time (s)", f"{quantity} ({unit.unit})")
            page.add(f"{quantity.capitalize()}: {title}", labels, curves)
            error = [page.history("virtual less measured", color, values - wanted, one.other)]
            page.add(f"Difference of {quantity}: {title}", ("time (s)", f"difference ({unit.unit})"), error)
