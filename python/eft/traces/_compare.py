"""Comparison of two tests, signal by signal, such as a measured and a virtual one."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from eft import _native
from eft._display import UnitSystem, shown
from eft._measured_motion import motion_factor
from eft._numbers import real_number
from eft._run import TestRun
from eft.traces._read import read_traces
from eft.traces._traces import Traces
from eft.traces._units import si_unit, to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Source = Traces | TestRun | str | PathLike[str]
"""A test: a run, traces, or a file of either."""

BAND = (0.25, 10.0)
"""Band of the band ratio, Hz: that of the paper's sweeps."""

_MOTION = 30.0
"""Largest factor between a displacement and that by the velocity. One in another unit is above it."""

_ONE_MOTION = 0.95
"""Least correlation of a displacement and that by the velocity. Noise often has 0.8 with a slow motion."""

_SAME = 0.9
"""Least correlation of a signal with that of the same test in other times."""

_AGREED = 0.5
"""Largest difference of a signal in tests that agree, over the signal. A ramp agrees with a part of it."""

_COMPARED = ("command", "force", "displacement", "velocity", "spool", "load_pressure", "valve_command")


@dataclass(frozen=True)
class SignalComparison:
    """The difference of a signal from the same signal of a reference."""

    quantity: str
    unit: str
    """SI unit of the peaks."""
    reference_peak: float
    """Largest absolute value in the reference."""
    peak: float
    """Largest absolute value in the other test."""
    nrmse: float
    """Rms difference over the rms of the reference."""
    peak_error: float
    """Largest difference over the largest value of the reference."""
    delay: float
    """By cross-correlation, s; positive if the other test lags; NaN if undefined."""
    band_ratio: float
    """Rms within the band over that of the reference; NaN if the reference has no energy in the band."""


@dataclass(frozen=True, eq=False)
class Comparison(Mapping[str, SignalComparison]):
    """Two tests compared: a mapping from each signal that both have to its `SignalComparison`."""

    reference: Traces
    """The reference, often a measured test, over the common time."""
    other: Traces
    """The other test on the reference's clock."""
    signals: Mapping[str, SignalComparison]
    shift: float
    """Shift of the other test to an earlier time, s; 0 unless aligned."""
    aligned_by: str | None
    """The signal that gave the shift."""
    band: tuple[float, float]
    """Band of the band ratios, Hz."""

    def __getitem__(self, quantity: str) -> SignalComparison:
        return self.signals[quantity]

    def __iter__(self) -> Iterator[str]:
        return iter(self.signals)

    def __len__(self) -> int:
        return len(self.signals)

    def plot(self, *quantities: str, units: UnitSystem | None = None) -> Figure:
        """Draw both tests and their difference, a pair of panels for each signal.

        Parameters
        ----------
        *quantities : str
            Names of signals. By default all are drawn, without command and valve command if there are others.
        units : {"si", "us"}, optional
            Units of the axes; by default those of `eft.use_units`.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ValueError
            If a signal was not compared.

        Examples
        --------
        >>> import eft
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0)
        >>> run = eft.simulate(eft.Rig.zhao2005(), sweep)
        >>> other = eft.simulate(eft.Rig.zhao2005().replace({"truth.structure.mass": "8 t"}), sweep)
        >>> figure = eft.compare(run, other).plot("force")
        """
        from eft.plots.comparison import comparison

        return comparison(self, *quantities, units=units)

    def table(self, units: UnitSystem | None = None) -> list[tuple[str, ...]]:
        """Return the comparison as rows of text, the first of them a header.

        Parameters
        ----------
        units : {"si", "us"}, optional
            Units of the peaks; by default those of `eft.use_units`.

        Returns
        -------
        list of tuple of str

        Examples
        --------
        >>> import eft
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0)
        >>> run = eft.simulate(eft.Rig.zhao2005(), sweep)
        >>> other = eft.simulate(eft.Rig.zhao2005().replace({"truth.structure.mass": "8 t"}), sweep)
        >>> [row[0] for row in eft.compare(run, other).table()][:3]
        ['signal', 'command (kN)', 'force (kN)']
        """
        header = ("signal", "reference peak", "peak", "rms error", "peak error", "delay, ms", "band ratio")
        return [header, *(_row(one, units) for one in self.signals.values())]

    def _repr_html_(self) -> str:
        head, *rows = self.table()
        cells = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
        body = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
        )
        caption = html.escape(f"{self.other.name} against {self.reference.name}")
        return (
            f"<table><caption>{caption}</caption><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>"
        )


def _row(one: SignalComparison, units: UnitSystem | None) -> tuple[str, ...]:
    unit = shown(one.unit, units)
    texts = (f"{one.nrmse:.2%}", f"{one.peak_error:.2%}", f"{one.delay * 1e3:z.2f}", f"{one.band_ratio:.4f}")
    name = one.quantity.replace("_", " ")
    peaks = (f"{peak * unit.factor:.4g}" for peak in (one.reference_peak, one.peak))
    return (f"{name} ({unit.unit})", *peaks, *("-" if text.startswith("nan") else text for text in texts))


def compare(
    measured: Source,
    run: Source,
    *,
    align: bool = False,
    band: tuple[float, float] = BAND,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    sample_rate: float | None = None,
) -> Comparison:
    """Compare every signal that two tests share, over the time that both cover, at the first one's rate.

    Parameters
    ----------
    measured : Traces, TestRun or path-like
        The reference: a measured test, or another run.
    run : Traces, TestRun or path-like
        The test that is compared with it.
    align : bool
        Whether to shift `run` by the delay between the commands, or between the forces if one of the tests
        has no command.
    band : tuple of float
        Frequencies in Hz between which the band ratio is taken.
    columns, units, sample_rate
        As of `eft.traces.read_traces`, for files. A spool opening in V takes the rig of the other test.

    Returns
    -------
    Comparison
        A mapping by signal; each value has ``nrmse``, ``peak_error``, ``delay`` (s) and ``band_ratio``.

    Raises
    ------
    OSError
        If a file cannot be read.
    ValueError
        If a file is invalid, the times of a test are in another unit, or the tests have no common signal or
        time.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005()
    >>> sweep = eft.sine_sweep(2000.0, 0.0, 5.0, duration=4.0, sample_rate=1024.0)
    >>> one = eft.simulate(rig, sweep)
    >>> other = eft.simulate(rig.replace({"compensation.mode": "linear"}), sweep)
    >>> eft.compare(one, other)["force"].nrmse < 0.1
    True
    """
    low, high = (real_number("band", edge) for edge in band)
    if not 0.0 <= low < high:
        raise ValueError(f"band = ({low:g}, {high:g}) Hz: must begin at or above zero and below its end")
    rigs = [source.rig for source in (run, measured) if isinstance(source, TestRun)]

    def read(source: Source, name: str) -> Traces:
        if isinstance(source, Traces):
            return source
        if isinstance(source, TestRun):
            return Traces.from_run(source, name)
        rig = rigs[0] if rigs else None
        return read_traces(source, columns=columns, units=units, sample_rate=sample_rate, rig=rig)

    reference, other = read(measured, "reference"), read(run, "run")
    shared = [name for name in _COMPARED if name in reference.columns and name in other.columns]
    if not shared:
        raise ValueError(
            f"no signal in common: {reference.name} has {', '.join(reference.columns)}, "
            f"{other.name} has {', '.join(other.columns)}"
        )
    main = next((name for name in shared if name in ("command", "force")), shared[0])
    for test in (reference, other):
        _check_motion(test)
    _check_times(reference, other, main)
    shift, by = 0.0, None
    if align:
        by = main
        shift = _lag(reference, other, by)
        other = replace(other, start=other.start - shift)
    reference, other = _over_common_time(reference, other, shared)
    signals = {name: _compare(name, reference, other, band) for name in shared}
    return Comparison(reference, other, signals, shift, by, band)


def _check_motion(test: Traces) -> None:
    """Refuse a displacement that is far from the integral of the velocity over the times."""
    if not {"velocity", "displacement"} <= test.columns.keys():
        return
    motion = test.time, test.sample_rate, test["velocity"], test["displacement"]
    found = motion_factor(*motion, _ONE_MOTION)
    if found is not None and not 1.0 / _MOTION <= abs(found) <= _MOTION:
        raise ValueError(
            f"{test.name}: displacement = {found:.3g} times that by the velocity: must be "
            f"{1.0 / _MOTION:.2g} to {_MOTION:g} times: check the unit of the times, and of both"
        )


def _check_times(reference: Traces, other: Traces, name: str) -> None:
    """Refuse two tests of which a signal agrees only with the times of one of them in another unit."""
    if _agree(reference, other, name):
        return
    lasts, other_lasts = (len(test) / test.sample_rate for test in (reference, other))
    for unit in ("ms", "us", "min", "h"):
        for factor in (to_si("time", unit), 1.0 / to_si("time", unit)):
            if not 0.5 <= factor * other_lasts / lasts <= 2.0:
                continue
            same = replace(other, sample_rate=other.sample_rate / factor, start=other.start * factor)
            try:
                same = replace(same, start=same.start - _lag(reference, same, name))
                one, two = _variations(reference, same, name)
            except ValueError:
                continue
            if one @ two > _SAME * np.linalg.norm(one) * np.linalg.norm(two):
                raise ValueError(
                    f"{other.name} lasts {other_lasts:.4g} s and {reference.name} {lasts:.4g} s, "
                    f"with the same {name}: check the unit of the times of both, such as {unit} in place of s"
                )


def _agree(reference: Traces, other: Traces, name: str) -> bool:
    """Whether a signal is the same in the given times, as that of a part of a test."""
    try:
        one, two = _variations(reference, other, name)
    except ValueError:
        return False
    return bool(np.linalg.norm(one - two) < _AGREED * np.linalg.norm(one))


def _variations(reference: Traces, other: Traces, name: str) -> tuple[Array, Array]:
    """A signal of both tests over the time that both cover, less its mean."""
    one, two = (part[name] for part in _over_common_time(reference, other, [name]))
    return one - one.mean(), two - two.mean()


def _lag(reference: Traces, other: Traces, name: str) -> float:
    """Delay of a signal in the other test, s."""
    rate = reference.sample_rate
    length = max(reference.time[-1] - reference.start, other.time[-1] - other.start)
    # Twice the longer length, because only lags within half of a record count.
    clock = np.arange(2 * int(np.ceil(length * rate)) + 2) / rate
    one, two = (
        np.interp(clock, traces.time - traces.start, traces.columns[name], right=0.0)
        for traces in (reference, other)
    )
    lag = _native.metrics(one, two, rate)["delay"] if one.any() and two.any() else np.nan
    if np.isnan(lag):
        raise ValueError(
            f"align: the {name} of {other.name} does not correlate with that of {reference.name}"
        )
    # In whole steps, because values between samples are not exact.
    whole = round(lag * rate) / rate + other.start - reference.start
    # A shorter test ends with a jump to zero on the clock, which moves the peak of the correlation.
    parts = _over_common_time(reference, replace(other, start=other.start - whole), [name])
    one, two = (part[name] for part in parts)
    rest = _native.metrics(one, two, rate)["delay"] if one.any() and two.any() else np.nan
    return whole + float(rest) if abs(rest) <= 1.0 / rate else float(lag) + other.start - reference.start


def _over_common_time(reference: Traces, other: Traces, shared: list[str]) -> tuple[Traces, Traces]:
    time, other_time = reference.time, other.time
    # A millionth of a step, because equal clocks may differ by rounding.
    margin = 1e-6 / reference.sample_rate
    inside = (time >= other_time[0] - margin) & (time <= other_time[-1] + margin)
    if np.count_nonzero(inside) < 2:
        raise ValueError(
            f"no time in common: {reference.name} covers {time[0]:g} to {time[-1]:g} s, "
            f"{other.name} {other_time[0]:g} to {other_time[-1]:g} s"
        )
    time = time[inside]
    kept = {name: np.ascontiguousarray(reference.columns[name][inside]) for name in shared}
    moved = {name: np.interp(time, other_time, other.columns[name]) for name in shared}
    rate, start = reference.sample_rate, float(time[0])
    return Traces(reference.name, rate, kept, start), Traces(other.name, rate, moved, start)


def _compare(name: str, reference: Traces, other: Traces, band: tuple[float, float]) -> SignalComparison:
    wanted, values, rate = reference.columns[name], other.columns[name], reference.sample_rate
    peaks = float(np.abs(wanted).max()), float(np.abs(values).max())
    unit = si_unit(name)
    if peaks[0] == 0.0:
        # A reference of zero has no relative difference, except to another zero.
        error = 0.0 if peaks[1] == 0.0 else float("nan")
        return SignalComparison(name, unit, *peaks, error, error, error, float("nan"))
    judged = _native.metrics(wanted, values, rate)
    frequency = np.fft.rfftfreq(wanted.size, 1.0 / rate)
    within = (frequency >= band[0]) & (frequency <= band[1])
    energy = [float((np.abs(np.fft.rfft(signal)[within]) ** 2).sum()) for signal in (wanted, values)]
    ratio = float(np.sqrt(energy[1] / energy[0])) if energy[0] > 0.0 else float("nan")
    return SignalComparison(name, unit, *peaks, judged["nrmse"], judged["peak_error"], judged["delay"], ratio)
