"""Writes the reference of the configuration from the schema that checks it, by section."""

import tomllib
from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import eft
from eft._files import write_text

SOURCES = tomllib.loads((Path(__file__).parent / "sources.toml").read_text(encoding="utf-8"))
SECTIONS = {
    "": "A name for the rig.",
    "actuator": "The cylinder between the reaction frame and the specimen.",
    "supply": "The pump and its accumulator.",
    "servovalve": "Pilot stage, main spool and flow curve.",
    "controller": "The force loop, and where it takes the velocity from.",
    "compensation": "The velocity feedback of the paper, and the self-calibration.",
    "structure": "The specimen.",
    "sensors": "How each sensor changes the true signal.",
    "dac": "The converter between the controller and the valve.",
    "protection": "Levels that warn, trip the test, or shut the valve.",
    "limits": "Limits of the output and of plausible measurements.",
    "verdict": "Limits of the verdict: beyond `caution` it is a caution, beyond `no` it is no.",
}
SENSORS = ("force", "velocity", "displacement", "spool", "supply_pressure", "acceleration")


def write(folder: Path) -> None:
    """One part for each section; the keys that every sensor has are written once."""
    parts: dict[str, list[str]] = {}
    seen = set()
    for key in eft.rig_keys():
        name = key["key"]
        section = name.split(".")[0] if "." in name else ""
        if section == "truth":
            continue
        parts.setdefault(section, [])
        words = name.split(".")
        if section == "sensors" and words[1] in SENSORS:
            if words[2] not in seen:
                seen.add(words[2])
                parts[section].append(_of_every_sensor(words[2]))
            continue
        parts[section].append(_entry(name, key, _allowed(key)))
    text = ""
    for section, entries in parts.items():
        heading = f"`[{section}]`" if section else "Name"
        text += f"## {heading}\n\n{SECTIONS.get(section, '')}\n\n" + "\n".join(entries) + "\n"
    write_text(folder / "keys.md", text)


def _entry(name: str, key: Mapping[str, Any], allowed: str) -> str:
    """A key as a description, because a table does not wrap on a narrow page."""
    unit = f" ({key['unit']})" if key["unit"] else ""
    doc = key["doc"][0].upper() + key["doc"][1:]
    source = next((one for pattern, one in SOURCES.items() if fnmatchcase(name, pattern)), {})
    facts = [
        ("*Default*", _default(key)),
        ("*Paper's rig*", _of_the_paper(name, key)),
        ("*Allowed*", allowed),
    ]
    sources = [("*Comes from*", source.get("from")), ("*Typical*", source.get("typical"))]
    told = ". ".join(f"{what}: {said}" for what, said in facts if said)
    source = ". ".join(f"{what}: {said}" for what, said in sources if said)
    body = "\n\n".join(part for part in (f"{doc}{unit}.", told + ".", source and source + ".") if part)
    return f":::{{confval}} {name}\n{body}\n:::\n"


def _default(key: Mapping[str, Any]) -> str:
    if key["required"]:
        return "none, the key is required"
    if key["required_where"]:
        return f"none, the key is required where `{key['required_where']}`"
    return "absent" if key["default"] is None else _value(key["default"])


def _of_the_paper(name: str, key: Mapping[str, Any]) -> str | None:
    value = None if "SENSOR" in name else eft.Rig.zhao2005()[name]
    if value is None or value == key["default"]:
        return None
    if isinstance(value, list):
        return f"{len(value)} values, {_value(value[0])} to {_value(value[-1])}"
    return _value(value)


def _value(value: object) -> str:
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    return f'`"{value}"`' if isinstance(value, str) else f"`{value:.5g}`"


def _allowed(key: Mapping[str, Any]) -> str:
    """The range without the phrase of an error message."""
    allowed = str(key["allowed"]).removeprefix("must be ")
    for phrase in ("a number between ", "a whole number between "):
        if allowed.startswith(phrase):
            return allowed.removeprefix(phrase).replace(" and ", " to ")
    return allowed


def _of_every_sensor(quantity: str) -> str:
    """A key that each sensor has, in the unit of its signal."""
    keys = {key["key"]: key for key in eft.rig_keys()}
    rows = {sensor: keys[name] for sensor in SENSORS if (name := f"sensors.{sensor}.{quantity}") in keys}
    first = next(iter(rows.values()))
    doc = first["doc"].split(": ", 1)[-1]
    ranges = {_allowed(key) for key in rows.values()}
    each = "; ".join(f"{sensor} {_allowed(key)}" for sensor, key in rows.items())
    allowed = ranges.pop() if len(ranges) == 1 else each
    unit = first["unit"] if len({key["unit"] for key in rows.values()}) == 1 else "unit of the signal"
    key = {**first, "doc": doc, "unit": unit}
    return _entry(f"sensors.SENSOR.{quantity}", key, allowed)
