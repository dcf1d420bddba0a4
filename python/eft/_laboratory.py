"""From files of a laboratory to a rig: the identifications of the paper in one call."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from eft._identification import (
    Estimate,
    FineTuning,
    OverlapEstimate,
    fine_tune,
    identify_damping,
    identify_delay,
    identify_flow_curve,
    identify_flow_gain,
    identify_overlap,
)
from eft._native import FlowTable, Rig, check_rig

if TYPE_CHECKING:
    from eft.traces import Traces

__all__ = ["Identification", "identify"]

_TRAVEL = 2.2
"""Largest travel of the piston over the rig's stroke to one side, with a margin for its sensor."""

_FLOWS = 20.0
"""Largest factor between a measured flow and the rig's. Inches differ by 25.4, and times by 60 or 1,000."""


@dataclass(frozen=True)
class Identification:
    """The estimates from the files; `None` for an estimate without a file."""

    rig: Rig
    """The rig with all estimates."""
    response_delay: Estimate | None = None
    """Of the valve, s."""
    flow_curve: FlowTable | None = None
    """Of the valve, with its uncertainty."""
    flow_gain: Estimate | None = None
    """Slope of the flow curve at the origin, `K_v`, m³/s."""
    overlap: OverlapEstimate | None = None
    """Of the spool's lands, with the null bias."""
    damping: Estimate | None = None
    """Damping ratio of the structure; its natural frequency is in the details."""
    tuning: FineTuning | None = None
    """From a test of the whole rig."""

    def plot(self, **options: Any) -> Any:
        """Draw the phase of the valve and the flow curve: `eft.plots.identification`.

        Parameters
        ----------
        **options
            Those of `eft.plots.identification`.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        TypeError
            If there is no such option.

        Examples
        --------
        >>> import eft
        >>> valve = eft.identification.valve_test(eft.Rig.zhao2005())
        >>> columns = {"valve_command": valve.valve_command, "spool": valve.spool}
        >>> test = eft.traces.Traces("valve test", 2048.0, columns)
        >>> figure = eft.identify(eft.Rig.zhao2005(), valve=test).plot()
        """
        from eft import plots

        return plots.identification(self, **options)

    def _repr_html_(self) -> str:
        from eft import _notebook, plots

        estimates = ("response_delay", "overlap", "flow_gain", "damping")
        rows = [(name.replace("_", " "), repr(found)) for name in estimates if (found := getattr(self, name))]
        draw = (lambda figure: plots.identification(self, figure=figure)) if self._drawn else None
        return _notebook.shown("Identification", rows, draw, 2.6 * max(self._drawn, 1))

    @property
    def _drawn(self) -> int:
        """Number of panels of its picture."""
        return (self.response_delay is not None) + (self.flow_curve is not None)


def identify(
    rig: Rig,
    *,
    valve: str | PathLike[str] | Traces | None = None,
    null: Sequence[str | PathLike[str] | Traces] = (),
    flow: Sequence[str | PathLike[str] | Traces] = (),
    release: str | PathLike[str] | Traces | None = None,
    test: str | PathLike[str] | Traces | None = None,
    released_at: float = 0.0,
    band: tuple[float, float] = (0.25, 10.0),
    knots: int = 21,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    sample_rate: float | None = None,
) -> Identification:
    """Identify a rig from measured files.

    Every file may be CSV, MAT, HDF5, Parquet or a saved run, with its units (`eft.traces.read_traces`), or an
    `eft.traces.Traces`. Empty cells and NaN are gaps. Offsets and drifts are removed.

    Parameters
    ----------
    rig : Rig
        The rig before the identification; its piston area, mass and stiffness are used.
    valve : path-like, optional
        ``valve_command`` and ``spool`` of a sweep with the main stage shut off (Fig. 4a): gives
        ``compensation.response_delay``.
    null : sequence of path-like
        ``spool`` and ``displacement`` of an actuator without load, slow strokes of the spool near null, one
        file per run: gives ``servovalve.overlap`` and ``servovalve.null_bias``. The flow curve is then fitted
        to the openings less the overlap.
    flow : sequence of path-like
        ``spool`` and ``displacement`` of an actuator without load, one file per run (Fig. 4b): gives
        ``servovalve.flow_table`` and ``compensation.flow_gain``. The curve contains unequal areas, so
        ``actuator.area_ratio`` becomes 1.
    release : path-like, optional
        ``displacement`` of a free vibration; the part after `released_at` (s) is used. It gives
        ``structure.damping``, and must have the natural frequency of the rig's stiffness and mass.
    test : path-like, optional
        ``command``, ``force`` and ``velocity`` of a test with this rig (Fig. 11), without gaps. It gives
        ``compensation.level`` and a more accurate ``compensation.response_delay`` than `valve`.
    band : tuple of float
        Frequencies in Hz for `valve` and `test`.
    knots : int
        Control points of the flow curve.
    columns, units, sample_rate
        As of `eft.traces.read_traces`, the same for all files.

    Returns
    -------
    Identification
        The rig with all estimates, and each estimate.

    Raises
    ------
    OSError
        If a file cannot be read.
    ValueError
        If a file is not readable as such a test, or its data do not determine an estimate; the message names
        file and reason.

    Examples
    --------
    >>> import eft
    >>> from eft.traces import Traces
    >>> rig = eft.Rig.zhao2005()
    >>> motion = eft.identification.free_vibration(rig, displacement=0.02)
    >>> found = eft.identify(rig, release=Traces("release", 512.0, {"displacement": motion}))
    >>> f"{found.damping:.3f}"
    '0.031'
    """
    from eft.traces import Traces, read_traces

    check_rig(rig)

    def read(source: str | PathLike[str] | Traces) -> Traces:
        if isinstance(source, Traces):
            return source
        return read_traces(source, columns=columns, units=units, sample_rate=sample_rate, gaps=True)

    found: dict[str, Any] = {}
    if valve is not None:
        traces = read(valve)
        with _about(traces):
            found["response_delay"] = identify_delay(
                traces["valve_command"], traces["spool"], traces.sample_rate, band
            )
        rig = rig.replace({"compensation.response_delay": float(found["response_delay"])})
    area = rig["actuator.piston_area"]
    if null:
        runs = [read(source) for source in null]
        with _about(*runs):
            check_travel(rig, runs)
            arrays = [run["spool"] for run in runs], [run["displacement"] for run in runs]
            found["overlap"] = identify_overlap(*arrays, _one_rate(runs), area)
        bias = float(found["overlap"].null_bias)
        rig = rig.replace({"servovalve.overlap": float(found["overlap"]), "servovalve.null_bias": bias})
    if flow:
        runs = [read(source) for source in flow]
        with _about(*runs):
            check_travel(rig, runs)
            rate = _one_rate(runs)
            arrays = [run["spool"] for run in runs], [run["displacement"] for run in runs]
            if "overlap" in found:
                arrays = [found["overlap"].behind(spool) for spool in arrays[0]], arrays[1]
            found["flow_curve"] = identify_flow_curve(*arrays, rate, area, knots)
            check_flow(rig, found["flow_curve"])
            found["flow_gain"] = identify_flow_gain(*arrays, rate, area)
        rig = rig.replace(
            {
                "servovalve.flow_table": found["flow_curve"],
                "actuator.area_ratio": 1.0,
                "compensation.flow_gain": float(found["flow_gain"]),
            }
        )
    if release is not None:
        if rig["structure.kind"] == "shear_building":
            raise ValueError('structure.kind = "shear_building": must have one mass and one damper')
        traces = read(release)
        with _about(traces):
            part = traces.time >= released_at
            found["damping"] = identify_damping(traces["displacement"][part], traces.sample_rate)
            _same_specimen(rig, float(found["damping"].frequency))
        critical = 2.0 * np.sqrt(rig["structure.stiffness"] * rig["structure.mass"])
        rig = rig.replace({"structure.damping": float(found["damping"] * critical)})
    if test is not None:
        traces = read(test)
        with _about(traces):
            signals = (traces["command"], traces["force"], traces["velocity"])
            found["tuning"] = fine_tune(rig, *signals, traces.sample_rate, band)
        rig = found["tuning"].apply(rig)
    return Identification(rig, **found)


def check_travel(rig: Rig, runs: Sequence[Traces]) -> None:
    """Refuse a displacement that the actuator cannot make: the flow would be wrong by the same factor."""
    stroke = float(rig["actuator.stroke"])
    for run in runs:
        moved = run["displacement"]
        ends = moved[np.isfinite(moved)]
        travel = float(ends.max() - ends.min()) if ends.size else 0.0
        if travel > _TRAVEL * stroke:
            raise ValueError(
                f"{run.name}: displacement = {travel:.3g} m from end to end: must be within actuator.stroke, "
                f"±{stroke:.3g} m: check its unit"
            )


def check_flow(rig: Rig, curve: FlowTable) -> None:
    """Refuse a flow curve that only another unit, or another valve, explains."""
    factor = curve.flows[-1] / rig["servovalve.flow_table.flows"][-1]
    if not 1.0 / _FLOWS <= factor <= _FLOWS:
        raise ValueError(
            f"flow = {factor:.3g} times that of servovalve.flow_table at the full opening: must be "
            f"{1.0 / _FLOWS:g} to {_FLOWS:g} times: check the units of times and displacement"
        )


def _same_specimen(rig: Rig, frequency: float) -> None:
    """Refuse a vibration of another specimen: the rig's critical damping turns the ratio into a damping."""
    natural = float(np.sqrt(rig["structure.stiffness"] / rig["structure.mass"]) / (2.0 * np.pi))
    if not 0.8 <= frequency / natural <= 1.25:
        raise ValueError(
            f"displacement = free vibration at {frequency:.3g} Hz: must be 0.8 to 1.25 times the "
            f"{natural:.3g} Hz of structure.stiffness and structure.mass: check both, the times, and "
            "that the actuator lets the specimen move freely"
        )


@contextmanager
def _about(*traces: Traces) -> Iterator[None]:
    """Put the names of the files before the message of an error in their data."""
    names = ", ".join(trace.name for trace in traces)
    try:
        yield
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(traces[0].name) else f"{names}: {text}") from None


def _one_rate(runs: Sequence[Traces]) -> float:
    rates = {round(run.sample_rate, 6) for run in runs}
    if len(rates) > 1:
        shown = ", ".join(f"{rate:g} Hz" for rate in sorted(rates))
        raise ValueError(f"sample rates differ, must be one: {shown}")
    return runs[0].sample_rate
