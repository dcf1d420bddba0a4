"""The common options that describe a test, and the test from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

import eft
from eft._memory import check_memory, memory_of_samples
from eft._test_file import TestPlan, make_command, read_rig, read_test
from eft.cli._output import FILE, POSITIVE, F, amount, settings

memory_option = click.option(
    "--memory",
    type=POSITIVE,
    default=2.0,
    metavar="GIB",
    help="Memory that the tests may take; default: 2 GiB.",
)

_OPTIONS = (
    click.argument("test", type=FILE, required=False),
    click.option("--rig", type=FILE, help="Rig file, instead of the paper's rig."),
    click.option(
        "--sweep", type=float, nargs=4, metavar="N HZ HZ S", help="Sine sweep: amplitude, from, to, duration."
    ),
    click.option("--record", metavar="FILE", help="Ground motion; `elcentro` ships with eft."),
    click.option("--scale", type=float, help="Factor on the ground acceleration."),
    click.option(
        "--unit", metavar="UNIT", help="Unit of the record, if not in the file: g, m/s2, cm/s2, ..."
    ),
    click.option("--dt", type=float, metavar="S", help="Time step of the record, if not in the file."),
    click.option("--channel", type=int, metavar="N", help="Channel of a V2 file, counted from 1."),
    click.option(
        "--mass",
        callback=amount("kg"),
        metavar="KG",
        help="Mass of the effective force, or with its unit; default: the structure's.",
    ),
    click.option(
        "--sample-rate",
        type=float,
        metavar="HZ",
        help="Sample rate of the command; default: the rig's controller.sample_rate.",
    ),
    memory_option,
    settings,
)


def test_options(function: F) -> F:
    """The argument and the options that describe a test."""
    for option in reversed(_OPTIONS):
        function = option(function)
    return function


def command_options(function: F) -> F:
    """The options that describe a test, without the argument."""
    for option in reversed(_OPTIONS[1:]):
        function = option(function)
    return function


def plans_of(
    tests: Sequence[Path], rig: Path | None, changes: Mapping[str, Any], command: Mapping[str, Any]
) -> list[TestPlan]:
    """Several tests from test files and ground motions, or the one test of the options."""
    if not tests:
        return [plan_of(None, rig, changes, command)]
    plans = []
    for test in tests:
        if test.suffix.lower() == ".toml":
            plans.append(plan_of(test, rig, changes, command))
        else:
            plans.append(plan_of(None, rig, changes, dict(command) | {"record": str(test)}))
    return plans


def plan_of(
    test: Path | None, rig: Path | None, changes: Mapping[str, Any], command: Mapping[str, Any]
) -> TestPlan:
    """The test of a file or of options; refused if it needs too much memory."""
    options = dict(command)
    allowed = options.pop("memory")
    plan = _plan(test, rig, changes, options)
    check_memory(f"{plan.about}: {len(plan.command)} samples need", memory_of(plan), allowed)
    return plan


def memory_of(plan: TestPlan) -> float:
    """Memory that a test takes, GiB."""
    return memory_of_samples(plan.rig, len(plan.command))


def _plan(
    test: Path | None, rig: Path | None, changes: Mapping[str, Any], command: Mapping[str, Any]
) -> TestPlan:
    options = {key: value for key, value in command.items() if value is not None}
    if test is not None:
        if rig is not None or options:
            given = ", ".join(
                f"--{name.replace('_', '-')}" for name in (["rig"] if rig else []) + list(options)
            )
            rig_file = "" if rig else f", or name a rig file by --rig {test}"
            raise click.UsageError(
                f"{test}: a test file describes the whole test; leave out {given}{rig_file}"
            )
        return read_test(test, changes)
    sweep, record = options.pop("sweep", None), options.pop("record", None)
    if (sweep is None) == (record is None):
        raise click.UsageError("give a test file, --sweep or --record, exactly one of them")
    section = dict(options)
    if record is not None:
        section |= {"kind": "record", "file": record}
    else:
        section |= dict(zip(("amplitude", "f_start", "f_end", "duration"), sweep, strict=True), kind="sweep")
    chosen = read_rig(rig, changes) if rig else eft.Rig.zhao2005().replace(changes)
    return TestPlan(chosen, *make_command(section, chosen, Path()))
