"""The commands of the benchmark: two sweeps and two earthquakes."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from eft import _native
from eft._native import Command, Record, Rig, effective_force, read_record, sine_sweep
from eft.benchmark._rigs import RATE

_DURATION = 16.0
"""Duration of every test, s."""
_EL_CENTRO = Path(__file__).parents[1] / "data" / "RSN6_IMPVALL.I_I-ELC180-hor1.AT2"
_SYLMAR = "northridge1994_sylmar_county_360.csv"
_SYLMAR_SCALE = 0.6


@dataclass(frozen=True)
class Excitation:
    """An excitation of the benchmark."""

    name: str
    """Description."""
    record: Record | None = None
    """Ground motion; None for a sweep."""
    scale: float = 1.0
    """Factor on the ground motion, or amplitude of the sweep, N."""

    def command(self, known: Rig) -> Command:
        """Return the force for a rig, reduced to the advised limits of the rig.

        Parameters
        ----------
        known : Rig
            The rig as configured in the controller.

        Returns
        -------
        Command

        Raises
        ------
        ValueError
            If the rig has a building, which needs a mass for each floor.

        Examples
        --------
        >>> import eft
        >>> sweep = eft.benchmark.excitations()[0].command(eft.Rig.zhao2005())
        >>> sweep.duration
        16.0
        """
        if self.record is None:
            command = sine_sweep(self.scale, 0.0, 10.0, _DURATION, RATE)
        else:
            command = effective_force(self.record, known["structure.mass"], RATE, self.scale)
            command = command[: int(_DURATION * RATE)]
        return within_the_rig(known, command)


def within_the_rig(known: Rig, command: Command) -> Command:
    """Return the command, reduced to the advised limits of the configured rig."""
    while any(demand["required"] > demand["advised"] for demand in _native.demands(known, command)):
        command = 0.8 * command
    return command


def excitations() -> tuple[Excitation, ...]:
    """Return the four commands of the benchmark.

    Sweeps of 2.2 and 8.9 kN rise from 0 to 10 Hz in 16 s. The earthquakes are the first 16 s of El Centro,
    which is in the package, and of a motion near a fault. The latter is 60 % of the Northridge record if
    ``EFT_RECORDS`` names a folder with ``northridge1994_sylmar_county_360.csv``, otherwise an artificial
    motion.

    Returns
    -------
    tuple of Excitation
        Their names are in the rows of the result.

    Examples
    --------
    >>> import eft
    >>> [one.name for one in eft.benchmark.excitations()][:3]
    ['sweep 2.2 kN', 'sweep 8.9 kN', 'El Centro']
    """
    return (
        Excitation("sweep 2.2 kN", scale=2200.0),
        Excitation("sweep 8.9 kN", scale=8900.0),
        Excitation("El Centro", read_record(_EL_CENTRO)),
        _near_fault(os.environ.get("EFT_RECORDS", "")),
    )


@cache
def _near_fault(folder: str) -> Excitation:
    path = Path(folder) / _SYLMAR
    if folder and path.is_file():
        return Excitation("Northridge, 60 %", read_record(path), _SYLMAR_SCALE)
    return Excitation("artificial, near fault", artificial_record())


def artificial_record() -> Record:
    """Make an artificial motion near a fault: a velocity pulse and sines of fixed phases under an envelope.

    The pulse is that of Mavroeidis and Papageorgiou, Bulletin of the Seismological Society of America 93(3),
    2003, of 0.35 m/s and 0.9 Hz.
    """
    dt, rate, cycles, centre = 0.01, 0.9, 2.2, 4.0
    time = np.arange(1600) * dt
    around = time - centre
    bell = np.where(
        np.abs(around) <= cycles / (2.0 * rate), 1.0 + np.cos(2.0 * np.pi * rate / cycles * around), 0.0
    )
    velocity = 0.5 * 0.35 * bell * np.sin(2.0 * np.pi * rate * around)
    numbers = np.arange(1, 41)
    # Multiples of the golden ratio give evenly distributed phases.
    phases = 2.0 * np.pi * ((numbers * 0.6180339887498949) % 1.0)
    sines = np.sin(2.0 * np.pi * 0.25 * numbers * time[:, None] + phases).sum(axis=1)
    envelope = (time / centre) ** 2 * np.exp(2.0 * (1.0 - time / centre))
    return Record(np.gradient(velocity, dt) + 0.12 * envelope * sines, dt, "artificial, near fault")
