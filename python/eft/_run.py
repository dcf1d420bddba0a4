"""A test on the virtual rig and what it leaves behind."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property, reduce
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from eft import _native
from eft._files import beside
from eft._native import Command, Rig, __version__
from eft._status import Status

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "Coherence",
    "EnergyBalance",
    "FftRatio",
    "IdealResponse",
    "TestRun",
    "energy_balance",
    "ideal_response",
    "simulate",
]

Array = NDArray[np.float64]
Dtype = Literal["f32", "f64"]
Method = Literal["exponential", "runge-kutta"]

_CONVERGED_STEP = 1.0 / 65_536.0
"""Largest integration step of a converged run, s."""

_FORMAT = 1
"""Of the files that `TestRun.save` writes."""


class FftRatio(NamedTuple):
    """Frequency response over a band."""

    frequency: Array
    """In Hz."""
    ratio: Array
    """abs(FFT(force)) / abs(FFT(command)), dimensionless."""


class Coherence(NamedTuple):
    """How much of the force is linear in the command, over frequency."""

    frequency: Array
    """In Hz."""
    coherence: Array
    """Magnitude squared, from 0 to 1."""


class IdealResponse(NamedTuple):
    """What the structure does under the command applied without error."""

    time: Array
    """In s."""
    displacement: Array
    """In m."""
    velocity: Array
    """In m/s."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class TestRun:
    """The traces of one test, one value per command sample; for several actuators (actuators, samples).

    Value `i` is the plant's true value at time ``i / sample_rate``, before that tick's output acts; what the
    sensors reported stands beside it as ``measured_...``. ``time, force = run`` unpacks the two.
    """

    __test__ = False  # pytest takes classes of this name for its own

    rig: Rig
    """The rig that was tested."""
    sample_rate: float
    """Ticks per second, Hz."""
    dtype: Dtype
    """Precision of the controller."""
    version: str
    """Version of the library that ran the test."""
    command: Array
    """Force command, N."""
    force: Array
    """Force on the structure, N."""
    displacement: Array
    """Displacement, m."""
    velocity: Array
    """Velocity, m/s."""
    spool: Array
    """Spool opening, 1."""
    load_pressure: Array
    """Load pressure, Pa."""
    supply_pressure: Array
    """Supply pressure, Pa."""
    valve_command: Array
    """Valve command, V."""
    compensation: Array
    """Compensation signal, V."""
    flow_gain_estimate: Array
    """The flow gain the controller believes in, 1 = as its table says."""
    response_delay_estimate: Array
    """The delay that the controller makes up for, s."""
    level: Array
    """The overcompensation guard's factor on the compensation level; 1 where it does not act."""
    measured_force: Array
    """Force as the sensor reported it, N."""
    measured_velocity: Array
    """Velocity as the sensor reported it, m/s."""
    measured_displacement: Array
    """Displacement as the sensor reported it, m."""
    measured_spool: Array
    """Spool opening as the sensor reported it, 1."""
    measured_supply_pressure: Array
    """Supply pressure as the sensor reported it, Pa."""
    status: NDArray[np.uint32]
    """Bits of `Status`."""

    @cached_property
    def time(self) -> Array:
        """Time of each sample in s, from zero."""
        return np.arange(self.command.shape[-1]) / self.sample_rate

    @property
    def seed(self) -> int:
        """Seed of the sensors' noise."""
        return cast(int, self.rig["sensors.seed"])

    @property
    def success(self) -> bool:
        """Whether the test ran to its end with finite values."""
        return not self.flags & Status.DIVERGED

    @cached_property
    def flags(self) -> Status:
        """Every flag that was raised at any time."""
        return Status(int(np.bitwise_or.reduce(self.status, axis=None)))

    @property
    def message(self) -> str:
        """How the test went, in words: every flag that was raised, since when and how often."""
        parts = ["completed" if self.success else f"diverged after {self.time[-1]:.6g} s"]
        for flag in self.flags & ~Status.DIVERGED:
            raised = (self.status & flag) != 0
            ticks = raised.reshape(-1, raised.shape[-1]).any(axis=0)
            name = (flag.name or str(int(flag))).lower()
            parts.append(
                f"{name} from {self.time[ticks.argmax()]:.6g} s, in {ticks.mean():.2%} of the samples"
            )
        return "; ".join(parts)

    def actuator(self, index: int) -> TestRun:
        """Return the traces of one actuator, counted from 0 at the ground, as a run of their own.

        Raises
        ------
        IndexError
            If there is no such actuator.
        """
        actuators = self.command.shape[0] if self.command.ndim > 1 else 1
        if not 0 <= index < actuators:
            raise IndexError(f"actuator = {index}: must be from 0 to {actuators - 1}")
        if self.command.ndim == 1:
            return self
        return replace(self, **{name: getattr(self, name)[index] for name in _TRACES})

    @property
    def _actuators(self) -> list[TestRun]:
        return [self.actuator(index) for index in range(self.command.shape[0])]

    def _check_command(self) -> None:
        if not self.command.any():
            raise ValueError("command is zero at every sample of every actuator: nothing to judge by")

    def metrics(self) -> dict[str, Any]:
        """Judge the true force against the command.

        Returns
        -------
        dict
            Numbers; for several actuators arrays with one number each, NaN where its command is zero.
            ``nrmse``: rms error over rms command; ``nrmse_delay_removed`` and ``nrmse_bias_free``: the same
            without the delay, without the offset; ``peak_error``: largest error over the largest command;
            ``delay``: by cross-correlation, s, positive when the force lags; ``fei_amplitude``,
            ``fei_delay`` (s), ``fei_frequency`` (Hz): frequency-domain evaluation index;
            ``tracking_indicator`` (N²): negative when the force lags; ``max_spool``: largest opening.
            NaN where there is no answer, such as the delay of a force that stays zero.

        Raises
        ------
        ValueError
            If the command is zero throughout, which no error can be related to.
        """
        if self.command.ndim > 1:
            self._check_command()
            each = [
                run.metrics() if run.command.any() else {"max_spool": float(np.abs(run.spool).max())}
                for run in self._actuators
            ]
            names = max(each, key=len)
            return {name: np.array([metrics.get(name, np.nan) for metrics in each]) for name in names}
        answer = _native.metrics(self.command, self.force, self.sample_rate)
        answer["max_spool"] = float(np.abs(self.spool).max())
        return answer

    def fft_ratio(self, f_low: float, f_high: float) -> FftRatio:
        """Divide the spectrum of the force by that of the command, over a band in Hz.

        The spectra are taken over the whole test without a window; bins that the command does not excite are
        left out. For several actuators the ratio has a row for each, at the frequencies that all commands
        excite, NaN where one is zero.
        """
        if self.command.ndim > 1:
            self._check_command()
            each = [run.fft_ratio(f_low, f_high) if run.command.any() else None for run in self._actuators]
            shared = reduce(np.intersect1d, (one.frequency for one in each if one))
            nothing = np.full(shared.size, np.nan)
            rows = [one.ratio[np.isin(one.frequency, shared)] if one else nothing for one in each]
            return FftRatio(shared, np.array(rows))
        return FftRatio(*_native.fft_ratio(self.command, self.force, self.sample_rate, f_low, f_high))

    def coherence(self, segment: float = 4.0) -> Coherence:
        """Judge how much of the force is linear in the command, from half overlapping segments of so many s.

        Hann windows, as ``scipy.signal.coherence``; where either signal holds nothing there is no answer. For
        several actuators the coherence has a row for each, at the frequencies that all have.
        """
        if self.command.ndim > 1:
            self._check_command()
            each = [run.coherence(segment) if run.command.any() else None for run in self._actuators]
            shared = reduce(np.intersect1d, (one.frequency for one in each if one))
            nothing = np.full(shared.size, np.nan)
            rows = [one.coherence[np.isin(one.frequency, shared)] if one else nothing for one in each]
            return Coherence(shared, np.array(rows))
        if not segment > 0.0:
            raise ValueError(f"segment = {segment}: must be positive, in s")
        samples = round(min(segment * self.sample_rate, 2.0**40))
        return Coherence(*_native.coherence(self.command, self.force, self.sample_rate, samples))

    def to_pandas(self) -> pd.DataFrame:
        """Return the traces as a data frame indexed by time in s (needs pandas).

        For several actuators the columns have two levels, the signal and the actuator counted from 1.
        """
        import pandas as pd

        index = pd.Index(self.time, name="time")
        if self.command.ndim > 1:
            columns = {
                (name, number): trace
                for name in _TRACES
                for number, trace in enumerate(getattr(self, name), start=1)
            }
            return pd.DataFrame(columns, index=index, copy=False).rename_axis(columns=["signal", "actuator"])
        return pd.DataFrame({name: getattr(self, name) for name in _TRACES}, index=index, copy=False)

    def to_control(self) -> Any:
        """Return force (output) under command (input) as a python-control ``TimeResponseData``."""
        import control

        numbers = [""] if self.command.ndim == 1 else [f"_{n + 1}" for n in range(self.command.shape[0])]
        return control.TimeResponseData(
            self.time,
            self.force,
            inputs=self.command,
            issiso=self.command.ndim == 1,
            output_labels=[f"force{number}" for number in numbers],
            input_labels=[f"command{number}" for number in numbers],
            title="effective force test",
        )

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the test to a NumPy archive that `load` reads back bit for bit.

        The file carries the rig as TOML, the library's version, the seed and the precision. It is written
        beside and renamed, so that `path` is never half a file.

        Returns
        -------
        pathlib.Path
            `path`, as it was given: no suffix is added.
        """
        target = Path(path)
        about: dict[str, Any] = {
            "format": np.int64(_FORMAT),
            "version": np.array(self.version),
            "rig": np.array(self.rig.to_toml()),
            "seed": np.int64(self.seed),
            "dtype": np.array(self.dtype),
            "sample_rate": np.float64(self.sample_rate),
        }
        with beside(target) as temporary, temporary.open("wb") as file:
            np.savez(file, allow_pickle=False, **about, **{name: getattr(self, name) for name in _TRACES})
        return target

    @classmethod
    def load(cls, path: str | PathLike[str]) -> TestRun:
        """Read a test that `save` wrote.

        Raises
        ------
        FileNotFoundError
            If there is no such file.
        ValueError
            If the file is not a saved test, is damaged, or is of a later format; the message says which.
        """
        source = Path(path)
        with source.open("rb") as file:
            try:
                stored = np.load(file, allow_pickle=False)
                if not isinstance(stored, np.lib.npyio.NpzFile):
                    raise ValueError("a single array")
                with stored as archive:
                    return cls._from_archive({name: archive[name] for name in archive.files})
            except (
                ValueError,
                KeyError,
                EOFError,
                MemoryError,
                zipfile.BadZipFile,
                NotImplementedError,
            ) as error:
                reason = f"has no {error}" if isinstance(error, KeyError) else str(error)
                if "pickle" in reason:
                    reason = "no archive of arrays"  # NumPy's guess is advice that nobody should follow
                raise ValueError(f"{source}: not a test saved by eft: {reason}") from None

    @classmethod
    def _from_archive(cls, stored: dict[str, NDArray[Any]]) -> TestRun:
        if (version := int(stored["format"])) > _FORMAT:
            raise ValueError(
                f"format {version} is later than {_FORMAT}, the latest this version of eft reads"
            )
        shape = stored["command"].shape
        for name in _TRACES:
            wanted = np.uint32 if name == "status" else np.float64
            if stored[name].dtype != wanted or stored[name].shape != shape or not shape:
                raise ValueError(f"{name} is {stored[name].dtype} of shape {stored[name].shape}")
        dtype = str(stored["dtype"])
        if dtype not in ("f32", "f64"):
            raise ValueError(f"dtype is {dtype!r}")
        return cls(
            rig=Rig(str(stored["rig"])),
            sample_rate=float(stored["sample_rate"]),
            dtype=cast(Dtype, dtype),
            version=str(stored["version"]),
            **{name: stored[name] for name in _TRACES},
        )

    def __iter__(self) -> Iterator[Array]:
        return iter((self.time, self.force))

    def __len__(self) -> int:
        return int(self.command.shape[-1])

    def __repr__(self) -> str:
        name = self.rig["name"] or "rig without a name"
        return f"<eft.TestRun of {name}: {len(self)} samples at {self.sample_rate:g} Hz, {self.message}>"


_TRACES = tuple(field.name for field in fields(TestRun))[4:]
"""The fields that are arrays: all behind `version`."""


def simulate(
    rig: Rig,
    command: Command,
    dtype: Dtype = "f64",
    *,
    method: Method | None = None,
    largest_step: float | None = None,
    converged: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> TestRun:
    """Run a test on the virtual rig; the digital side runs at the command's sample rate.

    Other threads go on meanwhile, and Ctrl-C stops the run.

    Parameters
    ----------
    rig : Rig
        The rig to be tested.
    command : Command
        The force to be applied; for a shear building (actuators, samples), the ground floor's first. There
        every floor has the rig's actuator and noise of its own, all share the supply, and when the
        protection of one trips, all others trip at the next sample.
    dtype : {"f64", "f32"}
        Precision of the controller; the plant is always computed in double precision.
    method : {"exponential", "runge-kutta"}, optional
        How the plant is carried through a step. "exponential", the default, takes its linear part exactly and
        evaluates the load flow once a step. "runge-kutta" is the classical method of fourth order: a half to
        a third of the error for four evaluations. A rig with effects beyond the paper's model takes
        Runge–Kutta steps whatever is asked for.
    largest_step : float, optional
        Largest integration step, s; a sample period is cut into equal steps no longer than this. The default
        of 1/4096 s keeps the force of the paper's tests within 1e-4 of its peak of the converged answer;
        halving it divides the error by three at least.
    converged : bool
        Whether to run with Runge–Kutta steps of 1/65536 s, against which the other choices are judged: about
        twenty times as long. It takes the place of the two above.
    progress : callable, optional
        Called a few times a second with the samples done and their total; an exception from it ends the run.

    Returns
    -------
    TestRun
        With as many samples as the command, or fewer if the state stopped being finite (see `success`).

    Raises
    ------
    ValueError
        If an argument is not allowed; the message names it.
    """
    if converged:
        for name, value in (("method", method), ("largest_step", largest_step)):
            if value is not None:
                raise ValueError(
                    f"{name} = {value!r}: must be left out of a converged run, which has its own"
                )
        method, largest_step = "runge-kutta", _CONVERGED_STEP
    traces = _native.simulate(
        rig, command, dtype, progress, method=method or "exponential", largest_step=largest_step
    )
    return TestRun(rig=rig, sample_rate=command.sample_rate, dtype=dtype, version=__version__, **traces)


def ideal_response(rig: Rig, command: Command) -> IdealResponse:
    """Compute what the rig's structure would do if the command were applied without error.

    The structure starts at rest; the command is linear between samples. Of a shear building displacement and
    velocity are (actuators, samples).
    """
    return IdealResponse(command.time, *_native.ideal_response(rig, command))


@dataclass(frozen=True, kw_only=True)
class EnergyBalance:
    """Where the hydraulic work of a test went, all in J: ``supplied + swept = dissipated + stored``."""

    supplied: float
    """Work of the pump."""
    swept: float
    """Work of chambers that change their volume while under pressure, which Eq. (7) leaves out."""
    droop: float
    """Lost by the droop of the supply."""
    valve: float
    """Throttled in the main stage."""
    leakage: float
    """Lost by leakage, in the valve and across the piston."""
    friction: float
    """Lost in the seals."""
    stops: float
    """Lost in the end stops."""
    damping: float
    """Lost in the structure's dampers."""
    hysteresis: float
    """Taken by the part of the structure that yields, most of it for good."""
    stored: float
    """What oil, accumulator, structure and stops hold more than at the start."""
    dissipated: float
    """All that was lost: from `droop` to `hysteresis`."""
    gap: float
    """What the books leave open, over the work supplied; zero but for the error of the integration."""


def energy_balance(rig: Rig, command: Command, *, largest_step: float | None = None) -> EnergyBalance:
    """Run a test with the books of its energy, in Runge–Kutta steps no longer than `largest_step` (s).

    The default of 1/4096 s is that of `simulate`. The gap shrinks with the step: it tells how far the
    integration can be trusted. The actuators of a shear building share one balance.
    """
    return EnergyBalance(**_native.energy_balance(rig, command, largest_step))
