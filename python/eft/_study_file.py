"""Study files: a test file with a section for the varied settings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from eft._native import Command, Rig, quantity, rig_keys
from eft._run import Dtype
from eft._study._combinations import combinations_of
from eft._study._samplers import LatinHypercube, Sampler, Sobol
from eft._test_file import NOT_THE_RIG, command_section, make_command, parse_toml, read_text, rig_within
from eft._toml_lines import only_sections, pointed

TEMPLATE = """
# the varied settings: every value with every other,
[study.grid]
"compensation.mode" = ["linear", "nonlinear"]
# evenly spaced; with log = true in even ratios
"servovalve.flow_gain_scale" = { low = 0.95, high = 1.05, count = 5 }
# or points drawn from ranges, n of them:
# [study.latin_hypercube]
# n = 256
# seed = 1
# [study.latin_hypercube.ranges]
# "servovalve.flow_gain_scale" = { low = 0.9, high = 1.1 }
# "actuator.leakage" = { low = 1e-13, high = 1e-11, log = true }
# "compensation.mode" = ["linear", "nonlinear"]
"""


@dataclass(frozen=True)
class StudyPlan:
    """The arguments of `eft.study`."""

    rig: Rig
    commands: dict[str, Command]
    parameters: Mapping[str, Iterable[Any]] | list[dict[str, Any]] | Sampler
    dtype: Dtype
    traces: bool
    fft: bool


def read_study(path: Path, changes: Mapping[str, Any]) -> StudyPlan:
    """Read a study file: a rig, ``[command]`` or several ``[commands.NAME]``, and ``[study]``."""
    text = read_text(path)
    tree = parse_toml(path, text)
    section = tree.pop("study", None)
    if not isinstance(section, dict):
        raise ValueError(f"{path}: no section [study]; it must name the varied settings, as in [study.grid]")
    sections = _command_sections(path, tree)
    rig = rig_within(path, text, tree, changes)
    try:
        commands = {name: make_command(one, rig, path.parent)[0] for name, one in sections.items()}
        options = {key: value for key, value in section.items() if key not in _WAYS}
        ways = [key for key in section if key in _WAYS]
        if len(ways) != 1:
            found = " and ".join(f"[study.{way}]" for way in ways) or "none"
            allowed = ", ".join(f"[study.{way}]" for way in _WAYS)
            raise ValueError(f"study: {found}: must have exactly one of {allowed}")
        given = {key: _option(key, value) for key, value in options.items()}
        parameters = _WAYS[ways[0]](section[ways[0]])
        combinations_of(parameters, rig)
    except ValueError as error:
        # The rig's own sections may have the same keys, which are not the error.
        raise pointed(path, only_sections(text, NOT_THE_RIG), error) from None
    return StudyPlan(rig, commands, parameters, **({"dtype": "f64", "traces": False, "fft": True} | given))


def _command_sections(path: Path, tree: dict[str, Any]) -> dict[str, dict[str, Any]]:
    several = tree.pop("commands", None)
    if several is None:
        section = command_section(path, tree)
        tree.pop("command")
        return {"command": section}
    if "command" in tree:
        raise ValueError(f"{path}: [command] and [commands]: must be one of them")
    if not isinstance(several, dict) or not all(isinstance(one, dict) for one in several.values()):
        raise ValueError(f"{path}: commands = {several!r}: must be sections [commands.NAME]")
    return several


def _option(key: str, value: Any) -> Any:
    allowed: dict[str, tuple[Any, ...]] = {
        "dtype": ("f64", "f32"),
        "traces": (True, False),
        "fft": (True, False),
    }
    if key not in allowed:
        raise ValueError(f"unknown key `study.{key}`; there are {', '.join((*allowed, *_WAYS))}")
    if not any(value is choice or (isinstance(choice, str) and value == choice) for choice in allowed[key]):
        words = " or ".join(str(choice).lower() for choice in allowed[key])
        raise ValueError(f"study.{key} = {value!r}: must be {words}")
    return value


def _grid(section: Any) -> dict[str, Iterable[Any]]:
    axes: dict[str, Iterable[Any]] = {}
    for key, value in _flat("study.grid", section).items():
        if isinstance(value, dict):
            low, high, log = _range(key, value, {"count"})
            count = value.get("count")
            if not isinstance(count, int) or isinstance(count, bool) or not 2 <= count <= 100_000:
                raise ValueError(f"{key}.count = {count!r}: must be a whole number from 2 to 100000")
            if log and not low > 0:
                raise ValueError(f"{key}.low = {low!r}: must lie above zero, as log = true")
            axes[key] = (np.geomspace if log else np.linspace)(low, high, count)
        else:
            axes[key] = value
    return axes


def _list(section: Any) -> list[dict[str, Any]]:
    if not isinstance(section, list):
        raise ValueError(f"study.list = {section!r}: must be sections [[study.list]], one per combination")
    return [_flat("study.list", one) for one in section]


def _sampler(kind: type[Sampler], name: str) -> Callable[[Any], Sampler]:
    def read(section: Any) -> Sampler:
        if not isinstance(section, dict) or "ranges" not in section or "n" not in section:
            raise ValueError(f"study.{name}: must have n, the number of points, and a section ranges")
        if unknown := set(section) - {"n", "seed", "ranges"}:
            raise ValueError(f"unknown key `study.{name}.{min(unknown)}`; there are n, seed, ranges")
        ranges: dict[str, Any] = {}
        for key, value in _flat(f"study.{name}.ranges", section["ranges"]).items():
            if isinstance(value, dict):
                low, high, log = _range(key, value, set())
                ranges[key] = (low, high, "log") if log else (low, high)
            else:
                ranges[key] = value
        return kind(ranges, section["n"], section.get("seed", 0))

    return read


_WAYS: dict[str, Callable[[Any], Any]] = {
    "grid": _grid,
    "list": _list,
    "latin_hypercube": _sampler(LatinHypercube, "latin_hypercube"),
    "sobol": _sampler(Sobol, "sobol"),
}


def _flat(name: str, section: Any, prefix: str = "") -> dict[str, Any]:
    """Dotted keys, quoted or not: TOML takes those without quotes for sections."""
    if not isinstance(section, dict):
        raise ValueError(f"{name} = {section!r}: must be a section of dotted keys")
    answer: dict[str, Any] = {}
    for key, value in section.items():
        if isinstance(value, dict) and "low" not in value and "high" not in value:
            answer |= _flat(name, value, f"{prefix}{key}.")
        else:
            answer[prefix + key] = value
    return answer


def _range(key: str, value: Mapping[str, Any], more: set[str]) -> tuple[float, float, bool]:
    allowed = {"low", "high", "log"} | more
    if unknown := set(value) - allowed:
        raise ValueError(
            f"{key}: unknown `{min(unknown)}` in its range; there are {', '.join(sorted(allowed))}"
        )
    unit = next((entry["unit"] for entry in rig_keys() if entry["key"] == key), "")
    bounds = []
    for name in ("low", "high"):
        bound = value.get(name)
        if not isinstance(bound, int | float | str) or isinstance(bound, bool):
            raise ValueError(f"{key}.{name} = {bound!r}: must be a number")
        bounds.append(quantity(f"{key}.{name}", bound, unit) if isinstance(bound, str) else bound)
    log = value.get("log", False)
    if not isinstance(log, bool):
        raise ValueError(f"{key}.log = {log!r}: must be true or false")
    return bounds[0], bounds[1], log
