"""`eft benchmark`: comparison of controllers on rigs that deviate."""

from __future__ import annotations

import math
import sys
from dataclasses import asdict
from pathlib import Path

import click

import eft
from eft.cli._output import FILE, as_json, emit_json, epilog, progress, table

_HEADER = (
    "",
    "lost",
    "error",
    "90 %",
    "< 20 Hz",
    "delay",
    "peak",
    "in band",
    "displ.",
    "spool",
    "energy",
    "instr.",
)

_LEGEND = """
Medians over all tests, "lost" where more than half of them are. In band: share of the sweeps with force
over command within 0.93 and 1.07 from 0.5 to 9.5 Hz. Instr.: budget of a
tick on a Cortex-M4F, where it is measured."""


@click.command(
    short_help="Compare controllers on rigs that differ from their configuration.",
    epilog=epilog(
        "eft benchmark --short",
        "eft benchmark --controller mine:Controller --controller robust-curve",
        "eft benchmark --random 100 --seed 7 -o results.csv",
        "eft benchmark --list",
    ),
)
@click.option(
    "--controller",
    "controllers",
    multiple=True,
    metavar="NAME",
    help="A name of --list, an entry point, or package:Class; may be repeated. All of --list by default.",
)
@click.option("--short", is_flag=True, help="Five rigs and two commands only.")
@click.option(
    "--random", type=click.IntRange(0, 100_000), help="Number of random rigs; default: 8, with --short 0."
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the random rigs.")
@click.option("--list", "listed", is_flag=True, help="List the controllers and rigs, and run nothing.")
@click.option(
    "-o", "--output", type=FILE, help="Write a row for each test (.csv), after an interrupt for those done."
)
@as_json
def benchmark(
    controllers: tuple[str, ...],
    short: bool,
    random: int | None,
    seed: int,
    listed: bool,
    output: Path | None,
    as_json: bool,
) -> None:
    """Run controllers on rigs that differ from the controllers' configuration, and print a line for each.

    A controller is a class with a method `step`, see the page "Bring your controller". A test is lost if
    the controller fails, becomes unstable or leaves the stroke. It counts as an infinite error.
    """
    if listed:
        titles = {name: one.title for name, one in eft.benchmark.COMPETITORS.items()}
        cases = [case.name for case in eft.benchmark.named_cases()]
        if as_json:
            emit_json({"controllers": titles, "rigs": cases})
        else:
            click.echo("\n".join(f"{name:22}{title}" for name, title in titles.items()))
            click.echo("\n" + "\n".join(cases))
        return
    if output is not None and output.suffix.lower() != ".csv":
        raise click.UsageError(f"{output}: the suffix must be .csv")
    # As with `python -m`, a module in the working directory can be named.
    sys.path.insert(0, str(Path.cwd()))
    done = total = 0
    try:
        with progress("tests") as update:

            def watch(tests: int, of: int) -> None:
                nonlocal done, total
                done, total = tests, of
                update(tests, of)

            found = eft.benchmark.run(
                controllers or None, short=short, random=random, seed=seed, progress=watch, output=output
            )
    except KeyboardInterrupt:
        if output is not None and done:
            kept = len(eft.benchmark.Benchmark.load(output).rows)
            click.echo(f"{kept} of {total} tests are kept in {output}", err=True)
        raise
    if as_json:
        emit_json({"summary": [asdict(one) for one in found.summary()]})
        return
    click.echo(table([_cells(one) for one in found.summary()], _HEADER))
    click.echo(_LEGEND)
    for name, reason in _reasons(found).items():
        click.echo(f"{name}: {reason}")
    if output is not None:
        click.echo(f"{output} written")


def _cells(one: eft.benchmark.Summary) -> tuple[str, ...]:
    return (
        one.controller,
        f"{one.lost} of {one.tests}",
        _shown(one.nrmse),
        _shown(one.nrmse_90),
        _shown(one.slow_error),
        f"{1e3 * one.delay:.1f} ms" if math.isfinite(one.delay) else "lost",
        _shown(one.peak_error),
        f"{one.within_band:.0%}",
        _shown(one.displacement_error),
        f"{one.max_spool:.0%}" if math.isfinite(one.max_spool) else "lost",
        f"{1e-3 * one.energy:.0f} kJ" if math.isfinite(one.energy) else "lost",
        str(one.instructions or "–"),
    )


def _shown(error: float) -> str:
    return f"{error:.1%}" if math.isfinite(error) else "lost"


def _reasons(found: eft.benchmark.Benchmark) -> dict[str, str]:
    """The first reason for a lost test of each controller, with rig and command."""
    reasons: dict[str, str] = {}
    for row in found.rows:
        if row.lost:
            reasons.setdefault(row.controller, f"lost {row.test} on {row.case}: {row.lost}")
    return reasons
