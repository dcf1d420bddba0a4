"""``python -m eft.demo``: run the paper's tests, compare them with the paper, write figures and a report."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from tqdm import tqdm

import eft
from eft import paper
from eft._display import shown
from eft.demo import experiments, figures, report, tables


def main(arguments: Sequence[str] | None = None) -> int:
    """Returns 0, 1 if a number is too far from its reference, or 2 for wrong input."""
    options = _parse(arguments)
    try:
        return run(options)
    except (OSError, ValueError) as error:
        print(f"eft.demo: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("eft.demo: interrupted, nothing more is written", file=sys.stderr)
        return 130


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m eft.demo",
        description="The paper's tests on the virtual rig: a table, figures and a report.",
        epilog="example: python -m eft.demo --record northridge.at2 --scale 0.6 --output northridge",
    )
    parser.add_argument("--record", type=Path, metavar="FILE", help="ground motion instead of El Centro")
    parser.add_argument("--unit", help="unit of the record, if not in the file: g, m/s2, cm/s2, ...")
    parser.add_argument("--scale", type=_scale, metavar="X", help="factor on the ground acceleration")
    parser.add_argument("--short", action="store_true", help="leave out the sweeps of Fig. 11")
    parser.add_argument(
        "--output", type=Path, metavar="DIR", default=Path("demo-output"), help="default: %(default)s"
    )
    return parser.parse_args(arguments)


def _scale(text: str) -> float:
    value = float(text)
    if not math.isfinite(value) or value == 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not a finite factor other than zero")
    return value


def run(options: argparse.Namespace) -> int:
    """Run, print and write; returns 1 if a number is too far from its reference, otherwise 0."""
    start = time.perf_counter()
    console = Console(width=None if sys.stdout.isatty() else 150)
    # The files are read first, so that an invalid one is reported before the tests.
    test = experiments.EarthquakeTest(options.record, options.scale, options.unit)
    options.output.mkdir(parents=True, exist_ok=True)
    cases = [case for case in paper.load().cases if "8" in case.figures or not options.short]

    results, runs = [], {}
    # `disable=None` hides the bar in a log.
    with tqdm(
        total=len(cases) + len(experiments.SCHEMES), unit="test", leave=False, disable=None
    ) as progress:
        for case in cases:
            progress.set_postfix_str(case.title)
            results.append(experiments.sweep(case))
            progress.update()
        for scheme in experiments.SCHEMES:
            progress.set_postfix_str(f"earthquake, {scheme}")
            runs[scheme] = test.run(scheme)
            progress.update()
    quake = test.result(runs)

    sweep_table, quake_table = tables.sweeps(results), tables.earthquake(quake)
    console.print(sweep_table.rich())
    console.print(quake_table.rich())
    for scheme, run in runs.items():
        console.print(f"{scheme}: {run.message}", highlight=False)
    console.print()
    verdict, passed = _verdict(results)
    console.print(verdict, highlight=False)

    page = report.write(
        options.output,
        verdict,
        [
            report.Section("Sine sweeps", _SWEEPS, sweep_table, list(figures.sweeps(results))),
            report.Section("Earthquake test", _about(quake), quake_table, list(figures.earthquake(quake))),
        ],
        eft.Rig.zhao2005().to_toml(),
    )
    console.print(f"figures and report: {page} ({time.perf_counter() - start:.1f} s)", highlight=False)
    return 0 if passed else 1


_SWEEPS = (
    "“Reference” is an independent model of the same rig, computed once with a converged step. “Apart” is "
    "the largest relative difference of a value in the row. “Spool” is the largest opening as a fraction of "
    "the stroke. “Lowest” and “highest” are the extremes of |FFT(force)| / |FFT(command)|."
)


def _about(quake: experiments.Earthquake) -> str:
    record = quake.record
    messages = "\n".join(f"- {scheme}: {run.message}" for scheme, run in quake.runs.items())
    duration = len(record.acceleration) * record.dt
    peak = shown("force")(abs(quake.command.values).max(), ".1f")
    pga = shown("acceleration")(record.pga, ".3g")
    return (
        f"{record.name}: peak ground acceleration {pga}, {duration:.1f} s, "
        f"scaled by {quake.scale:g}; the command peaks at {peak}. "
        "The paper's own test used another record, so the table quotes its words instead of its numbers. "
        f"How the tests went:\n\n{messages}"
    )


def _verdict(results: Sequence[experiments.SweepResult]) -> tuple[str, bool]:
    comparisons = [(result.case.title, c) for result in results for c in result.comparisons()]
    far = [f"{title}: {c}" for title, c in comparisons if not c.within]
    tolerance = paper.load().tolerance
    rule = f"{tolerance.relative:.0%} (frequencies: {tolerance.bins:g} bin of the FFT)"
    if not far:
        return f"All {len(comparisons)} reference numbers are met within {rule}.", True
    head = f"{len(far)} of {len(comparisons)} reference numbers are not met within {rule}:"
    return "\n".join([head, *far]), False


if __name__ == "__main__":
    sys.exit(main())
