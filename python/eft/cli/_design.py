"""`eft design`: a force loop that keeps the oil column damped."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

import eft
from eft._test_file import read_rig
from eft.cli._output import FILE, as_json, emit_json, epilog, table


@click.command(
    short_help="Design a robust force loop for a rig.",
    epilog=epilog("eft design rig.toml", "eft design rig.toml --json"),
)
@click.argument("rig", type=FILE)
@as_json
def design(rig: Path, as_json: bool) -> None:
    """Print gains for the force loop of the rig file RIG, and their margins with the piston at rest.

    `controller.force_loop = "robust"` in the file takes these gains and runs the loop digitally. Exit code 2
    where no gains keep the oil column damped.
    """
    config = read_rig(rig, {})
    loop = eft.design_force_loop(config)
    if as_json:
        emit_json({"coefficients": loop.coefficients, "margins": asdict(loop.margins)})
        return
    margins = loop.margins
    rows = [(key, f"{config[key]:.4g}", f"{value:.4g}") for key, value in loop.coefficients.items()]
    rows += [
        ("gain margin", "", f"{margins.gain:.3g}"),
        ("delay margin", "", f"{1e3 * margins.delay:.3g} ms"),
        ("damping of the oil column", "", f"{margins.damping:.2g}"),
        ("e_max", "", f"{margins.e_max:.3g}"),
    ]
    click.echo(table(rows, ("", "given", "designed")))
