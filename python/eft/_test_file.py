"""Test files: a rig and its command."""

from __future__ import annotations

import difflib
import math
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from eft import _foreign as foreign
from eft._display import shown
from eft._floors import floor_mass
from eft._native import Command, Rig, effective_force, read_record, sine_sweep
from eft._toml_lines import pointed, without_sections

EL_CENTRO = "RSN6_IMPVALL.I_I-ELC180-hor1.AT2"
"""The record in the package; its name is `elcentro`."""

TEMPLATE = """
# the force command: a sine sweep,
[command]
kind = "sweep"
# N
amplitude = 8900.0
# Hz
f_start = 0.0
f_end = 10.0
# s
duration = 32.0
# or an earthquake: AT2, CSMIP or COSMOS V2, K-NET, CSV; "elcentro" ships with the package
# kind = "record"
# file = "elcentro"
# unit of a file that names none: g, m/s2, cm/s2, mm/s2, in/s2, ft/s2
# unit = "g"
# factor on the ground acceleration
# scale = 1.0
"""


@dataclass(frozen=True)
class TestPlan:
    """A rig and its command."""

    __test__ = False  # pytest would collect classes with this name

    rig: Rig
    command: Command
    about: str
    """The command in words."""


@dataclass(frozen=True)
class _Kind:
    required: dict[str, type]
    optional: dict[str, type]
    make: Callable[[Mapping[str, Any], Rig, Path], tuple[Command, str]] = field(repr=False)


def read_test(path: Path, changes: Mapping[str, Any]) -> TestPlan:
    """Read a test file: the sections of a rig, or ``rig = "file.toml"``, and a section ``[command]``."""
    text = read_text(path)
    tree = parse_toml(path, text)
    section = command_section(path, tree)
    tree = {key: value for key, value in tree.items() if key not in NOT_THE_RIG}
    rig = rig_within(path, text, tree, changes)
    try:
        command, about = make_command(section, rig, path.parent)
    except ValueError as error:
        raise pointed(path, text, error) from None
    return TestPlan(rig, command, about)


def command_section(path: Path, tree: Mapping[str, Any]) -> dict[str, Any]:
    """The section with the command."""
    section = tree.get("command")
    if section is None:
        raise ValueError(f"{path}: no section [command]; it must describe the force command")
    if not isinstance(section, dict):
        raise ValueError(f"{path}: command = {section!r}: must be a section [command]")
    return section


def rig_within(path: Path, text: str, tree: dict[str, Any], changes: Mapping[str, Any]) -> Rig:
    """The rig of a file: its sections, or the file that ``rig`` names. `tree` contains only these."""
    if "rig" not in tree:
        return _rig_of(path, text, tree, changes)
    others = ", ".join(key for key in tree if key != "rig")
    if others:
        raise ValueError(f"{path}: `rig` names a file, so this file must not have keys of a rig: {others}")
    if not isinstance(tree["rig"], str):
        raise ValueError(f"{path}: rig = {tree['rig']!r}: must be the name of a rig file")
    return _rig_file(path.parent / tree["rig"], changes)


NOT_THE_RIG = ("command", "commands", "study")
"""Sections of a test or a study, which a rig does not have."""


def read_rig(path: Path, changes: Mapping[str, Any]) -> Rig:
    """Read a rig file, or the rig of a test or study file."""
    text, tree = _without_test(path)
    return rig_within(path, text, tree, changes)


def _rig_file(path: Path, changes: Mapping[str, Any]) -> Rig:
    """A rig file with its own sections, because files that name files could continue without end."""
    text, tree = _without_test(path)
    return _rig_of(path, text, tree, changes)


def _without_test(path: Path) -> tuple[str, dict[str, Any]]:
    text = read_text(path)
    return text, {key: value for key, value in parse_toml(path, text).items() if key not in NOT_THE_RIG}


def _rig_of(path: Path, text: str, tree: dict[str, Any], changes: Mapping[str, Any]) -> Rig:
    try:
        # From the text if possible, because the core's parser has better messages for invalid TOML.
        rest = without_sections(text, NOT_THE_RIG)
        rig = Rig(rest) if tomllib.loads(rest) == tree else Rig.from_dict(tree)
    except ValueError as error:
        said = str(pointed(path, text, error))
        hint = "; `eft init` writes a complete file" if str(error).startswith("missing key") else ""
        raise ValueError(said + hint) from None
    return rig.replace(changes) if changes else rig


def read_text(path: Path) -> str:
    """A configuration file as text, with a limit of 4 MiB."""
    return foreign.read_text(path, 4 * 1024**2, "configuration")


_MANY_PARTS = re.compile(
    r"""(?<![A-Za-z0-9_-])(?:(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){32}"""
)
"""The beginning of a key with many parts, for which the time of `tomllib` is quadratic."""


def parse_toml(path: Path, text: str) -> dict[str, Any]:
    """Parse TOML; the error names line and column."""
    if many := _MANY_PARTS.search(text):
        line = text.count("\n", 0, many.start()) + 1
        raise ValueError(f"{path}, line {line}: a key of more than 32 parts")
    try:
        return tomllib.loads(text)
    except ValueError as error:
        try:
            # The parser of the core also knows the line of an unexpected end.
            Rig(text)
        except ValueError as better:
            if str(better).startswith("line "):
                raise ValueError(f"{path}, {better}") from None
        raise ValueError(f"{path}: {error}") from None
    except RecursionError:
        raise ValueError(f"{path}: nested too deeply for a configuration") from None


def make_command(section: Mapping[str, Any], rig: Rig, folder: Path) -> tuple[Command, str]:
    """Build the command that a section ``[command]`` describes; files are relative to `folder`."""
    name = section.get("kind")
    if name not in _KINDS:
        allowed = ", ".join(f'"{kind}"' for kind in _KINDS)
        shown = "missing" if name is None else f"= {name!r}"
        raise ValueError(f"command.kind {shown}: must be one of {allowed}")
    kind = _KINDS[name]
    allowed_keys = kind.required | kind.optional
    for key, value in section.items():
        if key == "kind":
            continue
        if key not in allowed_keys:
            short = key if len(key) <= 80 else key[:80] + "…"
            near = difflib.get_close_matches(short, allowed_keys, 1, 0.0)[0]
            raise ValueError(
                f"unknown key `command.{short}`; the nearest key of a {name} is `command.{near}`"
            )
        _check(key, value, allowed_keys[key])
    for key in kind.required:
        if key not in section:
            raise ValueError(f"command.{key} is missing: a {name} needs {', '.join(kind.required)}")
    try:
        return kind.make(section, rig, folder)
    except ValueError as error:
        said = str(error)
        raise ValueError(said if said.startswith("command.") else f"command: {said}") from None


def _check(key: str, value: object, wanted: type) -> None:
    if wanted is float:
        good = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        word = "a finite number"
    elif wanted is int:
        good, word = isinstance(value, int) and not isinstance(value, bool) and value >= 0, "a whole number"
    else:
        good, word = isinstance(value, str), "a string"
    if not good:
        raise ValueError(f"command.{key} = {value!r}: must be {word}")


def _sample_rate(section: Mapping[str, Any], rig: Rig) -> float:
    return float(section.get("sample_rate", rig["controller.sample_rate"]))


def _sweep(section: Mapping[str, Any], rig: Rig, _folder: Path) -> tuple[Command, str]:
    if rig["structure.kind"] == "shear_building":
        raise ValueError(
            "command.kind = sweep: has one actuator; must be record or drive for a shear building"
        )
    numbers = {key: float(section[key]) for key in ("amplitude", "f_start", "f_end", "duration")}
    command = sine_sweep(**numbers, sample_rate=_sample_rate(section, rig))
    amplitude = shown("force")(numbers["amplitude"])
    about = (
        f"sine sweep of {amplitude}, {numbers['f_start']:g} to {numbers['f_end']:g} Hz "
        f"in {numbers['duration']:g} s"
    )
    return command, about


def _record(section: Mapping[str, Any], rig: Rig, folder: Path) -> tuple[Command, str]:
    options = {key: section[key] for key in ("dt", "unit", "channel") if key in section}
    if section["file"] == "elcentro":
        with resources.as_file(resources.files("eft").joinpath("data", EL_CENTRO)) as shipped:
            record = read_record(shipped, **options)
    else:
        record = read_record(folder / section["file"], **options)
    scale = float(section.get("scale", 1.0))
    if "mass" in section and rig["structure.kind"] == "shear_building":
        raise ValueError("command.mass: must be left out for a shear building, whose floors have their own")
    mass = float(section["mass"]) if "mass" in section else floor_mass(rig)
    command = effective_force(record, mass=mass, sample_rate=_sample_rate(section, rig), scale=scale)
    peak = shown("acceleration")(record.pga, ".3g")
    return command, f"{record.name}, ground acceleration of {peak} scaled by {scale:g}"


def _drive(section: Mapping[str, Any], rig: Rig, folder: Path) -> tuple[Command, str]:
    # Imported here, because most tests read no traces.
    from eft.traces import read_traces

    building = rig["structure.kind"] == "shear_building"
    files = [folder / section["file"]]
    if building:
        files = drive_files(files[0], len(rig["structure.stories.masses"]))
    drives = [read_traces(file) for file in files]
    first = drives[0]
    for file, traces in zip(files, drives, strict=True):
        if traces["command"].shape != first["command"].shape or traces.sample_rate != first.sample_rate:
            raise ValueError(
                f"{file.name}: {len(traces['command'])} samples at {traces.sample_rate:g} Hz, must be "
                f"{len(first['command'])} at {first.sample_rate:g} Hz as in {files[0].name}"
            )
    # A rate within a thousandth of the rig's is the rig's; the file has a rounded clock.
    rate = _sample_rate(section, rig)
    rate = rate if abs(rate / first.sample_rate - 1.0) < 1e-3 else first.sample_rate
    values = [traces["command"] for traces in drives]
    return Command(values if building else values[0], rate), f"drive of {section['file']}"


def drive_files(path: Path, actuators: int) -> list[Path]:
    """The files of a drive: one, or for several actuators drive-1.csv, drive-2.csv, ... from the ground."""
    if actuators == 1:
        return [path]
    return [path.with_stem(f"{path.stem}-{number + 1}") for number in range(actuators)]


_KINDS = {
    "sweep": _Kind(
        dict.fromkeys(("amplitude", "f_start", "f_end", "duration"), float), {"sample_rate": float}, _sweep
    ),
    "record": _Kind(
        {"file": str},
        {"scale": float, "mass": float, "sample_rate": float, "dt": float, "unit": str, "channel": int},
        _record,
    ),
    "drive": _Kind({"file": str}, {"sample_rate": float}, _drive),
}
