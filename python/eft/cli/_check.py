"""`eft check`: whether a rig can do a test."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import click

import eft
from eft._display import shown
from eft._test_file import TestPlan
from eft._verdict import Verdict, worst
from eft.cli._check_many import check_many
from eft.cli._output import FILE, as_json, emit_json, epilog, factor, progress, table, units_option
from eft.cli._plan import command_options, memory_of, plan_of, plans_of
from eft.cli._run import graded, metrics_of, remedies_of


@click.command(
    short_help="Check whether a rig can do a test.",
    epilog=epilog(
        "eft check test.toml",
        "eft check --rig rig.toml --record northridge.at2 --scale 0.6",
        "eft check test.toml --try-remedies",
        "eft check test.toml --largest",
        "eft check --rig rig.toml elcentro northridge.at2 --largest",
        "eft check --rig rig.toml --valves catalogue.toml elcentro",
        "eft check test.toml --json",
    ),
)
@click.argument("tests", type=FILE, nargs=-1)
@command_options
@click.option("--valves", type=FILE, help="Catalogue of valves (TOML): try each valve and print one table.")
@click.option("--try-remedies", is_flag=True, help="Run the test once more with all remedies, and compare.")
@click.option(
    "--largest",
    is_flag=True,
    help="Find the largest factor on the command with a usable test on the virtual rig.",
)
@units_option
@as_json
def check(
    tests: tuple[Path, ...],
    rig: Path | None,
    changes: dict[str, Any],
    valves: Path | None,
    try_remedies: bool,
    largest: bool,
    as_json: bool,
    **command: Any,
) -> None:
    """Say whether a rig can do a test: go, caution or no, and why.

    The demands on the rig assume that the structure receives exactly the commanded force. The margins come
    from a linear model about rest, sampled at the rate of the command. Each margin changes one setting alone.
    If the controller calibrates itself or guards its level, the margins are those before it does so. The
    output names effects that the model does not contain, and keys without effect. Then the test runs on the
    virtual rig. The answer is the worse of both. No file is written. The exit code is 1 if the answer is no.

    TESTS is a test file. Without it, options such as --sweep or --record give the command. Several tests or
    ground motions give one table. --valves gives a table with a line for each valve. Exit code 1 then means
    that the answer is no for one of the tests, or that no valve suffices for all of them.
    """
    if valves is not None or len(tests) > 1:
        if try_remedies:
            raise click.UsageError("--try-remedies: must be left out of a table of tests")
        check_many(plans_of(tests, rig, changes, command), valves, largest, as_json)
        return
    plan = plan_of(tests[0] if tests else None, rig, changes, command)
    margins = _margins(plan)
    left_out, idle = _linear(plan).left_out, plan.rig.idle_keys()
    found = asdict(eft.check_feasibility(plan.rig, plan.command))
    with progress("test") as update:
        run = eft.simulate(plan.rig, plan.command, progress=update)
    outcome = _together(run.verdict, found)
    helped = _helped(plan, outcome) if try_remedies and outcome.remedies else None
    scale = eft.largest_scale(plan.rig, plan.command) if largest else None
    if as_json:
        emit_json(
            {"command": plan.about, "rig": plan.rig["name"], "memory": memory_of(plan)}
            | {name: found[name] for name in _FORESEEN}
            | {"verdict": outcome.grade, "reasons": list(outcome.reasons), "summary": outcome.summary}
            | {"margins": margins}
            | {"left_out": left_out, "idle_keys": idle}
            | {"delay_budget": asdict(eft.linear.delay_budget(plan.rig, plan.command.sample_rate))}
            | {"remedies": remedies_of(outcome)}
            | ({"with_remedies": {"grade": helped.grade, "verdict": helped.text}} if helped else {})
            | ({"largest_scale": scale.scale, "limited_by": list(scale.limited_by)} if scale else {})
            | {"metrics": metrics_of(run)}
        )
    else:
        click.echo(f"{plan.about}\non {plan.rig['name']}, {plan.command.sample_rate:g} Hz\n")
        click.echo(table(_demands(found), ("demand of the test", "", "advised", "capacity")) + "\n")
        if before := _before(plan):
            click.echo(f"as configured, {before}:")
        click.echo(table(_settings(plan, found, margins), ("setting", "is", "stable")))
        if left_out:
            click.echo(f"\nnot in the linear model: {', '.join(left_out)}")
        if idle:
            click.echo("\n" + "\n".join(f"without effect: {key}" for key in idle))
        click.echo(f"\non the virtual rig: {outcome.summary}")
        click.echo(f"\n{graded(outcome)}")
        for key, value in remedies_of(outcome).items():
            click.echo(f"may help: {key} = {json.dumps(value)}")
        if helped:
            click.echo(f"\nwith all of them: {helped.grade}. {helped.text}")
        if scale:
            limits = "".join(f"\n- {reason}" for reason in scale.limited_by)
            most = factor(scale.scale)
            click.echo(
                f"\nlargest factor on this command with a usable test on the virtual rig: {most}"
                f"{limits and ', limited by:'}{limits}"
            )
    if not outcome.ok:
        raise click.exceptions.Exit(1)


_FORESEEN = (
    *("demands", "scheme", "margin", "smallest_sample_rate", "lowest_supply_pressure"),
    *("force_error", "displacement_error"),
)


def _linear(plan: TestPlan) -> eft.linear.LinearModel:
    rate = plan.command.sample_rate
    return eft.linearize(plan.rig, sampled=True, sample_rate=rate, flow_gain="steeper")


def _before(plan: TestPlan) -> str:
    """The state of the loop for which the linear margins hold, if the controller changes the loop."""
    if plan.rig["compensation.adaptive"]:
        return "before self-calibration"
    return "before the guard acts" if plan.rig["compensation.guard"] else ""


def _margins(plan: TestPlan) -> dict[str, Any]:
    try:
        rate = plan.command.sample_rate
        found = eft.linear.stability_margins(plan.rig, sampled=True, sample_rate=rate, flow_gain="steeper")
        return {name: value for name, value in asdict(found).items() if value is not None}
    except ValueError:
        if not (growth := _linear(plan).growth_rate) > 0.0:
            raise
        return {"growth_rate": growth}


def _together(of_run: Verdict, found: dict[str, Any]) -> Verdict:
    """The worse verdict of those on a test and before it, with the reasons of both."""
    grade = worst((of_run.grade, found["verdict"]))
    ordered = (of_run.reasons, found["reasons"])
    first, then = ordered if of_run.grade == grade else ordered[::-1]
    return replace(of_run, grade=grade, reasons=tuple(dict.fromkeys((*first, *then))))


def _helped(plan: TestPlan, outcome: Verdict) -> Verdict:
    """The verdict of the same test with every remedy."""
    with progress("with remedies") as update:
        return eft.simulate(plan.rig.replace(outcome.changes), plan.command, progress=update).verdict


def _demands(found: dict[str, Any]) -> list[tuple[str, ...]]:
    rows = []
    for demand in found["demands"]:
        unit, scale = shown(demand["unit"] or "ratio")
        numbers = (f"{demand[name] * scale:.4g}" for name in ("required", "advised", "available"))
        rows.append((f"{demand['name']}, {unit}", *numbers))
    return rows


def _settings(plan: TestPlan, found: dict[str, Any], margins: dict[str, Any]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [
        ("growth rate about rest, 1/s", f"{margins['growth_rate']:.3g}", "below 0")
    ]
    rate = found["smallest_sample_rate"]
    safe = f"safe from {rate:.0f}" if rate else "none found"
    rows.append(("sample rate, Hz", f"{plan.command.sample_rate:g}", safe))
    mode = plan.rig["compensation.mode"]
    rows.append(("compensation", mode, f"{found['scheme']} needed" if found["scheme"] else ""))
    if mode != "off":
        compensation = plan.rig["compensation"]
        if (largest := margins.get("level")) is not None:
            allowed = f"below {largest:.3f}" if math.isfinite(largest) else "any"
            rows.append(("compensation level", f"{compensation['level']:.3f}", allowed))
        if (span := margins.get("response_delay")) is not None:
            stable = _span(span[0] * 1e3, span[1] * 1e3, 2)
            rows.append(("response delay, ms", f"{compensation['response_delay'] * 1e3:.2f}", stable))
        if (span := margins.get("flow_gain")) is not None:
            rows.append(("true flow gain / configured", "1.000", _span(span[0], span[1], 3)))
    return rows


def _span(low: float, high: float, digits: int) -> str:
    return f"{low:.{digits}f} to {high:.{digits}f}" if math.isfinite(high) else f"above {low:.{digits}f}"
