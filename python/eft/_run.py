"""What a test on the virtual rig leaves behind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cached_property, reduce
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from eft import _native, _run_file
from eft._energy import EnergyBalance
from eft._native import Command, Rig, __version__
from eft._status import CAUSE_BITS, ENDED, Cause, Status, cause_of, status_of
from eft._table import TRACES, Channels, Metrics

if TYPE_CHECKING:
    import pandas as pd

    from eft._verdict import Verdict

__all__ = ["Coherence", "FftRatio", "Metrics", "TestRun"]

Array = NDArray[np.float64]
Dtype = Literal["f32", "f64"]


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


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class TestRun(Channels):
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
    _values: Mapping[str, Array] = field(default_factory=dict)
    status: NDArray[np.uint32]
    """Bits of `Status`."""
    found_flows: Array | None = None
    """Flow that the controller found at each opening of its table, m³/s; the fixed scheme finds the table.
    None where a processor in the loop has learned: what it found stays with it."""
    date: str = ""
    """When the test was run, by ISO 8601; empty where an older file does not say."""
    record: str = ""
    """Name of the ground motion; empty of another command."""
    scale: float | None = None
    """Factor on the ground motion's acceleration."""
    mass: float | Array | None = None
    """Mass by which the ground motion became a force, kg."""
    _energy: EnergyBalance | None = None
    _whole: bool = True
    _building: tuple[TestRun, int] | None = None
    """Of one actuator of a building the run of all, and its place among them."""

    @classmethod
    def _of(cls, rig: Rig, command: Command, dtype: Dtype, outcome: Mapping[str, Any]) -> TestRun:
        """Make a run of what Rust says of it."""
        energy = outcome["energy"]
        return cls(
            rig=rig,
            sample_rate=command.sample_rate,
            dtype=dtype,
            version=__version__,
            _values={name: outcome[name] for name in TRACES if name in outcome},
            status=outcome["status"],
            found_flows=outcome["found_flows"],
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            record=command.record.name if command.record else "",
            scale=command.scale,
            mass=command.mass,
            _energy=EnergyBalance(**energy) if energy else None,
        )

    @cached_property
    def time(self) -> Array:
        """Time of each sample in s, from zero."""
        return np.arange(self.command.shape[-1]) / self.sample_rate

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
        """What tripped the protection first; of several actuators, that of the one that tripped first."""
        causes = (self.status & np.uint32(CAUSE_BITS)).reshape(-1, self.status.shape[-1])
        tripped = causes.any(axis=0)
        if not tripped.any():
            return Cause.NONE
        return max(cause_of(int(status)) for status in causes[:, int(tripped.argmax())])

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the test counts, why not, and what helps; limits are the rig's ``verdict`` section."""
        from eft._verdict import judge

        return judge(self)

    @property
    def message(self) -> str:
        """How the test went, in words.

        Whether it was completed or how it ended, as a study's status says it; then every flag that was
        raised, since when and how often.
        """
        word, early = status_of(self.flags)
        end = self.time[-1] if not self.success else self.to_its_end().duration
        parts = [word if early is None else f"{word} after {end:.6g} s"]
        if self.cause is not Cause.NONE:
            parts.append(f"cause: {self.cause.name.lower()}")
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

    def to_its_end(self) -> TestRun:
        """Return the test up to the sample at which it tripped or a piston left its stroke.

        That is all of it where neither happened. What follows is the simulation's, not a test's: `metrics` of
        all samples judges a force that was taken away.
        """
        ended = ((self.status & ENDED) != 0).reshape(-1, len(self)).any(axis=0)
        if not ended.any():
            return self
        kept = max(int(ended.argmax()), 1)
        return self._first(kept)

    def _first(self, samples: int) -> TestRun:
        part = self._part((..., slice(samples)), self.found_flows)
        if self._building is None:
            return part
        building, index = self._building
        return replace(part, _building=(building._first(samples), index))

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
        mass = self.mass if self.mass is None or np.ndim(self.mass) == 0 else np.asarray(self.mass)[index]
        found = None if self.found_flows is None else self.found_flows[index]
        return replace(self._part(index, found), mass=mass, _building=(self, index))

    def corrected_rig(self) -> Rig:
        """Return the rig with the flow curve that the controller found as its table, to be kept.

        The valve stays what it was: its own curve stands as ``servovalve.true_flow_table``.

        Raises
        ------
        ValueError
            If the run is of several actuators, each of which found a curve of its own: take one `actuator`'s;
            if an adaptive controller or a guard compensated by the linear scheme, whose straight line says
            nothing of the table; if a processor in the loop has learned, with which it stayed; or if the
            flows do not increase, which single precision can leave behind.
        """
        if self.found_flows is None:
            raise ValueError(
                "found_flows = None: must have been found here: those of a processor in the loop stay with it"
            )
        if self.found_flows.ndim > 1:
            actuators = self.found_flows.shape[0]
            raise ValueError(
                f"a run of {actuators} actuators has as many flow curves: take run.actuator(0)'s"
            )
        adapts = any(self.rig[f"compensation.{part}"] for part in ("adaptive", "guard", "supply_correction"))
        if adapts and self.rig["compensation.mode"] == "linear":
            raise ValueError(
                'compensation.mode = "linear": must be "nonlinear" for a flow table to be found: '
                "the linear scheme looks at none"
            )
        valve = self.rig.plant["servovalve"]
        return self.rig.replace(
            {
                "truth.servovalve.flow_table": None,
                "servovalve.true_flow_table": valve.get("true_flow_table", valve["flow_table"]),
                "servovalve.flow_table.flows": self.found_flows.tolist(),
            }
        )

    def _part(self, index: Any, found_flows: Array | None) -> TestRun:
        """Return some actuators or samples, whose energy nobody knows."""
        values = {name: trace[index] for name, trace in self._values.items()}
        # What is one array stays one.
        same = {name: TRACES[name].otherwise for name in values if self._is_same(name)}
        values |= {name: values[other] for name, other in same.items()}
        return replace(
            self,
            _values=values,
            status=self.status[index],
            found_flows=found_flows,
            _energy=None,
            _whole=False,
        )

    def _is_same(self, name: str) -> bool:
        """Whether a trace is the very array of another one."""
        other = self._values.get(TRACES[name].otherwise)
        return other is not None and self._values[name] is other

    @property
    def energy(self) -> EnergyBalance | None:
        """Where the energy of the whole test went, J; None of a part of a test.

        The books are kept along with a rig that has effects beyond the paper's model, and with a building. Of
        any other the test is run once more for them, as `eft.energy_balance` does.
        """
        if self._energy is None and self._whole and self.found_flows is not None:
            command = Command(self.command, self.sample_rate)
            energy = EnergyBalance(**_native.energy_balance(self.rig, command, None))
            object.__setattr__(self, "_energy", energy)
        return self._energy

    @property
    def _traces(self) -> tuple[str, ...]:
        """The traces that there are."""
        return (*(name for name in TRACES if name in self._values), "status")

    @property
    def _actuators(self) -> list[TestRun]:
        return [self.actuator(index) for index in range(self.command.shape[0])]

    def _check_command(self) -> None:
        if not self.command.any():
            raise ValueError("command is zero at every sample of every actuator: nothing to judge by")

    def metrics(self, *, fft: bool = True) -> Metrics:
        """Judge the true force against the command, and the motion against the ideal response.

        Parameters
        ----------
        fft : bool
            Whether to compute the metrics that take longer than the test too: those that need a Fourier
            transform (``delay``, ``nrmse_delay_removed``, the three of the evaluation index), and
            ``displacement_error``.

        Returns
        -------
        Metrics
            Numbers by name, as items and as attributes; for several actuators arrays with one number each,
            NaN where its command is zero. ``nrmse``: rms error over rms command; ``nrmse_delay_removed`` and
            ``nrmse_bias_free``: the same without the delay, without the offset; ``peak_error``: largest error
            over the largest command; ``delay``: by cross-correlation, s, positive when the force lags;
            ``fei_amplitude``, ``fei_delay`` (s), ``fei_frequency`` (Hz): frequency-domain evaluation index;
            ``tracking_indicator`` (N²): negative when the force lags; ``displacement_error``: rms error of
            the displacement against `eft.ideal_response`, over its rms; ``max_spool``: largest opening;
            ``drift`` (m): largest drift of the story; ``min_supply_pressure`` (Pa). NaN where there is no
            answer, such as the delay of a force that stays zero.

        Raises
        ------
        ValueError
            If the command is zero throughout, which no error can be related to.

        Examples
        --------
        >>> import eft
        >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.0, 5.0, 4.0, 1024.0))
        >>> metrics = run.metrics()
        >>> round(metrics["nrmse"], 3) == round(metrics.nrmse, 3)
        True
        """
        if self.command.ndim > 1:
            self._check_command()
        if self._building is not None and self.command.any():
            # The motion of one floor takes those of the others to be judged.
            building, index = self._building
            found = building.metrics(fft=fft)
            return Metrics({str(name): float(values[index]) for name, values in found.items()})
        signals = (self.command, self.force, self.displacement, self.spool, self.supply_pressure)
        judged = _native.judge_test(self.rig, self.sample_rate, *signals, fft)
        if self.command.ndim > 1:
            return Metrics({name: np.array(values) for name, values in judged.items()})
        return Metrics({name: value for name, [value] in judged.items()})

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
                for name in self._traces
                for number, trace in enumerate(getattr(self, name), start=1)
            }
            return pd.DataFrame(columns, index=index, copy=False).rename_axis(columns=["signal", "actuator"])
        return pd.DataFrame({name: getattr(self, name) for name in self._traces}, index=index, copy=False)

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
        """Write the test to a compressed NumPy archive that `load` reads back bit for bit.

        The file carries the rig as TOML, the library's version, the seed, the precision, the date, the units,
        the energy if its books were kept, and of a ground motion name, scale and mass. It is written beside
        and renamed, so that `path` is never half a file.

        Returns
        -------
        pathlib.Path
            `path`, as it was given: no suffix is added.
        """
        return _run_file.write(self, self._values, Path(path))

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
        return cls(**_run_file.read(Path(path)))

    def __iter__(self) -> Iterator[Array]:
        return iter((self.time, self.force))

    def __len__(self) -> int:
        return int(self.command.shape[-1])

    def __repr__(self) -> str:
        name = self.rig["name"] or "rig without a name"
        return f"<eft.TestRun of {name}: {len(self)} samples at {self.sample_rate:g} Hz, {self.message}>"


_OPTIONAL = tuple(name for name, trace in TRACES.items() if trace.otherwise == "absent")
"""Traces that only some rigs have."""
_TRACES = (*(name for name in TRACES if name not in _OPTIONAL), "status")
"""The traces of every rig."""
