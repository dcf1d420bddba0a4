"""`eft map`: stability of the loop over two settings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

import eft
from eft._files import atomic_write, write_text
from eft._study._values import kind_of, value_in_effect
from eft._test_file import read_rig
from eft.cli._output import FILE, as_json, emit_json, epilog, in_si, json_text, settings, units_option
from eft.traces._write import check_folder

_PICTURES = (".png", ".svg", ".pdf")
_DATA = (".csv", ".json")
_MOST = 250_000


@click.command(
    name="map",
    short_help="Draw stability maps of a rig.",
    epilog=epilog(
        "eft map test.toml",
        "eft map --rig rig.toml --kind delay-rate -o delay.png -o delay.csv",
        "eft map --x compensation.level 0.9 1.1 41 --y servovalve.flow_gain_scale 0.9 1.1 41",
    ),
)
@click.argument("file", required=False, type=FILE)
@click.option("--rig", type=FILE, help="Rig file instead of FILE; default: the paper's rig.")
@settings
@click.option(
    "--kind",
    type=click.Choice(list(eft.linear.STABILITY_MAPS)),
    help="Which of the common maps; default: level-damping.",
)
@click.option(
    "--x",
    "horizontal",
    type=(str, str, str, int),
    metavar="KEY LOW HIGH N",
    help="Setting on the horizontal axis.",
)
@click.option(
    "--y",
    "vertical",
    type=(str, str, str, int),
    metavar="KEY LOW HIGH N",
    help="Setting on the vertical axis.",
)
@click.option(
    "-o", "--output", "outputs", type=FILE, multiple=True,
    help="Picture (.png, .svg, .pdf) or data (.csv, .json); may be repeated. Default: map.png",
)  # fmt: skip
@units_option
@as_json
def stability_map(
    file: Path | None,
    rig: Path | None,
    changes: dict[str, Any],
    kind: str | None,
    horizontal: tuple[str, str, str, int] | None,
    vertical: tuple[str, str, str, int] | None,
    outputs: tuple[Path, ...],
    as_json: bool,
) -> None:
    """Draw where the sampled loop about rest is stable, over two settings of the rig or test in FILE.

    There are three common maps. level-damping varies the compensation level and the damping of the structure.
    delay-rate varies the response delay in the controller and the sample rate. rate-realization shows the
    largest stable level over the sample rate, for an analog and a digital force loop. --x and --y take any
    two keys. LOW and HIGH are in SI units, or have their unit, such as '7 t'.
    """
    targets = outputs or (() if as_json else (Path("map.png"),))
    for target in targets:
        if target.suffix.lower() not in _PICTURES + _DATA:
            raise click.UsageError(f"{target}: the suffix must be one of {', '.join(_PICTURES + _DATA)}")
        check_folder(target)
    if (horizontal is None) != (vertical is None) or (horizontal and kind):
        raise click.UsageError("give --kind, or both --x and --y")
    if file and rig:
        raise click.UsageError("give the rig once: FILE, or --rig")
    rig = file or rig
    chosen = read_rig(rig, changes) if rig else eft.Rig.zhao2005().replace(changes)
    if horizontal and vertical:
        if horizontal[3] * vertical[3] > _MOST:
            raise click.UsageError(f"{horizontal[3]} × {vertical[3]} points: must be at most {_MOST}")
        found = eft.linear.stability_map(
            chosen, _axis("--x", horizontal, chosen), _axis("--y", vertical, chosen)
        )
    else:
        # A building has one damper per story, and no map over a single damper.
        building = chosen["structure.kind"] == "shear_building"
        found = eft.linear.STABILITY_MAPS[kind or ("delay-rate" if building else "level-damping")](chosen)
    for target in targets:
        _write(found, chosen, target)
    if as_json:
        emit_json(_plain(found))
        return
    stable = found.stable.mean()
    click.echo(f"{chosen['name']}: stable at {stable:.0%} of {found.stable.size} points")
    if found.left_out:
        click.echo(f"not in the linear model: {', '.join(found.left_out)}")
    click.echo(f"{', '.join(map(str, targets))} written")


def _axis(option: str, given: tuple[str, str, str, int], rig: eft.Rig) -> tuple[str, list[float]]:
    key, *bounds, count = given
    if not 2 <= count <= 10_000:
        raise click.UsageError(f"{option} {key}: {count} points: must be from 2 to 10000")
    low, high = (in_si(f"{option} {key}", bound, kind_of(key, rig).unit) for bound in bounds)
    if not low < high < float("inf") or low == float("-inf"):
        raise click.UsageError(f"{option} {key}: {low:g} to {high:g}: low must lie below high, both finite")
    return key, [low + (high - low) * i / (count - 1) for i in range(count)]


def _plain(found: eft.linear.StabilityMap) -> dict[str, Any]:
    return {
        "quantity": found.quantity,
        "unit": {"growth_rate": "1/s", "level": ""}[found.quantity],
        "horizontal": {"key": found.horizontal_key, "values": found.horizontal.tolist()},
        "vertical": {"key": found.vertical_key, "values": found.vertical.tolist()},
        "values": found.values.tolist(),
        "left_out": list(found.left_out),
    }


def _write(found: eft.linear.StabilityMap, rig: eft.Rig, target: Path) -> None:
    suffix = target.suffix.lower()
    if suffix == ".json":
        write_text(target, json_text(_plain(found)) + "\n")
    elif suffix == ".csv":
        write_text(target, _csv(found))
    else:
        # Imported here, because matplotlib is slow to import.
        from eft import plots
        from eft.plots._style import page, printed
        from eft.plots.planning import map_axis

        with printed(), atomic_write(target) as temporary:
            figure = page(4.0)
            ax = plots.stability_map(found, ax=figure.subplots())
            ax.set_title(rig["name"] or "")
            if found.quantity == "growth_rate":
                keys = found.horizontal_key, found.vertical_key
                here = [(value_in_effect(rig, key), map_axis(key).factor) for key in keys]
                # A rig without an optional value has no place on its axis.
                if all(value is not None for value, _ in here):
                    point = [value * factor for value, factor in here]
                    ax.plot(*point, "o", color="black", markerfacecolor="white", label="this rig")
                    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
            figure.savefig(temporary)


def _csv(found: eft.linear.StabilityMap) -> str:
    """One line for each point, for spreadsheets."""
    lines = [f"{found.horizontal_key},{found.vertical_key},{found.quantity}"]
    for y, row in zip(found.vertical.tolist(), found.values.tolist(), strict=True):
        for x, value in zip(found.horizontal.tolist(), row, strict=True):
            lines.append(f"{x},{y},{'' if value != value else value}")
    return "\n".join(lines) + "\n"
