"""Results that are also mappings of their fields: what a test learned, and the keys of a rig."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, TypeVar

from eft import _native

__all__ = ["Calibration", "CalibrationDeviations", "CurveCorrection", "RigKey", "rig_keys"]


Name = TypeVar("Name", bound=str)


class Section(Mapping[Name, Any]):
    """A frozen dataclass that is also a mapping of its fields, equal to a dictionary with their values."""

    def __getitem__(self, name: Name) -> Any:
        if name not in self.__iter__():
            raise KeyError(name)
        return getattr(self, name)

    def __iter__(self) -> Iterator[Name]:
        return (field.name for field in fields(self))  # type: ignore[arg-type, misc]

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mapping) and plain(self) == plain(other)

    def __or__(self, other: Mapping[str, Any]) -> dict[str, Any]:
        return {str(name): value for name, value in self.items()} | dict(other)

    def _repr_html_(self) -> str:
        from eft import _notebook

        return _notebook.shown(type(self).__name__, _notebook.fields_rows(self))


def plain(value: Any) -> Any:
    """Sections as dictionaries, and tuples as lists, as in JSON."""
    if isinstance(value, Mapping):
        return {name: plain(part) for name, part in value.items()}
    return [plain(part) for part in value] if isinstance(value, (tuple, list)) else value


DeviationName = Literal["flow_gain", "valve_gain", "response_delay", "velocity_delay", "null_offset"]
CurveName = Literal[
    "asymmetry", "asymmetry_deviation", "departures", "departure_deviations", "error", "flow_gain_share"
]
CalibrationName = Literal[DeviationName, "version", "greatest_flow", "deviations", "excitation", "curve"]
RigKeyName = Literal["key", "unit", "type", "allowed", "doc", "required", "required_where", "default"]


@dataclass(frozen=True, eq=False, kw_only=True)
class CalibrationDeviations(Section[DeviationName]):
    """The standard deviations of a calibration."""

    flow_gain: float
    """Of the flow gain."""
    valve_gain: float
    """Of the valve gain."""
    response_delay: float
    """Of the spool's delay, s."""
    velocity_delay: float
    """Of the velocity's delay, s."""
    null_offset: float
    """Of the null offset."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CurveCorrection(Section[CurveName]):
    """The correction of the flow curve in a calibration."""

    asymmetry: float
    """Table flow per flow of the forward direction over the mean of both directions, less 1."""
    asymmetry_deviation: float
    """Its standard deviation."""
    departures: tuple[float, ...]
    """Departures of the curve from its directions, at 17 flows from -8/7 to 8/7 of the greatest one, m³/s."""
    departure_deviations: tuple[float, ...]
    """Their standard deviations, m³/s."""
    error: float
    """Rms of the flow of a window that the correction leaves unexplained, m³/s."""
    flow_gain_share: float
    """Share of the flow gain that follows from the departures.

    The table alone has the flow gain over 1 plus this share.
    """


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibration(Section[CalibrationName]):
    """What an adaptive controller learned in a test; as a mapping, the section ``calibration`` of a rig."""

    version: int
    """Version of its form."""
    greatest_flow: float
    """Greatest flow of the flow table, or the flow gain of the linear scheme, to which it refers, m³/s."""
    flow_gain: float
    """True flow over the table's."""
    valve_gain: float
    """Gain of the spool over ``compensation.valve_gain``."""
    response_delay: float
    """Delay of the spool by its sensor, s."""
    velocity_delay: float
    """Delay of the velocity after the spool by their sensors, s."""
    null_offset: float
    """Commanded opening at which the valve passes nothing at no load."""
    deviations: CalibrationDeviations
    """Standard deviations of these five."""
    excitation: float
    """Motion from which these were estimated, the integral of the squared opening, s."""
    curve: CurveCorrection
    """Correction of the flow curve."""


def calibration_of(section: Mapping[str, Any] | None) -> Calibration | None:
    """The calibration from a section of a rig; an exception if it is none."""
    if section is None:
        return None
    values = dict(section)
    deviations = CalibrationDeviations(**_numbers(values.pop("deviations")))
    # Version 2 has no share.
    curve = CurveCorrection(**{"flow_gain_share": 0.0} | _numbers(values.pop("curve")))
    version = int(values.pop("version"))
    return Calibration(version=version, deviations=deviations, curve=curve, **_numbers(values))


def _numbers(values: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: tuple(map(float, value)) if isinstance(value, (list, tuple)) else float(value)
        for name, value in values.items()
    }


@dataclass(frozen=True, eq=False, kw_only=True)
class RigKey(Section[RigKeyName]):
    """A key of the configuration."""

    key: str
    """The dotted key, as in `Rig.replace`."""
    unit: str
    """SI unit; empty for a value without one."""
    type: Literal["float", "int", "bool", "str", "list"]
    """Type of the value."""
    allowed: str
    """What the value must be."""
    doc: str
    """Meaning."""
    required: bool
    """Whether every rig needs it."""
    required_where: str | None
    """Condition under which a rig needs it, such as ``structure.kind = "bilinear"``."""
    default: float | int | bool | str | None
    """Value if it is absent."""


def rig_keys() -> list[RigKey]:
    """Return the schema of the configuration, one entry per key, in the order of files.

    The keys of the plant are listed a second time, under ``truth``.

    Returns
    -------
    list of RigKey

    Examples
    --------
    >>> import eft
    >>> next(row.unit for row in eft.rig_keys() if row.key == "structure.mass")
    'kg'
    """
    return [RigKey(**row) for row in _native.rig_keys()]
