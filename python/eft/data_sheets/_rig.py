"""A whole rig from a data sheet, and the missing values of a sheet."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

from eft._findings import SELF_CALIBRATION
from eft._force_loop import design_force_loop
from eft._native import Rig
from eft._planning import delay_budget
from eft._test_file import parse_toml, read_text
from eft._toml_lines import pointed
from eft.data_sheets._hydraulics import actuator, supply
from eft.data_sheets._structure import stories, structure
from eft.data_sheets._valve import servovalve

__all__ = ["QUESTIONS", "TEMPLATE", "Question", "missing", "rig"]

FULL_SCALE = 10.0
"""Output of the load cell's conditioner at the largest force of the actuator, V."""

SAMPLE_RATE = 4096.0
"""Sample rate if the sheet names none, Hz."""


class Question(NamedTuple):
    """A required value of a data sheet."""

    key: str
    """Section and key of the sheet."""
    text: str
    """The question."""
    example: str
    """An example of a value."""
    unit: str
    """SI unit of a number."""
    instead: tuple[str, ...] = ()
    """Alternative keys."""


QUESTIONS = (
    Question("structure.mass", "mass of the specimen", "12 t", "kg", ("structure.masses",)),
    Question("structure.frequency", "natural frequency", "2.3 Hz", "Hz", ("structure.stiffnesses",)),
    Question("structure.damping_ratio", "damping ratio", "2 %", "", ("structure.damping_ratios",)),
    Question("actuator.force", "largest force of the actuator", "250 kN", "N", ("actuator.area",)),
    Question("actuator.stroke", "stroke from end to end", "250 mm", "m"),
    Question("servovalve.rated_flow", "rated flow of the valve", "90 gpm", "m³/s"),
    Question("servovalve.rated_drop", "pressure drop over both lands at that flow", "1000 psi", "Pa"),
    Question(
        "servovalve.phase_90_frequency",
        "frequency of a phase of -90°",
        "60 Hz",
        "Hz",
        ("servovalve.rise_time",),
    ),
    Question("supply.pressure", "supply pressure", "3000 psi", "Pa"),
    Question("supply.pump_flow", "largest flow of the pump", "20 gpm", "m³/s"),
    Question("supply.accumulator_volume", "gas volume of the accumulator", "10 gal", "m³"),
    Question("supply.precharge", "precharge of the accumulator", "1500 psi", "Pa"),
)
"""The required values of a data sheet, in its order."""

TEMPLATE = """# The data of actuator, valve and supply from their makers, and the data of the specimen.
# Values have their unit. `eft init rig.toml --from-data-sheet FILE` makes a rig of them.
name = "my rig"

[structure]
mass = "12 t"
frequency = "2.3 Hz"
damping_ratio = "2 %"
# a building has, for each floor: masses, stiffnesses; and damping_ratios, rayleigh

[actuator]
# largest force at the supply pressure; or `area`
force = "250 kN"
# from end to end
stroke = "250 mm"

[servovalve]
rated_flow = "90 gpm"
# over both lands
rated_drop = "1000 psi"
# of a small signal; or `rise_time`, from 10 to 90 % of a step
phase_90_frequency = "60 Hz"
damping_ratio = 0.9

[supply]
pressure = "3000 psi"
pump_flow = "20 gpm"
accumulator_volume = "10 gal"
precharge = "1500 psi"
"""
"""A data sheet to fill in."""


def missing(sheet: Mapping[str, Any]) -> list[Question]:
    """Find the values that a data sheet lacks.

    Parameters
    ----------
    sheet : mapping
        Sections with keys, as for `rig`.

    Returns
    -------
    list of Question
        In the order of `QUESTIONS`.

    Raises
    ------
    AttributeError
        If the sheet is not a mapping.

    Examples
    --------
    >>> import eft
    >>> [question.key for question in eft.data_sheets.missing({"supply": {"pressure": "3000 psi"}})][:2]
    ['structure.mass', 'structure.frequency']
    """
    given = {f"{name}.{key}" for name, part in sheet.items() if isinstance(part, Mapping) for key in part}
    return [question for question in QUESTIONS if not given & {question.key, *question.instead}]


def rig(sheet: Mapping[str, Any] | str | PathLike[str]) -> Rig:
    """Make a rig from a data sheet: its plant and an initial controller.

    The sheet has the sections ``structure``, ``actuator``, ``servovalve`` and ``supply``. The keys of a
    section are the arguments of the function of the same name. For a building the keys of ``structure`` are
    those of `stories`. A section ``controller`` may have a ``sample_rate``. The flow of the valve and the
    force of the actuator refer to the pressure of the supply.

    The controller has the designed force loop (`eft.design_force_loop`) and self-calibration. Its nonlinear
    compensation has the delay of `eft.linear.delay_budget`. The load cell has 10 V at the largest force.

    Parameters
    ----------
    sheet : mapping or path-like
        Sections with keys, or a TOML file of them.

    Returns
    -------
    Rig
        The rig, with the name from the sheet.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If something is missing, unknown or not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> sheet = {
    ...     "structure": {"mass": "12 t", "frequency": "2.3 Hz", "damping_ratio": "2 %"},
    ...     "actuator": {"force": "250 kN", "stroke": "250 mm"},
    ...     "servovalve": {"rated_flow": "90 gpm", "rated_drop": "1000 psi", "phase_90_frequency": "60 Hz"},
    ...     "supply": {"pressure": "3000 psi", "pump_flow": "20 gpm", "accumulator_volume": "10 gal",
    ...                "precharge": "1500 psi"},
    ... }
    >>> eft.data_sheets.rig(sheet)["structure.mass"]
    12000.0
    """
    if isinstance(sheet, Mapping):
        return _rig(sheet)
    path = Path(sheet)
    text = read_text(path)
    try:
        return _rig(parse_toml(path, text))
    except ValueError as error:
        raise error if str(error).startswith(str(path)) else pointed(path, text, error) from None


def _rig(sheet: Mapping[str, Any]) -> Rig:
    parts = {name: dict(part) for name, part in sheet.items() if isinstance(part, Mapping)}
    building = "masses" in parts.get("structure", {})
    makers: dict[str, Callable[..., dict[str, Any]]] = {
        "structure": stories if building else structure,
        "supply": supply,
        "actuator": actuator,
        "servovalve": servovalve,
    }
    _check_names(sheet, makers)
    if open_questions := missing(sheet):
        names = ", ".join(question.key for question in open_questions)
        raise ValueError(f"missing from the data sheet: {names}")
    pressure = parts["supply"]["pressure"]
    for name in ("actuator", "servovalve"):
        parts[name].setdefault("supply_pressure", pressure)
    keys: dict[str, Any] = {"name": sheet.get("name", "from a data sheet")}
    for name, make in makers.items():
        try:
            keys |= make(**parts.get(name, {}))
        except ValueError as error:
            raise ValueError(f"{name}.{error}") from None
    return _controlled(keys, parts.get("controller", {}).get("sample_rate", SAMPLE_RATE))


def _controlled(keys: Mapping[str, Any], sample_rate: Any) -> Rig:
    """The plant with an initial controller."""
    start = Rig.zhao2005()
    largest = keys["actuator.piston_area"] * keys["supply.pressure"]
    controller = {
        "controller.force_sensitivity": FULL_SCALE / largest,
        "controller.sample_rate": sample_rate,
        "controller.force_loop": "robust",
        "controller.realization": "digital",
        "compensation.supply_correction": "supply.pump_flow" in keys,
        **dict(SELF_CALIBRATION),
    }
    found = start.replace({"structure.softening": None, "structure.kind": "linear"} | dict(keys) | controller)
    # Gains for a change to the loop as given, because the paper's gains suit the paper's valve.
    found = found.replace(design_force_loop(found).coefficients)
    return found.replace({"compensation.response_delay": delay_budget(found).path})


def _check_names(sheet: Mapping[str, Any], makers: Mapping[str, Callable[..., Any]]) -> None:
    allowed = {name: list(inspect.signature(make).parameters) for name, make in makers.items()}
    allowed["controller"] = ["sample_rate"]
    for name, part in sheet.items():
        if name == "name":
            continue
        if name not in allowed or not isinstance(part, Mapping):
            raise ValueError(f"unknown section `{name}`: must be one of {', '.join(allowed)}")
        for key in part:
            if key not in allowed[name]:
                near = difflib.get_close_matches(key, allowed[name], 1, 0.0)[0]
                raise ValueError(f"unknown key `{name}.{key}`; the nearest known key is `{name}.{near}`")
