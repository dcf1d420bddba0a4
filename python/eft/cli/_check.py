"""`eft check`: whether a rig can do a test."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click
import numpy as np

import eft
from eft._test_file import TestPlan
from eft._verdict import judge
from eft.cli._output import as_json, emit_json, epilog, progress, table
from eft.cli._plan import plan_of, test_options


@click.command(
    short_help="Can this rig do this test?",
    epilog=epilog(
        "eft check test.toml",
        "eft check --rig rig.toml --record northridge.at2 --scale 0.6",
        "eft check test.toml --json",
    ),
)
@test_options
@as_json
def check(
    test: Path | None, rig: Path | None, changes: dict[str, Any], as_json: bool, **command: Any
) -> None:
    """Say whether a rig can do a test: stability margins, what the test asks of valve and piston, a verdict.

    The margins are those of the model linear about rest, sampled at the rate of the command, each setting
    changed alone; the demands are those of the test on the virtual rig. Nothing is written.
    Exit code 1 when the answer is no.
    """
    plan = plan_of(test, rig, changes, command)
    margins, budget = _margins(plan)
    with progress("test") as update:
        run = eft.simulate(plan.rig, plan.command, progress=update)
    demands = _demands(run)
    reasons = _reasons(run, margins)
    feasible = not reasons
    if as_json:
        emit_json(
            {
                "command": plan.about,
                "feasible": feasible,
                "reasons": reasons,
                "verdict": judge(run).text,
                "margins": margins,
                "delay_budget": budget,
                "demands": demands,
                "metrics": run.metrics() if run.command.any() else {},
            }
        )
    else:
        concern = "Feasible, with a concern" if judge(run).concern else "Feasible"
        answer = concern if feasible else "Not feasible"
        click.echo(f"{plan.about}\non {plan.rig['name']}, {plan.command.sample_rate:g} Hz\n")
        click.echo(table(_rows(plan, run, margins, budget, demands), ("", "found", "allowed")))
        click.echo(f"\n{answer}. {' '.join(reasons) or judge(run).text}")
    if not feasible:
        raise click.exceptions.Exit(1)


def _margins(plan: TestPlan) -> tuple[dict[str, Any], dict[str, float]]:
    rate = plan.command.sample_rate
    try:
        margins = eft.stability_margins(plan.rig, sampled=True, sample_rate=rate)
    except ValueError:
        # No level is stable, which is an answer here; anything else that is wrong will be said again.
        growth = eft.linearize(plan.rig, sampled=True, sample_rate=rate).growth_rate
        if growth <= 0.0:
            raise
        margins = {"growth_rate": growth}
    return margins, eft.delay_budget(plan.rig, rate)


def _demands(run: eft.TestRun) -> dict[str, float]:
    rig = run.rig
    return {
        "spool": float(np.abs(run.spool).max()),
        "displacement": float(np.abs(run.displacement).max()),
        "stroke": float(rig["actuator.stroke"]),
        "flow": float(np.abs(run.velocity).max() * rig["actuator.piston_area"]),
        "load_pressure": float(np.abs(run.load_pressure).max()),
        "supply_pressure": float(rig["supply.pressure"]),
    }


def _reasons(run: eft.TestRun, margins: dict[str, Any]) -> list[str]:
    reasons = []
    if margins["growth_rate"] > 0.0:
        reasons.append(f"The loop is unstable about rest, growing at {margins['growth_rate']:.3g} 1/s.")
    if not judge(run).usable or run.flags & (eft.Status.SPOOL_STOP | eft.Status.DEMAND_SATURATED):
        reasons.append(judge(run).text)
    return reasons


def _rows(
    plan: TestPlan,
    run: eft.TestRun,
    margins: dict[str, Any],
    budget: dict[str, float],
    demands: dict[str, float],
) -> list[tuple[str, str, str]]:
    rows = [
        ("growth rate about rest, 1/s", f"{margins['growth_rate']:.3g}", "below 0"),
    ]
    if plan.rig["compensation.mode"] != "off":
        level, delay = plan.rig["compensation.level"], plan.rig["compensation.response_delay"]
        largest = margins.get("level")
        if largest is not None:
            allowed = f"below {largest:.3f}" if math.isfinite(largest) else "any"
            rows.append(("compensation level", f"{level:.3f}", allowed))
        if (span := margins.get("response_delay")) is not None:
            rows.append(("response delay, ms", f"{delay * 1e3:.2f}", _span(span[0] * 1e3, span[1] * 1e3, 2)))
        if (span := margins.get("flow_gain")) is not None:
            rows.append(("true flow gain over configured", "", _span(span[0], span[1], 3)))
        rows.append(("  delay budget of the loop, ms", f"{budget['total'] * 1e3:.2f}", ""))
    pressure, supply = demands["load_pressure"] / 1e6, demands["supply_pressure"] / 1e6
    rows += [
        ("spool opening", f"{demands['spool']:.1%}", "60% advised"),
        ("displacement, mm", f"{demands['displacement'] * 1e3:.1f}", f"{demands['stroke'] * 1e3:.1f}"),
        ("load pressure, MPa", f"{pressure:.2f}", f"{supply:.2f}"),
        ("flow, L/min", f"{demands['flow'] * 6e4:.0f}", ""),
    ]
    if run.command.any():
        rows.append(("force error, rms over rms", f"{run.metrics()['nrmse']:.2%}", ""))
    return rows


def _span(low: float, high: float, digits: int) -> str:
    return f"{low:.{digits}f} to {high:.{digits}f}" if math.isfinite(high) else f"above {low:.{digits}f}"
