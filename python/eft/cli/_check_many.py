"""`eft check` of several tests, or of several valves: one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import click

from eft._test_file import TestPlan
from eft._valve_choice import ValveTable, read_valves, tried, with_valve
from eft.cli._output import emit_json, factor, table


def check_many(plans: Sequence[TestPlan], catalogue: Path | None, largest: bool, as_json: bool) -> None:
    """Run every test with every valve and print a line for each; exit code 1 when the answer is no."""
    valves = read_valves(catalogue) if catalogue is not None else {"as configured": None}
    names = _names(plans)
    rows = []
    for valve, sheet in valves.items():
        for name, plan in zip(names, plans, strict=True):
            fitted = plan.rig if sheet is None else with_valve(plan.rig, sheet)
            rows.append(tried(valve, name, fitted, plan.command, largest))
    found = ValveTable(tuple(rows))
    if as_json:
        emit_json({"rows": [asdict(row) for row in found], "suitable": list(found.suitable)})
    else:
        header = ["test", "verdict", "force error", "spool"] + (["largest factor"] if largest else [])
        lines = []
        for row in found:
            cells = [row.command, row.grade, f"{row.force_error:.1%}", f"{row.max_spool:.0%}"]
            if catalogue is not None:
                cells[0] = f"{row.valve}, {row.command}" if len(plans) > 1 else row.valve
            lines.append(cells + ([factor(row.largest_scale)] if row.largest_scale is not None else []))
        header[0] = "valve" if catalogue is not None else "test"
        click.echo(table(lines, header))
        for cells, row in zip(lines, found, strict=True):
            if row.limited_by:
                click.echo(f"{cells[0]}: {row.limited_by}")
        if catalogue is not None:
            click.echo(f"valves that do: {', '.join(found.suitable) or 'no valve of the catalogue'}")
    if not found.suitable:
        raise click.exceptions.Exit(1)


def _names(plans: Sequence[TestPlan]) -> list[str]:
    """The names of the tests, with numbers if two names are equal."""
    names = [plan.about.partition(",")[0] for plan in plans]
    return [name if names.count(name) == 1 else f"{name} ({i})" for i, name in enumerate(names, 1)]
