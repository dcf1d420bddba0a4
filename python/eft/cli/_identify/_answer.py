"""How the commands of `eft identify` answer: a table or JSON, and a file with the keys of a rig."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import click

from eft._files import write_text
from eft._identification import Estimate
from eft.cli._output import FILE, F, emit_json, table
from eft.traces._write import check_folder


def _writable(_ctx: click.Context, _param: click.Parameter, path: Path | None) -> Path | None:
    if path is not None:
        check_folder(path)
    return path


def output_option(what: str) -> Callable[[F], F]:
    """The option for the file with the found keys."""
    help_text = f"TOML file for {what}, ready for a rig file."
    return click.option("-o", "--output", type=FILE, callback=_writable, help=help_text)


def row(title: str, found: Estimate, form: str, factor: float = 1.0) -> tuple[str, str, str]:
    """A line of the table: an estimate and its uncertainty in a unit."""
    return title, f"{found * factor:{form}}", f"{found.uncertainty * factor:{form}}"


def found_table(rows: Iterable[tuple[str, str, str]]) -> str:
    """The table of the lines."""
    return table([*rows], ("", "found", "±"))


def numbers(found: Any, names: Iterable[str]) -> dict[str, float]:
    """Estimates of a result and their uncertainties, for JSON."""
    estimates = {name: getattr(found, name) for name in names}
    answer = {name: float(one) for name, one in estimates.items()}
    return answer | {f"{name}_uncertainty": one.uncertainty for name, one in estimates.items()}


def _toml(keys: Mapping[str, object]) -> str:
    """Keys as sections of a rig file."""
    sections: dict[str, list[str]] = {}
    for key, value in keys.items():
        section, _, name = key.partition(".")
        sections.setdefault(section, []).append(f"{name} = {json.dumps(value)}\n")
    return "\n".join(f"[{section}]\n{''.join(lines)}" for section, lines in sections.items())


def give(
    answer: dict[str, Any],
    text: str,
    as_json: bool,
    output: Path | None = None,
    keys: Mapping[str, object] | None = None,
) -> None:
    """Write the keys to the output, and print the answer as JSON or as text."""
    if output is not None and keys is not None:
        write_text(output, _toml(keys))
    if as_json:
        emit_json(answer)
        return
    click.echo(text)
    if output is not None:
        click.echo(f"{output} written")
