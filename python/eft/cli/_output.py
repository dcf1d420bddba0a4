"""Common parts of the commands: options, formatted numbers, JSON, progress."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import click
import numpy as np

from eft._display import UnitSystem, use_units
from eft._native import quantity

F = TypeVar("F", bound=Callable[..., Any])

FILE = click.Path(path_type=Path)


def beside(path: Path, suffix: str) -> Path:
    """The file of the same name with another ending; `.` and `..` have the name of their folder."""
    named = path if path.name.strip(".") else path.resolve()
    if not named.name:
        raise click.UsageError(f"{path}: is the root of all folders, must be a file or a study")
    return named.with_suffix(suffix)


def in_si(name: str, text: str, unit: str) -> float:
    """A number in an SI unit, or a text with its unit as in a rig file."""
    try:
        return float(text)
    except ValueError:
        return quantity(name, text, unit)


def amount(unit: str) -> Callable[[click.Context, click.Parameter, str | None], float | None]:
    """Callback of an option that takes a value as `in_si` does."""

    def parse(ctx: click.Context, param: click.Parameter, value: str | None) -> float | None:
        try:
            return None if value is None else in_si(param.opts[0], value, unit)
        except ValueError as error:
            raise click.UsageError(str(error), ctx) from None

    return parse


class _Positive(click.FloatRange):
    """A number above zero; `FloatRange` alone accepts NaN."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number: float = super().convert(value, param, ctx)
        if math.isnan(number):
            self.fail(f"{value} is not in the range x>0.", param, ctx)
        return number


POSITIVE = _Positive(min=0.0, min_open=True)
"""The type of an option that must be above zero."""

as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object, for scripts.")
"""The option of every command with JSON output."""


def _use_units(_ctx: click.Context, _param: click.Parameter, system: UnitSystem | None) -> None:
    if system is not None:
        use_units(system)


units_option = click.option(
    "--units",
    "shown_units",
    type=click.Choice(["si", "us"]),
    expose_value=False,
    callback=_use_units,
    help="Units of the output: kN, mm, MPa, L/min or kip, in, psi, gpm.",
)
"""The option of every command that shows quantities; files and --json stay in SI units."""


def epilog(*examples: str) -> str:
    """Examples for the end of a help page."""
    return "\b\nExamples:\n" + "\n".join(f"  {example}" for example in examples)


def _parse_settings(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> dict[str, Any]:
    """`key=value`, the value in TOML; a bare word is a string."""
    answer: dict[str, Any] = {}
    for setting in values:
        key, equals, text = (part.strip() for part in setting.partition("="))
        if not (equals and key and text):
            raise click.BadParameter(f"`{setting}` must be key=value, as in structure.mass=7040", ctx, param)
        try:
            answer[key] = tomllib.loads(f"value = {text}")["value"]
        except (tomllib.TOMLDecodeError, RecursionError):
            answer[key] = text
    return answer


settings = click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="KEY=VALUE",
    callback=_parse_settings,
    help="Change a key of the rig; may be repeated.",
)


def factor(largest: float) -> str:
    """A largest factor on a command; none limits one that is infinite."""
    return f"{largest:.3g}" if math.isfinite(largest) else "any"


def emit_json(answer: dict[str, Any]) -> None:
    """Print an answer as `json_text`."""
    click.echo(json_text(answer))


def json_text(answer: dict[str, Any]) -> str:
    """An answer as JSON, with null for NaN."""
    return json.dumps(_plain(answer), indent=2, ensure_ascii=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def table(rows: Sequence[Sequence[str]], header: Sequence[str] | None = None) -> str:
    """Columns of text: the first to the left, the others to the right."""
    lines = [header, *rows] if header else rows
    widths = [max(len(line[i]) for line in lines) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


@contextmanager
def progress(title: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on a terminal, nothing in a log; yields a function of the finished and the total number."""
    from tqdm import tqdm

    with tqdm(desc=title, unit="sample", unit_scale=True, leave=False, disable=None) as bar:

        def update(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield update
