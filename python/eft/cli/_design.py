"""`eft design`: a force loop that keeps the oil column damped."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

import eft
from eft._files import atomic_write
from eft._test_file import read_rig
from eft.cli._output import FILE, as_json, emit_json, epilog, table
from eft.traces._write import check_folder


@click.command(
    short_help="Design a robust force loop for a rig.",
    epilog=epilog("eft design rig.toml", "eft design rig.toml -o gains.png", "eft design rig.toml --json"),
)
@click.argument("rig", type=FILE)
@click.option(
    "-o", "--output", type=FILE, help="Picture of the gain margin over both gains (.png, .svg, .pdf)."
)
@as_json
def design(rig: Path, output: Path | None, as_json: bool) -> None:
    """Print gains for the force loop of the rig file RIG, and their margins with the piston at rest.

    `controller.force_loop = "robust"` in the file takes these gains and runs the loop digitally. Exit code 2
    if no gains keep the oil column damped.
    """
    if output is not None:
        if output.suffix.lower() not in (".png", ".svg", ".pdf"):
            raise click.UsageError(f"{output}: the suffix must be one of .png, .svg, .pdf")
        check_folder(output)
    config = read_rig(rig, {})
    loop = eft.design_force_loop(config)
    if output is not None:
        # Imported here, because matplotlib is slow to import.
        from eft.plots._style import page, printed

        with printed(), atomic_write(output) as temporary:
            figure = page(3.4)
            eft.tune_force_loop(config).plot(ax=figure.subplots())
            figure.savefig(temporary)
    if as_json:
        emit_json({"coefficients": loop.coefficients, "margins": asdict(loop.margins)})
        return
    margins = loop.margins
    rows = [(key, f"{config[key]:.4g}", f"{value:.4g}") for key, value in loop.coefficients.items()]
    rows += [
        ("gain margin", "", f"{margins.gain:.3g}"),
        ("delay margin", "", f"{1e3 * margins.delay:.3g} ms"),
        ("damping of the oil column", "", f"{margins.damping:.2g}"),
        ("normalised coprime margin", "", f"{margins.e_max:.3g}"),
    ]
    click.echo(table(rows, ("", "given", "designed")))
    if output is not None:
        click.echo(f"{output} written")
