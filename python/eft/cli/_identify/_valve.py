"""`eft identify` for the valve: delay, flow curve, overlap, frequency response."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

import eft
from eft._display import shown
from eft._laboratory import check_flow, check_travel
from eft._test_file import read_rig
from eft.cli._data import data_options, read_data, rig_option
from eft.cli._identify._answer import found_table, give, numbers, output_option, row
from eft.cli._output import FILE, amount, as_json, epilog, table, units_option
from eft.traces import Traces


def _area(piston_area: float | None, rig: Path | None, runs: list[Traces]) -> float:
    """The piston area, m², given or of a rig, whose actuator must be able to make the displacements."""
    if rig is not None and piston_area is None:
        actuator = read_rig(rig, {})
        check_travel(actuator, runs)
        return float(actuator["actuator.piston_area"])
    if piston_area is not None and rig is None:
        return piston_area
    raise click.UsageError("give --piston-area or --rig, exactly one of them")


def _of_one_rate(files: tuple[Path, ...], **data: Any) -> list[Traces]:
    runs = [read_data(file, gaps=True, **data) for file in files]
    rates = {round(run.sample_rate, 6) for run in runs}
    if len(rates) > 1:
        shown = ", ".join(f"{rate:g} Hz" for rate in sorted(rates))
        raise ValueError(f"sample rates differ, must be one: {shown}")
    return runs


@click.command(
    short_help="Find the delay of one signal after another.",
    epilog=epilog(
        "eft identify delay test.csv",
        "eft identify delay valve.csv --reference valve_command --response spool --band 0.5 15",
    ),
)
@click.argument("file", type=FILE)
@click.option("--reference", default="command", show_default=True, help="Earlier signal.")
@click.option("--response", default="force", show_default=True, help="Later signal.")
@click.option(
    "--band",
    type=float,
    nargs=2,
    default=(0.25, 10.0),
    show_default=True,
    metavar="HZ HZ",
    help="Band of the phase.",
)
@rig_option
@data_options
@as_json
def delay(
    file: Path, reference: str, response: str, band: tuple[float, float], as_json: bool, **data: Any
) -> None:
    """Find the delay of one signal of FILE after another, from the slope of the phase."""
    traces = read_data(file, gaps=True, **data)
    found = eft.identify_delay(traces[reference], traces[response], traces.sample_rate, band)
    give(
        {"delay": float(found), "uncertainty": found.uncertainty, "unit": "s"},
        f"delay of {response} behind {reference}: {found * 1e3:.3f} ± {found.uncertainty * 1e3:.3f} ms",
        as_json,
    )


@click.command(
    short_help="Find the flow curve of the valve.",
    epilog=epilog(
        "eft identify curve slow.csv fast.csv --piston-area 0.008212",
        "eft identify curve slow.csv --rig rig.toml -o curve.toml",
    ),
)
@click.argument("files", type=FILE, nargs=-1, required=True)
@click.option(
    "--piston-area",
    callback=amount("m²"),
    metavar="M2",
    help="Effective piston area; or with its unit, as 12.73in2.",
)
@click.option("--rig", type=FILE, help="Rig file, for piston area and stroke.")
@click.option("--knots", type=int, default=21, show_default=True, help="Control points from -1 to 1, odd.")
@output_option("the curve")
@units_option
@data_options
@as_json
def curve(
    files: tuple[Path, ...],
    piston_area: float | None,
    rig: Path | None,
    knots: int,
    output: Path | None,
    as_json: bool,
    **data: Any,
) -> None:
    """Find the valve's flow curve in spool and displacement of tests without load, one file per test."""
    runs = _of_one_rate(files, rig=rig, **data)
    area = _area(piston_area, rig, runs)
    found = eft.identify_flow_curve(
        [run["spool"] for run in runs],
        [run["displacement"] for run in runs],
        runs[0].sample_rate,
        area,
        knots,
    )
    if rig is not None:
        check_flow(read_rig(rig, {}), found)
    parts = ("openings", "flows", "uncertainty", "measured")
    answer = {name: getattr(found, name).tolist() for name in parts}
    unit = shown("flow")
    rows = [
        (f"{x:+.3f}", f"{q * unit.factor:.2f}", f"{u * unit.factor:.2f}", "yes" if seen else "extrapolated")
        for x, q, u, seen in zip(*answer.values(), strict=True)
    ]
    text = table(rows, ("opening", f"flow, {unit.unit}", "±", "measured"))
    keys = {f"servovalve.flow_table.{name}": answer[name] for name in ("openings", "flows")}
    # The curve contains unequal areas.
    give(answer, text, as_json, output, keys | {"actuator.area_ratio": 1.0})


@click.command(
    short_help="Find the overlap of the spool's lands.",
    epilog=epilog(
        "eft identify overlap null.csv --rig rig.toml",
        "eft identify overlap null.csv --piston-area 0.008212 -o overlap.toml",
    ),
)
@click.argument("files", type=FILE, nargs=-1, required=True)
@click.option(
    "--piston-area",
    callback=amount("m²"),
    metavar="M2",
    help="Effective piston area; or with its unit, as 12.73in2.",
)
@click.option("--rig", type=FILE, help="Rig file, for piston area and stroke.")
@output_option("overlap and null bias")
@data_options
@as_json
def overlap(
    files: tuple[Path, ...],
    piston_area: float | None,
    rig: Path | None,
    output: Path | None,
    as_json: bool,
    **data: Any,
) -> None:
    """Find overlap and null bias of the spool in slow strokes near null without load, one file per test."""
    runs = _of_one_rate(files, rig=rig, **data)
    area = _area(piston_area, rig, runs)
    found = eft.identification.identify_overlap(
        [run["spool"] for run in runs], [run["displacement"] for run in runs], runs[0].sample_rate, area
    )
    bias = found.null_bias
    answer = {
        "overlap": float(found),
        "overlap_uncertainty": found.uncertainty,
        **numbers(found, ["null_bias"]),
    }
    name = "underlap" if found < 0.0 else "overlap"
    text = (
        f"{name} {abs(found):.4%} ± {found.uncertainty:.4%} of the stroke\n"
        f"null bias {bias:.4%} ± {bias.uncertainty:.4%}"
    )
    keys = {"servovalve.overlap": float(found), "servovalve.null_bias": float(bias)}
    give(answer, text, as_json, output, keys)


@click.command(
    short_help="Find the valve's keys in a frequency response.",
    epilog=epilog("eft identify valve bode.csv", "eft identify valve bode.csv -o valve.toml"),
)
@click.argument("file", type=FILE)
@click.option(
    "--rated-signal",
    type=float,
    default=10.0,
    show_default=True,
    metavar="V",
    help="Command of full opening.",
)
@output_option("the valve's keys")
@as_json
def valve(file: Path, rated_signal: float, output: Path | None, as_json: bool) -> None:
    """Find natural frequency, damping and delay of the valve, from its frequency response in FILE.

    FILE is a CSV whose header names columns and units: frequency (Hz), amplitude (dB), phase (deg), of spool
    over command; it may be measured or read off the maker's plot.
    """
    if not rated_signal > 0.0 or rated_signal == float("inf"):
        raise click.UsageError(f"--rated-signal {rated_signal:g}: must be a finite number above zero, in V")
    found = eft.identification.identify_valve(*eft.identification.read_frequency_response(file))
    keys = {key: value for key, value in found.keys(rated_signal).items() if value is not None}
    answer = numbers(found, ("natural_frequency", "damping_ratio", "response_delay"))
    rows = [
        row("natural frequency, Hz", found.natural_frequency, ".2f"),
        row("damping ratio", found.damping_ratio, ".3f"),
        row("response delay, ms", found.response_delay, ".3f", 1e3),
    ]
    misfit = f"the response differs from that of second order by {found.misfit:.1%} (rms)"
    text = f"{found_table(rows)}\n{misfit}"
    give(answer | {"misfit": found.misfit, "keys": keys}, text, as_json, output, keys)
