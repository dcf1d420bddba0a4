"""The largest factor on a command that a rig can apply."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from eft._floors import floor_mass
from eft._native import Command, Record, Rig, check_rig, effective_force
from eft._numbers import real_number
from eft._simulate import simulate

if TYPE_CHECKING:
    from eft._verdict import Verdict

__all__ = ["LargestScale", "largest_scale"]

_BOUNDS = (1.0 / 512.0, 512.0)
"""Factors beyond these are not tried."""


@dataclass(frozen=True)
class LargestScale:
    """The largest factor on a record or command with a usable test."""

    scale: float
    """The factor; 0 if no tried one from 1/512 to 512 is usable, infinite if 512 is."""
    limited_by: tuple[str, ...]
    """Reasons against the next larger factor, worst first; against the factor 1 if none is usable."""

    def _repr_html_(self) -> str:
        from eft import _notebook

        rows = [("scale", self.scale), *(("limited by", reason) for reason in self.limited_by)]
        return _notebook.shown("Largest scale", rows)


def largest_scale(
    rig: Rig,
    record: Record | Command,
    *,
    mass: float | Sequence[float] | None = None,
    sample_rate: float | None = None,
    tolerance: float = 0.01,
) -> LargestScale:
    """Find the largest factor on a record whose test on the virtual rig is usable: its verdict is not "no".

    Factors are doubled or halved from 1 until one test is usable and the next is not. If neither 1 nor a
    smaller factor is usable, as for a force below noise and friction, larger ones are tried. The interval
    is then bisected. If the verdict is not monotonic in the factor, the result is the end of one interval.
    `check_feasibility` judges before the test, with margins, and may refuse a smaller factor.

    Parameters
    ----------
    rig : Rig
        The rig; its ``verdict`` section has the limits.
    record : Record or Command
        A ground motion, or a command in N.
    mass : float or sequence of float, optional
        Mass in kg for the effective force of a ground motion, one per floor of a shear building. By default
        that of the structure.
    sample_rate : float, optional
        Sample rate of the effective force, Hz; the rig's ``controller.sample_rate`` by default.
    tolerance : float
        Relative width of the interval at the end.

    Returns
    -------
    LargestScale
        The factor, and what limits it.

    Raises
    ------
    ValueError
        If the tolerance is not between 1e-6 and 1, or mass and sample rate do not fit the record.

    Examples
    --------
    >>> import eft
    >>> sweep = eft.sine_sweep(2000.0, 0.5, 4.0, 2.0, 1024.0)
    >>> found = eft.largest_scale(eft.Rig.zhao2005(), sweep, tolerance=0.2)
    >>> found.scale > 0
    True
    """
    check_rig(rig)
    tolerance = real_number("tolerance", tolerance)
    if not 1e-6 <= tolerance <= 1.0:
        raise ValueError(f"tolerance = {tolerance}: must be from 1e-6 to 1")
    scaled = _scaled(rig, record, mass, sample_rate)

    def verdict(scale: float) -> Verdict:
        return simulate(rig, scaled(scale)).verdict

    low, high = 1.0, math.inf
    against: tuple[str, ...] = ()
    found = first = verdict(low)
    # Down, and then up, where the force may be too small for noise and friction at 1.
    for factor in (0.5, 2.0):
        scale = factor
        while not found.ok and _BOUNDS[0] <= scale <= _BOUNDS[1]:
            before, found = found, verdict(scale)
            if found.ok:
                low = scale
                if factor < 1.0:
                    high, against = scale / factor, before.reasons
            scale *= factor
    if not found.ok:
        return LargestScale(0.0, first.reasons)
    while high == math.inf:
        scale = 2.0 * low
        if scale > _BOUNDS[1]:
            return LargestScale(math.inf, ())
        found = verdict(scale)
        if found.ok:
            low = scale
        else:
            high, against = scale, found.reasons
    while high > (1.0 + tolerance) * low:
        scale = (low * high) ** 0.5
        found = verdict(scale)
        if found.ok:
            low = scale
        else:
            high, against = scale, found.reasons
    return LargestScale(low, against)


def _scaled(
    rig: Rig, record: Record | Command, mass: float | Sequence[float] | None, sample_rate: float | None
) -> Callable[[float], Command]:
    if isinstance(record, Command):
        if mass is not None or sample_rate is not None:
            raise ValueError("mass, sample_rate: must be left out with a command, which has both")
        return lambda scale: Command(scale * record.values, record.sample_rate)
    kilograms = floor_mass(rig) if mass is None else mass
    rate = rig["controller.sample_rate"] if sample_rate is None else sample_rate
    return lambda scale: effective_force(record, kilograms, rate, scale)
