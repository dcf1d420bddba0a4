"""The paper's sine sweeps as data: settings, references and results.

The numbers are in ``data/paper.toml`` only.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

import eft

if TYPE_CHECKING:
    from eft import Command, Rig, TestRun


@dataclass(frozen=True)
class Numbers:
    """The compared numbers of one sweep."""

    max_spool: float
    """Largest spool opening, as a fraction of the stroke."""
    max_displacement: float
    """Largest displacement, m."""
    nrmse: float
    """Root mean square of the force error over that of the command."""
    ratio_min: float
    """Smallest |FFT(force)| / |FFT(command)| in the band around the resonance."""
    ratio_min_at: float
    """Where, Hz."""
    ratio_max: float
    """Largest |FFT(force)| / |FFT(command)| in the band around the resonance."""
    ratio_max_at: float
    """Where, Hz."""


@dataclass(frozen=True)
class Sweep:
    """The common settings of the commands, without their amplitudes."""

    f_start: float
    """Hz."""
    f_end: float
    """Hz."""
    duration: float
    """s."""
    sample_rate: float
    """Hz."""
    ratio_band: tuple[float, float]
    """Band for the extremes of the ratio, Hz."""

    def command(self, amplitude: float) -> Command:
        """The force command for an amplitude in N."""
        return eft.sine_sweep(
            amplitude=amplitude,
            f_start=self.f_start,
            f_end=self.f_end,
            duration=self.duration,
            sample_rate=self.sample_rate,
        )


@dataclass(frozen=True)
class Tolerance:
    """Allowed difference of a run from its reference."""

    relative: float
    """Relative difference of every value."""
    bins: float
    """Difference of every frequency, in bins of the FFT."""


@dataclass(frozen=True)
class Case:
    """One sweep of the paper."""

    key: str
    title: str
    label: str
    """Label in figures."""
    figures: tuple[str, ...]
    """The paper's figures that show it."""
    amplitude: float
    """N."""
    changes: dict[str, Any]
    """Changes of the paper's rig, by dotted key."""
    paper: str
    """The paper's words."""
    reference: Numbers | None
    """Results of the independent model, if it was run."""

    def rig(self) -> Rig:
        """The paper's rig with the changes of this case."""
        return eft.Rig.zhao2005().replace(self.changes)


@dataclass(frozen=True)
class Paper:
    """Everything in ``data/paper.toml``."""

    sweep: Sweep
    tolerance: Tolerance
    cases: tuple[Case, ...]


@cache
def load() -> Paper:
    """Read the data file."""
    text = resources.files("eft").joinpath("data", "paper.toml").read_text(encoding="utf-8")
    data = tomllib.loads(text)
    low, high = data["sweep"].pop("ratio_band")
    return Paper(
        sweep=Sweep(**data["sweep"], ratio_band=(low, high)),
        tolerance=Tolerance(**data["tolerance"]),
        cases=tuple(_case(entry) for entry in data["case"]),
    )


def _case(entry: dict[str, Any]) -> Case:
    reference = entry.pop("reference", None)
    return Case(
        reference=Numbers(**reference) if reference else None,
        changes=entry.pop("set"),
        figures=tuple(entry.pop("figures")),
        **entry,
    )


def observe(run: TestRun, band: tuple[float, float]) -> Numbers:
    """The same numbers of a run; `band` (Hz) is the band for the extremes of the ratio."""
    metrics = run.metrics()
    response = run.fft_ratio(*band)
    low, high = response.ratio.argmin(), response.ratio.argmax()
    return Numbers(
        max_spool=float(metrics["max_spool"]),
        max_displacement=float(abs(run.displacement).max()),
        nrmse=float(metrics["nrmse"]),
        ratio_min=float(response.ratio[low]),
        ratio_min_at=float(response.frequency[low]),
        ratio_max=float(response.ratio[high]),
        ratio_max_at=float(response.frequency[high]),
    )


@dataclass(frozen=True)
class Comparison:
    """One number of a run with its reference."""

    name: str
    reference: float
    run: float
    deviation: float
    """Relative for values, in bins of the FFT for frequencies."""
    within: bool

    def __str__(self) -> str:
        unit = " bins" if self.name.endswith("_at") else ""
        far = f"{self.deviation:.1f}{unit}" if unit else f"{self.deviation:.1%}"
        return f"{self.name} is {self.run:.4g}, the reference is {self.reference:.4g}: {far} apart"


def compare(reference: Numbers, run: Numbers, paper: Paper) -> Iterator[Comparison]:
    """Every number of a run with its reference."""
    bin_width = 1.0 / paper.sweep.duration
    for field in fields(Numbers):
        expected, found = getattr(reference, field.name), getattr(run, field.name)
        if field.name.endswith("_at"):
            deviation, allowed = abs(found - expected) / bin_width, paper.tolerance.bins
            # The references are rounded to 1 mHz.
            within = deviation <= allowed + 0.5e-3 / bin_width
        else:
            deviation, allowed = abs(found / expected - 1.0), paper.tolerance.relative
            within = deviation <= allowed
        yield Comparison(field.name, expected, found, deviation, within)
