"""Parts of a test: one actuator, or its first samples."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eft._numbers import whole_number
from eft._status import ENDED
from eft._table import TRACES

if TYPE_CHECKING:
    from eft._run import TestRun


def to_its_end(run: TestRun) -> TestRun:
    """Return the test up to the sample at which it tripped or a piston left its stroke.

    If neither happened, this is the whole test. Later samples contain the rig after the protection
    removed the force.

    Returns
    -------
    TestRun

    Examples
    --------
    >>> import eft
    >>> short = eft.Rig.zhao2005().replace({"actuator.stroke": 1e-3})
    >>> run = eft.simulate(short, eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
    >>> len(run.to_its_end()) < len(run)
    True
    """
    ended = ((run.status & ENDED) != 0).reshape(-1, len(run)).any(axis=0)
    if not ended.any():
        return run
    return first(run, max(int(ended.argmax()), 1))


def first(run: TestRun, samples: int) -> TestRun:
    """The first samples of a test."""
    part = _part(run, (..., slice(samples)), run.found_flows)
    if run._building is None:
        return part
    building, index = run._building
    return replace(part, _building=(first(building, samples), index))


def actuator(run: TestRun, index: int) -> TestRun:
    """Return the traces of one actuator as a run.

    Parameters
    ----------
    index : int
        Number of the actuator, from 0 at the ground.

    Returns
    -------
    TestRun

    Raises
    ------
    IndexError
        If there is no such actuator.

    Examples
    --------
    >>> import eft, numpy
    >>> stories = {"masses": [7e3, 8e3], "dampings": [4e3, 4e3], "stiffnesses": [7e5, 7e5]}
    >>> changes = {"structure.kind": "shear_building", "structure.stories": stories}
    >>> command = eft.Command(numpy.full((2, 100), 500.0), 1024.0)
    >>> run = eft.simulate(eft.Rig.zhao2005().replace(changes), command)
    >>> run.force.shape, run.actuator(1).force.shape
    ((2, 100), (100,))
    """
    index = whole_number("actuator", index)
    actuators = run.command.shape[0] if run.command.ndim > 1 else 1
    if not 0 <= index < actuators:
        raise IndexError(f"actuator = {index}: must be from 0 to {actuators - 1}")
    if run.command.ndim == 1:
        return run
    mass = run.mass if run.mass is None or np.ndim(run.mass) == 0 else np.asarray(run.mass)[index]
    found = None if run.found_flows is None else run.found_flows[index]
    own = (run._calibrations[index],)
    part = _part(run, index, found)
    return replace(part, mass=mass, _calibrations=own, _floor=index, _building=(run, index))


def _part(run: TestRun, index: Any, found_flows: NDArray[np.float64] | None) -> TestRun:
    """Return some actuators or samples; the energy of a part is unknown."""
    values = {name: trace[index] for name, trace in run._values.items()}
    # Traces that share an array also share it in the part.
    same = {name: TRACES[name].otherwise for name in values if _is_same(run, name)}
    values |= {name: values[other] for name, other in same.items()}
    return replace(
        run, _values=values, status=run.status[index], found_flows=found_flows, _energy=None, _whole=False
    )


def _is_same(run: TestRun, name: str) -> bool:
    """Whether a trace is the same array as another trace."""
    other = run._values.get(TRACES[name].otherwise)
    return other is not None and run._values[name] is other
