"""Results that are also mappings of their fields: what a test learned, and the keys of a rig."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, TypeVar

from eft import _native

__all__ = [
    "Calibration",
    "CalibrationDistances",
    "CalibrationEvidence",
    "CurveCorrection",
    "RigKey",
    "rig_keys",
]


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


EstimateName = Literal["flow_gain", "valve_gain", "response_delay", "velocity_delay", "null_offset"]
EvidenceName = Literal[
    "time",
    "mean_weight",
    "mean_square_frequency",
    "growth",
    "flow",
    "flow_rate",
    "rate_flow",
    "rate_flow_rate",
    "compressed_flow",
    "flow_error",
    "spool_error",
    "distances",
]
CurveName = Literal[
    "asymmetry",
    "asymmetry_deviation",
    "departures",
    "departure_deviations",
    "error",
    "flow_gain_share",
    "mean_departure",
    "time",
    "sensor_offset",
    "null_time",
    "null_coupling",
]
CalibrationName = Literal[EstimateName, "version", "greatest_flow", "excitation", "evidence", "curve"]
RigKeyName = Literal["key", "unit", "type", "allowed", "doc", "required", "required_where", "default"]


@dataclass(frozen=True, eq=False, kw_only=True)
class CalibrationDistances(Section[EstimateName]):
    """Results of the least squares minus the estimates, which follow at limited rates and within bounds."""

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
class CalibrationEvidence(Section[EvidenceName]):
    """What the estimates of a calibration were learned from, as means weighted by the squared opening."""

    time: float
    """Remembered time of motion, s."""
    mean_weight: float
    """Mean weight of the remembered motion; 1 if nothing was forgotten."""
    mean_square_frequency: float
    """Mean-square frequency of the motion, 1/s². It is the mean of the opening's squared rate."""
    growth: float
    """Mean of opening times its rate, 1/s. It is the rate at which the motion grew."""
    flow: float
    """Mean of opening times flow, m³/s."""
    flow_rate: float
    """Mean of opening times the flow's rate, m³/s²."""
    rate_flow: float
    """Mean of the opening's rate times flow, m³/s²."""
    rate_flow_rate: float
    """Mean of the opening's rate times the flow's rate, m³/s³."""
    compressed_flow: float
    """Rms of the flow that leaks and compresses the oil, over that of the opening, m³/s."""
    flow_error: float
    """Rms of the flow that the estimates leave unexplained, m³/s."""
    spool_error: float
    """Rms of the opening that the estimates leave unexplained."""
    distances: CalibrationDistances
    """Results of the least squares minus the estimates in use."""


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
    mean_departure: float
    """Mean departure over the flow, which the flow gain slowly takes over."""
    time: float
    """Remembered time of residual and sensor offset, s."""
    sensor_offset: float
    """Reading of the spool's sensor minus the commanded opening times the spool's gain."""
    null_time: float
    """Remembered time of the null offset, at the table's slope at null, s."""
    null_coupling: float
    """Share of this time in which an error of a direction's gain looks like a null offset."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibration(Section[CalibrationName]):
    """What an adaptive controller learned in a test; as a mapping, the section ``calibration`` of a rig.

    Standard deviations depend on the configuration as well, so they are traces of a run, such as
    ``run.flow_gain_deviation``.
    """

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
    excitation: float
    """Motion from which these were estimated, the integral of the squared opening, s."""
    evidence: CalibrationEvidence
    """What else they were estimated from."""
    curve: CurveCorrection
    """Correction of the flow curve."""


_EVIDENCE_VERSION = 4
"""First version of a calibration that contains its evidence."""


def calibration_of(section: Mapping[str, Any] | None) -> Calibration | None:
    """The calibration from a section of a rig; an exception if it is none.

    Of the earlier versions, from which no controller starts, the evidence is empty.
    """
    if section is None:
        return None
    values = dict(section)
    version = int(values.pop("version"))
    evidence, curve = dict(values.pop("evidence", {})), dict(values.pop("curve"))
    if version < _EVIDENCE_VERSION:
        values.pop("deviations")
        evidence = _empty(CalibrationEvidence) | {"distances": _empty(CalibrationDistances)}
        curve = _empty(CurveCorrection) | curve
    distances = CalibrationDistances(**_numbers(evidence.pop("distances")))
    return Calibration(
        version=version,
        evidence=CalibrationEvidence(**_numbers(evidence), distances=distances),
        curve=CurveCorrection(**_numbers(curve)),
        **_numbers(values),
    )


def _empty(section: type) -> dict[str, Any]:
    return {field.name: 0.0 for field in fields(section)}


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
