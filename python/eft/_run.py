"""The result of a test on the virtual rig."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from eft import _native, _run_file, _run_frames, _run_metrics, _run_parts, _run_spectra
from eft._corrected_rig import corrected_rig
from eft._display import current_units
from eft._energy import EnergyBalance
from eft._native import Command, Rig, __version__
from eft._read_only import ReadOnly, read_only
from eft._run_spectra import Coherence, FftRatio
from eft._samples import Samples
from eft._sections import Calibration, calibration_of
from eft._status import CAUSE_BITS, Cause, Status, cause_of, status_of
from eft._table import TRACES, Channels, Metrics
from eft._verdict import Verdict, judge

__all__ = ["Coherence", "FftRatio", "Metrics", "TestRun"]

Array = NDArray[np.float64]
Dtype = Literal["f32", "f64"]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class TestRun(Channels, ReadOnly):
    """The traces of one test, one value per command sample; for several actuators (actuators, samples).

    Value `i` is the plant's true value at time ``i / sample_rate``, before that tick's output acts. The
    traces ``measured_...`` are the readings of the sensors. ``time, force = run`` unpacks time and force. The
    arrays are read-only; change a copy. ``"acceleration" in run`` says whether the run has a trace. A trace
    that a file lacks because an older version wrote it raises `AttributeError`.
    """

    __test__ = False  # pytest would collect classes with this name

    rig: Rig
    """The rig that was tested."""
    sample_rate: float
    """Ticks per second, Hz."""
    dtype: Dtype
    """Precision of the controller."""
    version: str
    """Version of the library that ran the test."""
    _values: Mapping[str, Array] = field(default_factory=dict)
    status: NDArray[np.uint32]
    """Bits of `Status`."""
    found_flows: Array | None = None
    """Flow that the controller found at each opening of its table, m³/s. With the fixed scheme it is the
    table. It is None if a processor in the loop has learned, because its flows stay in the firmware."""
    date: str = ""
    """Date of the run by ISO 8601; empty if an older file has none."""
    record: str = ""
    """Name of the ground motion; empty for other commands."""
    scale: float | None = None
    """Factor on the ground motion's acceleration."""
    mass: float | Array | None = None
    """Mass by which the ground motion became a force, kg."""
    stopped: str = ""
    """Reason why an external structure ended the test; empty if it did not."""
    interrupted: bool = False
    """Whether Ctrl-C ended `eft run`; these are the samples before."""
    _calibrations: tuple[Calibration | None, ...] = (None,)
    _outside: bool = False
    """Whether an external structure replaced the rig's."""
    _controlled: bool = False
    """Whether an external controller replaced the rig's."""
    _energy: EnergyBalance | None = None
    _whole: bool = True
    _unrecorded: frozenset[str] = frozenset()
    """Traces that the version of a file did not record."""
    _floor: int | None = None
    """Number of this actuator in a building, from 0 at the ground; None for a run of all actuators."""
    _building: tuple[TestRun, int] | None = None
    """The run of all actuators of a building, and the place of this actuator in it."""

    def _lock(self) -> None:
        super()._lock()
        if not isinstance(self._values, Samples):
            # Not views, because traces with equal values are one array.
            for trace in self._values.values():
                trace.setflags(write=False)

    @classmethod
    def _of(
        cls, rig: Rig, command: Command, dtype: Dtype, outcome: Mapping[str, Any], outside: bool = False
    ) -> TestRun:
        """Make a run from the outcome that Rust returns."""
        energy = outcome["energy"]
        return cls(
            rig=rig,
            sample_rate=command.sample_rate,
            dtype=dtype,
            version=__version__,
            _values=Samples(outcome),
            status=outcome["status"],
            found_flows=outcome["found_flows"],
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            record=command.record.name if command.record else "",
            scale=command.scale,
            mass=command.mass,
            stopped=outcome.get("stopped", ""),
            _calibrations=tuple(map(calibration_of, outcome["calibrations"])),
            _outside=outside,
            _energy=EnergyBalance(**energy) if energy else None,
        )

    @cached_property
    def time(self) -> Array:
        """Time of each sample in s, from zero."""
        return read_only(np.arange(self.command.shape[-1]) / self.sample_rate)

    @property
    def seed(self) -> int:
        """Seed of the sensors' noise."""
        return cast(int, self.rig.plant["sensors.seed"])

    @property
    def success(self) -> bool:
        """Whether the test ran to its end with finite values."""
        return not self.flags & Status.DIVERGED

    @cached_property
    def flags(self) -> Status:
        """Every flag that was raised at any time."""
        return Status(int(np.bitwise_or.reduce(self.status, axis=None)) & ~CAUSE_BITS)

    @property
    def cause(self) -> Cause:
        """What tripped the protection first; with several actuators, the cause of the first trip."""
        causes = (self.status & np.uint32(CAUSE_BITS)).reshape(-1, self.status.shape[-1])
        tripped = causes.any(axis=0)
        if not tripped.any():
            return Cause.NONE
        return max(cause_of(int(status)) for status in causes[:, int(tripped.argmax())])

    @property
    def verdict(self) -> Verdict:
        """The verdict, with reasons and remedies, by the limits of the rig's ``verdict`` section."""
        # Not cached, because its sentences use the present units.
        kept: dict[str, Verdict] = self.__dict__.setdefault("_verdicts", {})
        units = current_units()
        if units not in kept:
            kept[units] = judge(self)
        return kept[units]

    @property
    def message(self) -> str:
        """A summary of the test in words.

        It begins with the status of the test, as in a study, or with "interrupted". Every flag that was
        raised follows, with the time of its first sample and its share of the samples.
        """
        word, early = status_of(self.flags)
        if self.interrupted and early is None:
            word, early = "interrupted", "by Ctrl-C"
        end = self.time[-1] if not self.success else self.to_its_end().duration
        parts = [word if early is None else f"{word} after {end:.6g} s"]
        if self.cause is not Cause.NONE:
            parts.append(f"cause: {self.stopped or self.cause.name.lower()}")
        for flag in self.flags & ~Status.DIVERGED:
            raised = (self.status & flag) != 0
            ticks = raised.reshape(-1, raised.shape[-1]).any(axis=0)
            name = (flag.name or str(int(flag))).lower()
            parts.append(
                f"{name} from {self.time[ticks.argmax()]:.6g} s, in {ticks.mean():.2%} of the samples"
            )
        return "; ".join(parts)

    @property
    def duration(self) -> float:
        """Length of the test, s."""
        return len(self) / self.sample_rate

    def corrected_rig(self) -> Rig:
        """Return the rig with the flow curve that the controller found as its flow table.

        The plant is unchanged: the curve of its valve is kept as ``servovalve.true_flow_table``.

        Returns
        -------
        Rig

        Raises
        ------
        ValueError
            If the run has several actuators with a curve each; use the run of one `actuator`. If
            self-calibration or the guard ran with the linear scheme, which has no table. If a processor in
            the loop has learned. If the flows do not increase, which single precision can cause.

        Examples
        --------
        >>> import eft
        >>> rig = eft.Rig.zhao2005().replace({"compensation.adaptive": True})
        >>> run = eft.simulate(rig, eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
        >>> run.corrected_rig()["servovalve.flow_table.flows"] == run.found_flows.tolist()
        True
        """
        return corrected_rig(self)

    @property
    def calibration(self) -> Calibration | None:
        """What the adaptive controller learned.

        It contains the estimates, their standard deviations and the correction of the flow curve. Give it to
        `eft.simulate` or to ``rig.replace({"calibration": run.calibration})`` to start the next test from it.
        It is None if nothing was learned. A run of several actuators raises `ValueError`, because it has
        `calibrations`.
        """
        if len(self._calibrations) != 1:
            actuators = len(self._calibrations)
            raise ValueError(f"a run of {actuators} actuators has one calibration for each: run.calibrations")
        return self._calibrations[0]

    @property
    def calibrations(self) -> tuple[Calibration | None, ...]:
        """What the controller of each actuator learned, that of the ground floor first.

        It is given to the next test as `calibration` is. A controller that learned nothing has None.
        """
        return self._calibrations

    @property
    def energy(self) -> EnergyBalance | None:
        """The energy balance of the whole test, J.

        Rigs with effects beyond the paper's model, and buildings, compute the balance during the test. For
        any other rig it is computed from the traces of the run, from the first to the last sample. It is None
        if it is unknown: for a part of a test, whose beginning or other actuators are missing; for an
        external structure, whose energy only that knows; if the test diverged so far that a power is not
        finite.
        """
        if self._outside or not self._whole:
            return None
        if self._energy is None and self.command.ndim == 1:
            traces = (self.displacement, self.velocity, self.spool, self.load_pressure)
            energy = _native.energy_of_traces(self.rig, self.sample_rate, *traces)
            object.__setattr__(self, "_energy", None if energy is None else EnergyBalance(**energy))
        return self._energy

    @property
    def _traces(self) -> tuple[str, ...]:
        """The traces of this run by name."""
        return (*(name for name in TRACES if name in self._values), "status")

    to_its_end = _run_parts.to_its_end
    actuator = _run_parts.actuator
    metrics = _run_metrics.metrics
    fft_ratio = _run_spectra.fft_ratio
    coherence = _run_spectra.coherence
    to_pandas = _run_frames.to_pandas
    to_xarray = _run_frames.to_xarray
    to_control = _run_frames.to_control
    save = _run_file.save

    @classmethod
    def load(cls, path: str | PathLike[str]) -> TestRun:
        """Read a test from a file of `save`.

        Parameters
        ----------
        path : path-like
            The file.

        Returns
        -------
        TestRun

        Raises
        ------
        FileNotFoundError
            If there is no such file.
        ValueError
            If the file is not a saved test, is damaged, or has a later format; the message names the problem.

        Examples
        --------
        >>> import eft
        >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
        >>> bool((eft.TestRun.load(run.save("run.eft")).force == run.force).all())
        True
        """
        return cls(**_run_file.read(Path(path)))

    def __contains__(self, name: object) -> bool:
        return name in self._traces

    def __iter__(self) -> Iterator[Array]:
        return iter((self.time, self.force))

    def __len__(self) -> int:
        return int(self.command.shape[-1])

    def plot(self, **options: Any) -> Any:
        """Draw force, its error, displacement, spool and frequency response: `eft.plots.run_page`.

        Parameters
        ----------
        **options
            Those of `eft.plots.run_page`.

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
        >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
        >>> figure = run.plot()
        """
        from eft import plots

        return plots.run_page(self, **options)

    def _repr_html_(self) -> str:
        from eft import _notebook, plots

        name = self.rig["name"] or "Test"
        rows = _notebook.verdict_rows(self.verdict)
        return _notebook.shown(name, rows, lambda figure: plots.run_page(self, figure=figure), 8.0)

    def __repr__(self) -> str:
        name = self.rig["name"] or "rig without a name"
        return f"<eft.TestRun of {name}: {len(self)} samples at {self.sample_rate:g} Hz, {self.message}>"
