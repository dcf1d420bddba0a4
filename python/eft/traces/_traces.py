"""Signals of one test from any source."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft._native import units_of
from eft._numbers import real_number
from eft._read_only import ReadOnly, read_only
from eft.traces._clock import FASTEST, SLOWEST, clock
from eft.traces._units import QUANTITIES, checked_quantity, is_unit_of, parse_header, si_unit, to_si

if TYPE_CHECKING:
    from eft import Rig, TestRun

Array = NDArray[np.float64]


class Column(NamedTuple):
    """A column of a file, unchanged."""

    header: str
    unit: str | None
    """Unit, if the file states it outside the header."""
    read: Callable[[], Array]
    """The samples, as a new array."""
    take: Callable[[], None] = lambda: None
    """Charges the file's memory budget for the samples; before any column is read."""


@dataclass(frozen=True, eq=False)
class Traces(ReadOnly):
    """Signals of one test at one sample rate, all in SI units."""

    name: str
    sample_rate: float
    """Samples per second, Hz."""
    columns: Mapping[str, Array]
    """The samples by quantity, such as `force` in N and `displacement` in m."""
    start: float = 0.0
    """Time of the first sample, s."""
    ignored: tuple[str, ...] = field(default=())
    """Columns of the file without a known quantity."""

    def _lock(self) -> None:
        columns = {quantity: read_only(samples) for quantity, samples in self.columns.items()}
        object.__setattr__(self, "columns", columns)

    def __len__(self) -> int:
        return next(iter(self.columns.values())).size

    def __repr__(self) -> str:
        signals = ", ".join(self.columns)
        return (
            f"<eft.traces.Traces of {self.name}: {len(self)} samples at {self.sample_rate:g} Hz, {signals}>"
        )

    def __getitem__(self, quantity: str) -> Array:
        """Return a quantity's samples; the ValueError for a missing one names the existing ones."""
        if quantity not in self.columns:
            raise ValueError(f"{self.name}: no signal {quantity}; the signals are {', '.join(self.columns)}")
        return self.columns[quantity]

    def __contains__(self, quantity: object) -> bool:
        return isinstance(quantity, str) and quantity in self.columns

    # The length counts samples, so an iteration would have to give them and not the names.
    __iter__ = None

    @property
    def time(self) -> Array:
        """Time of each sample, s."""
        return self.start + np.arange(len(self)) / self.sample_rate

    @classmethod
    def from_run(cls, run: TestRun, name: str = "run") -> Traces:
        """The traces of a run on the virtual rig.

        Parameters
        ----------
        run : TestRun
            A run of one actuator.
        name : str
            Name of the test in comparisons and messages.

        Returns
        -------
        Traces

        Raises
        ------
        ValueError
            If the run has several actuators.

        Examples
        --------
        >>> import eft
        >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 5.0, 2.0, 1024.0))
        >>> len(eft.traces.Traces.from_run(run)["force"])
        2048
        """
        if run.command.ndim != 1:
            raise ValueError(
                f"{name}: a run of {run.command.shape[0]} actuators; must be of one, as `run.actuator(0)` is"
            )
        traces = {key: getattr(run, key, None) for key in QUANTITIES if key != "time"}
        columns = {key: trace for key, trace in traces.items() if trace is not None}
        return cls(name, run.sample_rate, columns)

    @classmethod
    def from_columns(
        cls,
        name: str,
        raw: Iterable[Column],
        *,
        columns: Mapping[str, str],
        units: Mapping[str, str],
        sample_rate: float | None = None,
        gaps: bool = False,
        rig: Rig | None = None,
    ) -> Traces:
        """Convert columns of a file to SI units and a common clock; only known quantities are read.

        Parameters
        ----------
        name : str
            Name of the test in comparisons and messages.
        raw : iterable of Column
            Header, unit and samples of each column; `read_traces` makes them from a file.
        columns : mapping of str to str
            Header by quantity, for columns whose header does not name their quantity.
        units : mapping of str to str
            Unit by quantity, for columns whose header has none.
        sample_rate : float, optional
            In Hz, for data without a column of time.
        gaps : bool
            Whether samples may be NaN, except in the time.
        rig : Rig, optional
            The rig whose sensor converts a spool opening in V.

        Returns
        -------
        Traces

        Raises
        ------
        ValueError
            If a unit or the clock is missing, or a sample is not finite; the message names the column.

        Examples
        --------
        >>> import numpy
        >>> from eft.traces import Traces
        >>> from eft.traces._traces import Column
        >>> force = Column("force (kN)", None, lambda: numpy.array([0.0, 1.0]))
        >>> Traces.from_columns("mine", [force], columns={}, units={}, sample_rate=100.0)["force"].tolist()
        [0.0, 1000.0]
        """
        raw = list(raw)
        sample_rate = None if sample_rate is None else real_number("sample_rate", sample_rate)
        chosen = {header: checked_quantity(quantity) for quantity, header in columns.items()}
        headers = [column.header for column in raw]
        for header in chosen:
            if header not in headers:
                raise ValueError(f"{name}: no column `{header}`; there are {', '.join(headers)}")
        given = {checked_quantity(quantity): unit for quantity, unit in units.items()}
        wanted: dict[str, tuple[Column, float]] = {}
        ignored = []
        for column in raw:
            quantity, written, _ = parse_header(column.header)
            quantity = chosen.get(column.header, None if quantity in chosen.values() else quantity)
            if quantity is None:
                ignored.append(column.header)
                continue
            if quantity in wanted:
                raise ValueError(
                    f"{name}: two columns have {quantity}; name one of them with {quantity}=HEADER"
                )
            unit = given.get(quantity, column.unit or written)
            wanted[quantity] = column, _factor(name, column.header, quantity, unit, rig)
            column.take()
        found: dict[str, Array] = {}
        for quantity, (column, factor) in wanted.items():
            found[quantity] = column.read()
            with np.errstate(over="ignore", invalid="ignore"):  # infinite values are refused
                found[quantity] *= factor
            # A standard deviation is infinite if nothing was learned.
            if (not gaps and not quantity.endswith("_deviation")) or quantity == "time":
                _all_finite(name, column.header, found[quantity])
        if sample_rate is None:
            if "time" not in found:
                raise ValueError(f"{name}: no column `time (s)` among {', '.join(headers)}, no sample rate")
            start, sample_rate = clock(name, found["time"])
        elif not SLOWEST <= sample_rate <= FASTEST:
            allowed = f"must lie within {SLOWEST:g} and {FASTEST:g} Hz"
            raise ValueError(f"sample_rate = {sample_rate:g}: {allowed}")
        else:
            start = 0.0
        found.pop("time", None)
        if not found:
            known = ", ".join(list(QUANTITIES)[1:7])
            raise ValueError(f"{name}: no known column among {', '.join(headers)}; known are {known}, ...")
        return cls(name, sample_rate, found, start, tuple(ignored))


def _factor(name: str, header: str, quantity: str, unit: str | None, rig: Rig | None) -> float:
    if unit is None or not unit.strip():
        si = si_unit(quantity)
        if si == "1":
            return 1.0
        raise ValueError(
            f'{name}: column `{header}` names no unit: give units={{"{quantity}": "{si}"}} '
            f"(`--unit {quantity}={si}`), or write it after the name, as in `force (kN)`; "
            f"allowed are {units_of(si)}"
        )
    if quantity == "spool" and is_unit_of("valve_command", unit):
        if rig is None:
            raise ValueError(
                f"{name}: column `{header}` is in {unit.strip()}: give the rig (`--rig FILE`), whose "
                "servovalve.spool_sensitivity and servovalve.spool_stroke make an opening of it"
            )
        full = rig["servovalve.spool_sensitivity"] * rig["servovalve.spool_stroke"]
        return to_si("valve_command", unit) / float(full)
    try:
        return to_si(quantity, unit)
    except ValueError as error:
        raise ValueError(f"{name}: column `{header}`: {error}") from None


def _all_finite(name: str, header: str, values: Array) -> None:
    # Checked without another array of the column's size.
    if values.size and not (np.isfinite(values.min()) and np.isfinite(values.max())):
        bad = int(np.isfinite(values).argmin())
        raise ValueError(f"{name}: column `{header}`, sample {bad + 1} is not a finite number")
