"""Written by tests/python/test_table.py; EFT_WRITE_STUBS=1 writes it anew."""

from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

_Array: TypeAlias = NDArray[np.float64]

class Trace(NamedTuple):
    unit: str
    doc: str
    otherwise: str

class Metric(NamedTuple):
    unit: str
    doc: str
    costly: bool

class UnrecordedTraceError(AttributeError, ValueError): ...

TRACES: dict[str, Trace]
METRICS: dict[str, Metric]
OPTIONAL: tuple[str, ...]
TraceName: TypeAlias = Literal[
    "command",
    "force",
    "displacement",
    "velocity",
    "spool",
    "load_pressure",
    "valve_command",
    "compensation",
    "supply_pressure",
    "measured_force",
    "measured_displacement",
    "measured_velocity",
    "measured_spool",
    "measured_supply_pressure",
    "acceleration",
    "measured_acceleration",
    "measured_load_pressure",
    "flow_gain_estimate",
    "response_delay_estimate",
    "velocity_delay_estimate",
    "valve_gain_estimate",
    "null_offset_estimate",
    "level",
    "flow_gain_deviation",
    "response_delay_deviation",
    "velocity_delay_deviation",
    "valve_gain_deviation",
    "null_offset_deviation",
    "test_ratio",
]
MetricName: TypeAlias = Literal[
    "nrmse",
    "nrmse_delay_removed",
    "nrmse_bias_free",
    "peak_error",
    "delay",
    "fei_amplitude",
    "fei_delay",
    "fei_frequency",
    "oscillation",
    "tracking_indicator",
    "displacement_error",
    "max_spool",
    "drift",
    "min_supply_pressure",
]

class Channels:
    version: str
    _values: Mapping[str, Any]
    _unrecorded: frozenset[str]
    @property
    def command(self) -> _Array: ...
    @property
    def force(self) -> _Array: ...
    @property
    def displacement(self) -> _Array: ...
    @property
    def velocity(self) -> _Array: ...
    @property
    def spool(self) -> _Array: ...
    @property
    def load_pressure(self) -> _Array: ...
    @property
    def valve_command(self) -> _Array: ...
    @property
    def compensation(self) -> _Array: ...
    @property
    def supply_pressure(self) -> _Array: ...
    @property
    def measured_force(self) -> _Array: ...
    @property
    def measured_displacement(self) -> _Array: ...
    @property
    def measured_velocity(self) -> _Array: ...
    @property
    def measured_spool(self) -> _Array: ...
    @property
    def measured_supply_pressure(self) -> _Array: ...
    @property
    def acceleration(self) -> _Array | None: ...
    @property
    def measured_acceleration(self) -> _Array | None: ...
    @property
    def measured_load_pressure(self) -> _Array | None: ...
    @property
    def flow_gain_estimate(self) -> _Array: ...
    @property
    def response_delay_estimate(self) -> _Array: ...
    @property
    def velocity_delay_estimate(self) -> _Array: ...
    @property
    def valve_gain_estimate(self) -> _Array: ...
    @property
    def null_offset_estimate(self) -> _Array: ...
    @property
    def level(self) -> _Array: ...
    @property
    def flow_gain_deviation(self) -> _Array: ...
    @property
    def response_delay_deviation(self) -> _Array: ...
    @property
    def velocity_delay_deviation(self) -> _Array: ...
    @property
    def valve_gain_deviation(self) -> _Array: ...
    @property
    def null_offset_deviation(self) -> _Array: ...
    @property
    def test_ratio(self) -> _Array: ...

class Metrics(Mapping[MetricName, Any]):
    def __init__(self, values: Mapping[str, Any]) -> None: ...
    def __getitem__(self, name: MetricName) -> Any: ...
    def __iter__(self) -> Iterator[MetricName]: ...
    def __len__(self) -> int: ...
    @property
    def nrmse(self) -> Any: ...
    @property
    def nrmse_delay_removed(self) -> Any: ...
    @property
    def nrmse_bias_free(self) -> Any: ...
    @property
    def peak_error(self) -> Any: ...
    @property
    def delay(self) -> Any: ...
    @property
    def fei_amplitude(self) -> Any: ...
    @property
    def fei_delay(self) -> Any: ...
    @property
    def fei_frequency(self) -> Any: ...
    @property
    def oscillation(self) -> Any: ...
    @property
    def tracking_indicator(self) -> Any: ...
    @property
    def displacement_error(self) -> Any: ...
    @property
    def max_spool(self) -> Any: ...
    @property
    def drift(self) -> Any: ...
    @property
    def min_supply_pressure(self) -> Any: ...
