"""`eft identify`: a rig's parameters from measurements."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import click

import eft
from eft._display import shown
from eft._files import write_text
from eft._identification import Estimate
from eft._test_file import read_rig
from eft.cli._data import data_options, read_data, rig_option
from eft.cli._output import FILE, as_json, emit_json, epilog, table, units_option
from eft.traces import Traces
from eft.traces._write import check_folder


@click.group(
    short_help="Find a rig's parameters in measured data.",
    epilog=epilog(
        "eft identify delay test.csv", "eft identify curve slow.csv fast.csv --rig rig.toml -o curve.toml"
    ),
)
def identify() -> None:
    """Find parameters of a rig in CSV, MAT, HDF5 or Parquet files, whose columns name their units."""


def _toml(keys: Mapping[str, float | bool]) -> str:
    """Keys of two parts as sections of a rig file."""
    sections: dict[str, list[str]] = {}
    for key, value in keys.items():
        section, name = key.split(".")
        sections.setdefault(section, []).append(f"{name} = {json.dumps(value)}\n")
    return "\n".join(f"[{section}]\n{''.join(lines)}" for section, lines in sections.items())


def _area(piston_area: float | None, rig: Path | None) -> float:
    """The piston area, given or of a rig, m²."""
    if rig is not None and piston_area is None:
        return float(read_rig(rig, {})["actuator.piston_area"])
    if piston_area is not None and rig is None:
        return piston_area
    raise click.UsageError("give --piston-area or --rig, exactly one of them")


def _both(estimate: Estimate) -> tuple[float, float]:
    """The number and its uncertainty."""
    return float(estimate), estimate.uncertainty


def _of_one_rate(files: tuple[Path, ...], **data: Any) -> list[Traces]:
    runs = [read_data(file, **data) for file in files]
    rates = {round(run.sample_rate, 6) for run in runs}
    if len(rates) > 1:
        shown = ", ".join(f"{rate:g} Hz" for rate in sorted(rates))
        raise ValueError(f"sample rates differ, must be one: {shown}")
    return runs


@identify.command(
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
    traces = read_data(file, **data)
    found = eft.identify_delay(traces[reference], traces[response], traces.sample_rate, band)
    if as_json:
        emit_json({"delay": float(found), "uncertainty": found.uncertainty, "unit": "s"})
    else:
        click.echo(
            f"delay of {response} behind {reference}: {found * 1e3:.3f} ± {found.uncertainty * 1e3:.3f} ms"
        )


@identify.command(
    short_help="Find the flow curve of the valve.",
    epilog=epilog(
        "eft identify curve slow.csv fast.csv --piston-area 0.008212",
        "eft identify curve slow.csv --rig rig.toml -o curve.toml",
    ),
)
@click.argument("files", type=FILE, nargs=-1, required=True)
@click.option("--piston-area", type=float, metavar="M2", help="Effective piston area.")
@click.option("--rig", type=FILE, help="Rig file, for the piston area.")
@click.option("--knots", type=int, default=21, show_default=True, help="Control points from -1 to 1, odd.")
@click.option("-o", "--output", type=FILE, help="TOML file for the curve, ready for a rig file.")
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
    area = _area(piston_area, rig)
    if output is not None:
        check_folder(output)
    runs = _of_one_rate(files, rig=rig, **data)
    found = eft.identify_flow_curve(
        [run["spool"] for run in runs],
        [run["displacement"] for run in runs],
        runs[0].sample_rate,
        area,
        knots,
    )
    parts = ("openings", "flows", "uncertainty", "measured")
    openings, flows, uncertainty, measured = (getattr(found, name).tolist() for name in parts)
    if output is not None:
        write_text(output, f"[servovalve]\nflow_table.openings = {openings}\nflow_table.flows = {flows}\n")
    if as_json:
        emit_json(
            {
                "openings": openings,
                "flows": flows,
                "uncertainty": uncertainty,
                "measured": measured,
            }
        )
        return
    unit = shown("flow")
    rows = [
        (f"{x:+.3f}", f"{q * unit.factor:.2f}", f"{u * unit.factor:.2f}", "yes" if seen else "extrapolated")
        for x, q, u, seen in zip(openings, flows, uncertainty, measured, strict=True)
    ]
    click.echo(table(rows, ("opening", f"flow, {unit.unit}", "±", "measured")))
    if output is not None:
        click.echo(f"{output} written")


@identify.command(
    short_help="Find the overlap of the spool's lands.",
    epilog=epilog(
        "eft identify overlap null.csv --rig rig.toml",
        "eft identify overlap null.csv --piston-area 0.008212 -o overlap.toml",
    ),
)
@click.argument("files", type=FILE, nargs=-1, required=True)
@click.option("--piston-area", type=float, metavar="M2", help="Effective piston area.")
@click.option("--rig", type=FILE, help="Rig file, for the piston area.")
@click.option("-o", "--output", type=FILE, help="TOML file for overlap and null bias, ready for a rig file.")
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
    area = _area(piston_area, rig)
    if output is not None:
        check_folder(output)
    runs = _of_one_rate(files, rig=rig, **data)
    found = eft.identification.identify_overlap(
        [run["spool"] for run in runs], [run["displacement"] for run in runs], runs[0].sample_rate, area
    )
    bias = found.null_bias
    if output is not None:
        keys = f"overlap = {float(found)!r}\nnull_bias = {float(bias)!r}\n"
        write_text(output, f"[servovalve]\n{keys}")
    if as_json:
        emit_json(
            {
                "overlap": float(found),
                "overlap_uncertainty": found.uncertainty,
                "null_bias": float(bias),
                "null_bias_uncertainty": bias.uncertainty,
            }
        )
        return
    click.echo(
        f"{'underlap' if found < 0.0 else 'overlap'} {abs(found):.4%} ± {found.uncertainty:.4%} of the stroke"
    )
    click.echo(f"null bias {bias:.4%} ± {bias.uncertainty:.4%}")
    if output is not None:
        click.echo(f"{output} written")


@identify.command(
    short_help="Find the friction of the actuator's seals.",
    epilog=epilog(
        "eft identify friction sweep.csv --rig rig.toml",
        "eft identify friction sweep.csv --rig rig.toml -o friction.toml",
    ),
)
@click.argument("file", type=FILE)
@click.option("--rig", type=FILE, required=True, help="Rig file, with the overlap.")
@click.option("-o", "--output", type=FILE, help="TOML file for the friction, ready for a rig file.")
@units_option
@data_options
@as_json
def friction(file: Path, rig: Path, output: Path | None, as_json: bool, **data: Any) -> None:
    """Find the friction of the seals in spool, velocity and force of a sweep with the whole rig in FILE."""
    if output is not None:
        check_folder(output)
    traces = read_data(file, rig=rig, **data)
    signals = traces["spool"], traces["velocity"], traces["force"]
    found = eft.identification.identify_friction(read_rig(rig, {}), *signals, traces.sample_rate)
    if output is not None:
        write_text(output, f"[actuator]\nfriction = {max(float(found.friction), 0.0)!r}\n")
    if as_json:
        names = ("friction", "compressibility", "velocity_delay")
        answer: dict[str, Any] = {name: float(getattr(found, name)) for name in names}
        answer |= {f"{name}_uncertainty": getattr(found, name).uncertainty for name in names}
        emit_json(answer | {"flow_factors": [float(one) for one in found.flow_factors]})
        return
    unit = shown("force")
    oil = found.compressibility
    rows = [
        (f"friction, {unit.unit}", *(f"{one * unit.factor:.4g}" for one in _both(found.friction))),
        ("compressibility, m³/Pa", *(f"{one:.3g}" for one in _both(oil))),
        *(
            (f"flow, {way} direction", *(f"{one:.3f}" for one in _both(factor)))
            for way, factor in zip(("negative", "positive"), found.flow_factors, strict=True)
        ),
        ("velocity delay, ms", *(f"{one * 1e3:.3f}" for one in _both(found.velocity_delay))),
    ]
    click.echo(table(rows, ("", "found", "±")))
    if output is not None:
        click.echo(f"{output} written")


@identify.command(
    "force-loop",
    short_help="Find valve, oil and sensor latencies of the force loop.",
    epilog=epilog(
        "eft identify force-loop sweep.csv --rig rig.toml",
        "eft identify force-loop sweep.csv --rig rig.toml -o loop.toml",
    ),
)
@click.argument("file", type=FILE)
@click.option("--rig", type=FILE, required=True, help="Rig file, with the overlap.")
@click.option("-o", "--output", type=FILE, help="TOML file for valve, oil and latency, ready for a rig file.")
@data_options
@as_json
def force_loop(file: Path, rig: Path, output: Path | None, as_json: bool, **data: Any) -> None:
    """Find what the force loop depends on in a sweep to 40 Hz with the whole rig in FILE."""
    if output is not None:
        check_folder(output)
    traces = read_data(file, rig=rig, **data)
    signals = traces["valve_command"], traces["spool"], traces["velocity"], traces["force"]
    found = eft.identification.identify_force_loop(read_rig(rig, {}), *signals, traces.sample_rate)
    if output is not None:
        known = read_rig(rig, {})
        # Refuses values that no rig has.
        found.apply(known)
        write_text(output, _toml(found.keys(known)))
    if as_json:
        names = [one.name for one in fields(found)]
        answer: dict[str, Any] = {name: float(getattr(found, name)) for name in names}
        emit_json(answer | {f"{name}_uncertainty": getattr(found, name).uncertainty for name in names})
        return
    titles = {
        "force_delay": "latency of the load cell, ms",
        "spool_delay": "latency of the spool's sensor, ms",
        "response_delay": "delay of the valve, ms",
        "pilot_time_constant": "pilot time constant, ms",
    }
    rows = [
        (title, *(f"{one * 1e3:.3f}" for one in _both(getattr(found, name))))
        for name, title in titles.items()
    ]
    rows.append(("compressibility, m³/Pa", *(f"{one:.3g}" for one in _both(found.compressibility))))
    click.echo(table(rows, ("", "found", "±")))
    if output is not None:
        click.echo(f"{output} written")


@identify.command(
    "load-cell",
    short_help="Find the gain of the load cell, by the specimen's inertia.",
    epilog=epilog("eft identify load-cell sweep.csv --rig rig.toml --mass-uncertainty 0.002"),
)
@click.argument("file", type=FILE)
@click.option("--rig", type=FILE, required=True, help="Rig file, with the specimen.")
@click.option("--gain-uncertainty", type=float, default=0.01, help="Of each sensor's gain, as a share.")
@click.option("--mass-uncertainty", type=float, default=0.0, help="Of the specimen's mass, as a share.")
@data_options
@as_json
def load_cell(
    file: Path, rig: Path, gain_uncertainty: float, mass_uncertainty: float, as_json: bool, **data: Any
) -> None:
    """Find the gain of the load cell in a sweep to 40 Hz with the whole rig in FILE."""
    traces = read_data(file, rig=rig, **data)
    signals = traces["displacement"], traces["velocity"], traces["force"]
    found = eft.identification.identify_load_cell(
        read_rig(rig, {}),
        *signals,
        traces.sample_rate,
        gain_uncertainty=gain_uncertainty,
        mass_uncertainty=mass_uncertainty,
    )
    names = [one.name for one in fields(found)]
    if as_json:
        answer: dict[str, Any] = {name: float(getattr(found, name)) for name in names}
        emit_json(answer | {f"{name}_uncertainty": getattr(found, name).uncertainty for name in names})
        return
    titles = ("gain of the load cell", "load cell over velocity", "velocity over displacement")
    rows = [
        (title, *(f"{one:.4f}" for one in _both(getattr(found, name))))
        for title, name in zip(titles, names, strict=True)
    ]
    click.echo(table(rows, ("", "found", "±")))


@identify.command(
    short_help="Find damping ratio and natural frequency.",
    epilog=epilog("eft identify damping release.csv --start 1.2"),
)
@click.argument("file", type=FILE)
@click.option("--start", type=float, metavar="S", help="Time of the release; default: the first sample.")
@rig_option
@data_options
@as_json
def damping(file: Path, start: float | None, as_json: bool, **data: Any) -> None:
    """Find damping ratio and natural frequency, from the displacement of a free vibration."""
    traces = read_data(file, **data)
    part = slice(None) if start is None else traces.time >= start
    found = eft.identification.identify_damping(traces["displacement"][part], traces.sample_rate)
    frequency = found.frequency
    if as_json:
        emit_json(
            {
                "damping_ratio": float(found),
                "uncertainty": found.uncertainty,
                "frequency": float(frequency),
                "frequency_uncertainty": frequency.uncertainty,
            }
        )
    else:
        click.echo(f"damping ratio {found:.3%} ± {found.uncertainty:.3%}, {frequency:.4g} Hz")


@identify.command(
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
@click.option("-o", "--output", type=FILE, help="TOML file of the valve's keys, ready for a rig file.")
@as_json
def valve(file: Path, rated_signal: float, output: Path | None, as_json: bool) -> None:
    """Find natural frequency, damping and delay of the valve, from its frequency response in FILE.

    FILE is a CSV whose header names columns and units: frequency (Hz), amplitude (dB), phase (deg), of spool
    over command; it may be measured or read off the maker's plot.
    """
    if not rated_signal > 0.0 or rated_signal == float("inf"):
        raise click.UsageError(f"--rated-signal {rated_signal:g}: must be a finite number above zero, in V")
    if output is not None:
        check_folder(output)
    found = eft.identification.identify_valve(*eft.identification.read_frequency_response(file))
    keys = {key: value for key, value in found.keys(rated_signal).items() if value is not None}
    if output is not None:
        sections: dict[str, list[str]] = {}
        for key, value in keys.items():
            section, _, name = key.partition(".")
            sections.setdefault(section, []).append(f"{name} = {value!r}")
        text = "\n\n".join("\n".join([f"[{section}]", *lines]) for section, lines in sections.items())
        write_text(output, text + "\n")
    if as_json:
        names = ("natural_frequency", "damping_ratio", "response_delay")
        answer: dict[str, Any] = {name: float(getattr(found, name)) for name in names}
        answer |= {f"{name}_uncertainty": getattr(found, name).uncertainty for name in names}
        emit_json(answer | {"misfit": found.misfit, "keys": keys})
        return
    frequency, ratio, lag = found.natural_frequency, found.damping_ratio, found.response_delay
    rows = [
        ("natural frequency, Hz", f"{frequency:.2f}", f"{frequency.uncertainty:.2f}"),
        ("damping ratio", f"{ratio:.3f}", f"{ratio.uncertainty:.3f}"),
        ("response delay, ms", f"{lag * 1e3:.3f}", f"{lag.uncertainty * 1e3:.3f}"),
    ]
    click.echo(table(rows, ("", "found", "±")))
    click.echo(f"the response differs from that of second order by {found.misfit:.1%} (rms)")
    if output is not None:
        click.echo(f"{output} written")
