"""Signals of one test, wherever they come from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft.traces._units import QUANTITIES, allowed_units, checked_quantity, parse_header, to_si

if TYPE_CHECKING:
    from eft import Rig, TestRun

Array = NDArray[np.float64]

_UNEVEN = 0.01
"""How far a time step may be from the mean one, as a fraction of it: clocks are written with few digits."""

_JITTER = 0.05
"""How far a sample of a rounded clock may be from its time besides the rounding, as a fraction of a step."""

_SLOWEST, _FASTEST = 1e-6, 1e9
"""Sample rates that a measurement can have, Hz."""

_OUTLIERS = 0.1
"""Share of steps that may be odd before they are taken for the rounding of the clock."""


class Column(NamedTuple):
    """A column of a file, unchanged."""

    header: str
    unit: str | None
    """Where the file says it apart from the header."""
    read: Callable[[], Array]
    """Its samples, as an array of the caller's own."""


@dataclass(frozen=True, eq=False)
class Traces:
    """Signals of one test at one sample rate, all in SI units."""

    name: str
    sample_rate: float
    """Samples per second, Hz."""
    columns: Mapping[str, Array]
    """The samples by quantity, such as `force` in N and `displacement` in m."""
    start: float = 0.0
    """Time of the first sample, s."""
    ignored: tuple[str, ...] = field(default=())
    """Columns of the file that hold no quantity known here."""

    def __len__(self) -> int:
        return next(iter(self.columns.values())).size

    def __getitem__(self, quantity: str) -> Array:
        """Return a quantity's samples; a ValueError names those there are."""
        if quantity not in self.columns:
            raise ValueError(f"{self.name}: no {quantity} in it; there are {', '.join(self.columns)}")
        return self.columns[quantity]

    @property
    def time(self) -> Array:
        """Time of each sample, s."""
        return self.start + np.arange(len(self)) / self.sample_rate

    @classmethod
    def from_run(cls, run: TestRun, name: str = "run") -> Traces:
        """The traces of a run on the virtual rig."""
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
        """Bring columns as they stand in a file to SI and to one clock; only known quantities are read.

        `columns` says which header holds a quantity, `units` the unit of a quantity whose header has none;
        with `gaps` samples other than the time's may be NaN; a spool opening in V takes the sensor of `rig`.
        """
        raw = list(raw)
        chosen = {header: checked_quantity(quantity) for quantity, header in columns.items()}
        headers = [header for header, _, _ in raw]
        for header in chosen:
            if header not in headers:
                raise ValueError(f"{name}: no column `{header}`; there are {', '.join(headers)}")
        given = {checked_quantity(quantity): unit for quantity, unit in units.items()}
        found: dict[str, Array] = {}
        ignored = []
        for header, unit, read in raw:
            quantity, written, _ = parse_header(header)
            quantity = chosen.get(header, None if quantity in chosen.values() else quantity)
            if quantity is None:
                ignored.append(header)
                continue
            if quantity in found:
                raise ValueError(f"{name}: two columns hold {quantity}; say which with {quantity}=HEADER")
            factor = _factor(name, header, quantity, given.get(quantity, unit or written), rig)
            found[quantity] = read()
            with np.errstate(over="ignore", invalid="ignore"):  # what is infinite is refused
                found[quantity] *= factor
            # A standard deviation is infinite where nothing was learned.
            if (not gaps and not quantity.endswith("_deviation")) or quantity == "time":
                _all_finite(name, header, found[quantity])
        if sample_rate is None:
            if "time" not in found:
                raise ValueError(f"{name}: no column `time (s)` among {', '.join(headers)}, no sample rate")
            start, sample_rate = _clock(name, found["time"])
        elif not _SLOWEST <= sample_rate <= _FASTEST:
            allowed = f"must lie within {_SLOWEST:g} and {_FASTEST:g} Hz"
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
        if QUANTITIES[quantity].dimension == "ratio":
            return 1.0
        allowed = allowed_units(quantity)
        raise ValueError(
            f'{name}: column `{header}` names no unit: give units={{"{quantity}": "{allowed[0]}"}} '
            f"(`--unit {quantity}={allowed[0]}`), or write it behind the name, as in `force (kN)`; "
            f"allowed are {', '.join(allowed)}"
        )
    if quantity == "spool" and unit.strip() in ("V", "mV"):
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
    # Without an array as large as the column.
    if values.size and not (np.isfinite(values.min()) and np.isfinite(values.max())):
        bad = int(np.isfinite(values).argmin())
        raise ValueError(f"{name}: column `{header}`, sample {bad + 1} is not a finite number")


@np.errstate(over="ignore", invalid="ignore")
def _clock(name: str, time: Array) -> tuple[float, float]:
    """First time and sample rate of an evenly spaced clock."""
    if time.size < 2:
        raise ValueError(f"{name}: {time.size} sample, must be at least 2")
    step = (time[-1] - time[0]) / (time.size - 1)
    if step <= 0.0:
        raise ValueError(f"{name}: time must increase, and goes from {time[0]:g} s to {time[-1]:g} s")
    if not _SLOWEST <= 1.0 / step <= _FASTEST:
        raise ValueError(
            f"{name}: a step of {step:g} s: must lie within {1 / _FASTEST:g} and {1 / _SLOWEST:g} s"
        )
    steps = np.diff(time)
    off = np.abs(steps - np.median(steps))
    allowed = _UNEVEN * step
    if np.mean(off > allowed) > _OUTLIERS:
        # No single jump, so that it may be the rounding of a clock written with few digits.
        if (rate := _rounded_clock(time, steps)) is not None:
            return float(time[0]), rate
        off = np.abs(steps - step)
    if off.max() > allowed:
        where = int(off.argmax())
        raise ValueError(
            f"{name}: time is not evenly spaced: sample {where + 2} comes {steps[where]:.6g} s after the one "
            f"before, the mean step is {step:.6g} s; mend it or give the sample rate"
        )
    return float(time[0]), float(1.0 / step)


def _rounded_clock(time: Array, steps: Array) -> float | None:
    """The rate of a clock that is even within the rounding of its digits; None where it is not."""
    digit = _last_digit(time)
    if digit is None or steps.min() < 0.0:
        return None
    count = np.arange(time.size)
    rate = 1.0 / np.polyfit(count, time, 1)[0]
    # The rate that was meant, where the rounding leaves it open.
    for candidate in (float(round(rate)), float(rate)):
        if candidate > 0.0:
            off = time - count / candidate
            off -= np.median(off)
            if (np.abs(off) <= 0.6 * digit + _JITTER / candidate).all():
                return candidate
    return None


def _last_digit(time: Array) -> Array | None:
    """One unit of the last digit of each written time, s; None where all digits are written."""
    fixed = (10.0**-places for places in range(10) if np.array_equal(np.round(time, places), time))
    least = next(fixed, 0.0)
    with np.errstate(divide="ignore"):
        size = np.floor(np.log10(np.abs(time)))
    size[~np.isfinite(size)] = -9.0
    for digits in range(4, 11):
        unit = 10.0 ** (size - digits + 1)
        if np.allclose(np.round(time / unit) * unit, time, rtol=1e-13, atol=0.0):
            return np.maximum(unit, least)
    return np.full(time.shape, least) if least else None
