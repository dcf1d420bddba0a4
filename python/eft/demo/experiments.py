"""Runs the tests: the paper's sweeps, and an earthquake under every scheme."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import eft
from eft import paper

if TYPE_CHECKING:
    from eft import Command, Record, Rig, TestRun
    from eft.plots import Response

EL_CENTRO = "RSN6_IMPVALL.I_I-ELC180-hor1.AT2"
EL_CENTRO_SCALE = 1.3
"""Scale at which the demand on the valve is that of the paper's earthquake test."""

SCHEMES = ("off", "linear", "nonlinear")
SAMPLE_RATE = 4096.0
"""Sample rate of the earthquake tests, Hz."""


@dataclass(frozen=True)
class SweepResult:
    """A sweep of the paper and its result."""

    case: paper.Case
    run: TestRun
    numbers: paper.Numbers

    def comparisons(self) -> list[paper.Comparison]:
        """Every number with its reference; empty without a reference."""
        reference = self.case.reference
        return list(paper.compare(reference, self.numbers, paper.load())) if reference else []


@dataclass(frozen=True)
class Earthquake:
    """One record under every scheme, with the ideal response."""

    record: Record
    scale: float
    rig: Rig
    command: Command
    ideal: Response
    runs: dict[str, TestRun]


def sweep(case: paper.Case) -> SweepResult:
    """Run one sweep of the paper."""
    settings = paper.load().sweep
    run = eft.simulate(case.rig(), settings.command(case.amplitude))
    return SweepResult(case, run, paper.observe(run, settings.ratio_band))


class EarthquakeTest:
    """A prepared earthquake test; `run` runs it under one scheme."""

    def __init__(self, path: Path | None, scale: float | None, unit: str | None = None) -> None:
        """Read the record; without a path El Centro, which ships with the package."""
        if path is None:
            with resources.as_file(resources.files("eft").joinpath("data", EL_CENTRO)) as shipped:
                self.record = eft.read_record(shipped)
            self.scale = EL_CENTRO_SCALE if scale is None else scale
        else:
            self.record = eft.read_record(path, unit=unit)
            self.scale = 1.0 if scale is None else scale
        self.rig = eft.Rig.zhao2005()
        self.command = eft.effective_force(
            self.record,
            mass=self.rig["structure.mass"],
            sample_rate=SAMPLE_RATE,
            scale=self.scale,
        )

    def run(self, scheme: str) -> TestRun:
        """One test under a compensation scheme."""
        return eft.simulate(self.rig.replace({"compensation.mode": scheme}), self.command)

    def result(self, runs: dict[str, TestRun]) -> Earthquake:
        """The runs, compared with the structure under the exact command."""
        ideal = eft.ideal_response(self.rig, self.command)
        return Earthquake(self.record, self.scale, self.rig, self.command, ideal, runs)


@dataclass(frozen=True)
class EarthquakeNumbers:
    """The compared numbers of one earthquake test."""

    max_spool: float
    """Largest spool opening, as a fraction of the stroke."""
    force_nrmse: float
    """Root mean square of the force error over that of the command."""
    displacement_nrmse: float
    """Root mean square of the difference from the ideal displacement, over that of the ideal displacement."""
    max_displacement: float
    """Largest displacement, m."""
    peak_reached: float
    """Largest displacement over the largest ideal one."""


def observe(run: TestRun, ideal: Response) -> EarthquakeNumbers:
    """The numbers of one earthquake test."""
    metrics = run.metrics()
    peak = float(np.abs(run.displacement).max())
    # A run that diverged is shorter than its command.
    wanted = ideal.displacement[: len(run)]
    return EarthquakeNumbers(
        max_spool=float(metrics["max_spool"]),
        force_nrmse=float(metrics["nrmse"]),
        displacement_nrmse=float(np.linalg.norm(run.displacement - wanted) / np.linalg.norm(wanted)),
        max_displacement=peak,
        peak_reached=peak / float(np.abs(ideal.displacement).max()),
    )
