"""`eft identify` for a rig with its specimen: friction, force loop, load cell, damping."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import click

import eft
from eft._display import shown
from eft._measured_force import check_force
from eft._test_file import read_rig
from eft.cli._data import data_options, read_data, rig_option
from eft.cli._identify._answer import found_table, give, numbers, output_option, row
from eft.cli._output import FILE, as_json, epilog, units_option
from eft.traces import Traces

_LARGEST_FORCE = 30.0
"""Largest rms of the force over that of its command. Without compensation the force may have resonances."""


def _sweep(file: Path, rig: Path, data: dict[str, Any]) -> Traces:
    """A test with the whole rig. Its force is compared with its command, if the file has one."""
    traces = read_data(file, rig=rig, **data)
    if {"command", "force"} <= traces.columns.keys():
        check_force(traces["command"], traces["force"], _LARGEST_FORCE)
    return traces


@click.command(
    short_help="Find the friction of the actuator's seals.",
    epilog=epilog(
        "eft identify friction sweep.csv --rig rig.toml",
        "eft identify friction sweep.csv --rig rig.toml -o friction.toml",
    ),
)
@click.argument("file", type=FILE)
@click.option("--rig", type=FILE, required=True, help="Rig file, with the overlap.")
@output_option("the friction")
@units_option
@data_options
@as_json
def friction(file: Path, rig: Path, output: Path | None, as_json: bool, **data: Any) -> None:
    """Find the friction of the seals in spool, velocity and force of a sweep with the whole rig in FILE."""
    traces = _sweep(file, rig, data)
    signals = traces["spool"], traces["velocity"], traces["force"]
    found = eft.identification.identify_friction(read_rig(rig, {}), *signals, traces.sample_rate)
    answer: dict[str, Any] = numbers(found, ("friction", "compressibility", "velocity_delay"))
    unit = shown("force")
    rows = [
        row(f"friction, {unit.unit}", found.friction, ".4g", unit.factor),
        row("compressibility, m³/Pa", found.compressibility, ".3g"),
        *(
            row(f"flow, {way} direction", factor, ".3f")
            for way, factor in zip(("negative", "positive"), found.flow_factors, strict=True)
        ),
        row("velocity delay, ms", found.velocity_delay, ".3f", 1e3),
    ]
    answer["flow_factors"] = [float(one) for one in found.flow_factors]
    keys = {"actuator.friction": max(float(found.friction), 0.0)}
    give(answer, found_table(rows), as_json, output, keys)


@click.command(
    "force-loop",
    short_help="Find valve, oil and sensor latencies of the force loop.",
    epilog=epilog(
        "eft identify force-loop sweep.csv --rig rig.toml",
        "eft identify force-loop sweep.csv --rig rig.toml -o loop.toml",
    ),
)
@click.argument("file", type=FILE)
@click.option("--rig", type=FILE, required=True, help="Rig file, with the overlap.")
@output_option("valve, oil and latency")
@data_options
@as_json
def force_loop(file: Path, rig: Path, output: Path | None, as_json: bool, **data: Any) -> None:
    """Find valve, oil and sensor latencies in FILE, a sweep to 40 Hz with the whole rig."""
    traces = _sweep(file, rig, data)
    signals = traces["valve_command"], traces["spool"], traces["velocity"], traces["force"]
    known = read_rig(rig, {})
    found = eft.identification.identify_force_loop(known, *signals, traces.sample_rate)
    if output is not None:
        # Refuses values that no rig has.
        found.apply(known)
    rows = [
        row("latency of the load cell, ms", found.force_delay, ".3f", 1e3),
        row("latency of the spool's sensor, ms", found.spool_delay, ".3f", 1e3),
        row("delay of the valve, ms", found.response_delay, ".3f", 1e3),
        row("pilot time constant, ms", found.pilot_time_constant, ".3f", 1e3),
        row("compressibility, m³/Pa", found.compressibility, ".3g"),
    ]
    answer = numbers(found, [one.name for one in fields(found)])
    give(answer, found_table(rows), as_json, output, found.keys(known))


@click.command(
    "load-cell",
    short_help="Find the gain of the load cell, by the specimen's inertia.",
    epilog=epilog("eft identify load-cell sweep.csv --rig rig.toml --mass-uncertainty 0.002"),
)
@click.argument("file", type=FILE)
@click.option("--rig", type=FILE, required=True, help="Rig file, with the specimen.")
@click.option("--gain-uncertainty", type=float, default=0.01, help="Of each sensor's gain; tolerance/√3.")
@click.option("--mass-uncertainty", type=float, default=0.0, help="Of the specimen's mass, as a share.")
@data_options
@as_json
def load_cell(
    file: Path, rig: Path, gain_uncertainty: float, mass_uncertainty: float, as_json: bool, **data: Any
) -> None:
    """Find the gain of the load cell in a sweep to 40 Hz with the whole rig in FILE."""
    traces = _sweep(file, rig, data)
    signals = traces["displacement"], traces["velocity"], traces["force"]
    found = eft.identification.identify_load_cell(
        read_rig(rig, {}),
        *signals,
        traces.sample_rate,
        gain_uncertainty=gain_uncertainty,
        mass_uncertainty=mass_uncertainty,
    )
    rows = [
        row("gain of the load cell", found.gain, ".4f"),
        row("load cell over velocity", found.force_over_velocity, ".4f"),
        row("velocity over displacement", found.velocity_over_displacement, ".4f"),
    ]
    give(numbers(found, [one.name for one in fields(found)]), found_table(rows), as_json)


@click.command(
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
    traces = read_data(file, gaps=True, **data)
    part = slice(None) if start is None else traces.time >= start
    found = eft.identification.identify_damping(traces["displacement"][part], traces.sample_rate)
    answer = {
        "damping_ratio": float(found),
        "uncertainty": found.uncertainty,
        **numbers(found, ["frequency"]),
    }
    text = f"damping ratio {found:.3%} ± {found.uncertainty:.3%}, {found.frequency:.4g} Hz"
    give(answer, text, as_json)
