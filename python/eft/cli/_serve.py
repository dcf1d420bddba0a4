"""`eft serve`: the virtual rig as an experimental site for finite-element models."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from eft._test_file import read_rig
from eft.cli._output import FILE, POSITIVE, epilog, settings
from eft.opensees import Site, serve
from eft.opensees._server import Visit


@click.command(
    "serve",
    short_help="Connect OpenSees with the virtual rig.",
    epilog=epilog("eft serve rig.toml", "eft serve rig.toml --port 8091 --clients 1"),
)
@click.argument("rig", type=FILE)
@settings
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Address to listen at. Anyone who reaches it can drive the rig.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=8090,
    show_default=True,
    help="Port to listen at; 0 for any free one.",
)
@click.option(
    "--clients", type=click.IntRange(min=0), help="End after this number of clients; default: never."
)
@click.option(
    "--idle",
    type=POSITIVE,
    default=600.0,
    show_default=True,
    metavar="S",
    help="Longest time between two messages of a client.",
)
def serve_rig(
    rig: Path, changes: dict[str, Any], host: str, port: int, clients: int | None, idle: float
) -> None:
    """Let the element `genericClient` of OpenSees drive the rig of a file as its experimental site.

    A client sends displacements. The rig moves its specimen there, waits until it rests, and returns the
    force. One client is served at a time, and each starts with the rig at rest. Ctrl-C ends it.
    """
    site = Site(read_rig(rig, changes))
    serve(
        site,
        host,
        port,
        clients=clients,
        idle=idle,
        ready=lambda host, port: click.echo(f"listening at {host}, port {port}"),
        visited=_tell,
    )


def _tell(visit: Visit) -> None:
    click.echo(f"{visit.steps} steps, {visit.moves} displacements: {visit.ending}", err=not visit.ended_well)
