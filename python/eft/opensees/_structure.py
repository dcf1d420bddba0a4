"""A model of OpenSees as the structure under the actuators."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eft._structure import StructureError

Array = NDArray[np.float64]

_FINER = 10
"""Number of parts of a step that does not converge."""


class Structure:
    """The present model of openseespy as the structure of `eft.simulate`.

    In each sample the forces of the actuators act on their nodes. The model takes one step and commits it,
    and the pistons follow the motions of the nodes. The forces at the end of a sample are extrapolated from
    the mean forces of the last two samples. The error of the exchange is therefore of second order in the
    sample period. Motions are relative to the present state of the model.

    A step that does not converge is divided into ten. If these do not converge either, the test ends as
    tripped, and `TestRun.stopped` has the reason.

    Parameters
    ----------
    nodes : int or sequence of int
        The node under each actuator, the ground floor's first.
    directions : int or sequence of int
        The degree of freedom of each node on which its actuator acts, counted from 1 as in OpenSees.
    own_analysis : bool
        Whether to step with the analysis that the script defined, which must be transient. The default is a
        new analysis with average acceleration, Newton's method and a banded solver. It replaces any other
        analysis.
    tag : int
        Tag of the load pattern and the time series that are added, which must be unused.
    opensees : module, optional
        The module of OpenSees; ``openseespy.opensees`` where it is left out.

    Raises
    ------
    ValueError
        If a node or direction does not exist or is fixed, or their numbers differ. If the tag is in use.
    ModuleNotFoundError
        If openseespy is not installed.

    Notes
    -----
    OpenSees has one model per process. A structure continues from its present state; for another test,
    build the model again. Mass, damping and gravity loads belong to the model; call ``loadConst`` after a
    gravity analysis.
    """

    def __init__(
        self,
        nodes: int | Sequence[int],
        directions: int | Sequence[int] = 1,
        *,
        own_analysis: bool = False,
        tag: int = 910_000,
        opensees: ModuleType | None = None,
    ) -> None:
        if opensees is None:
            from openseespy import opensees as found

            opensees = found
        self._opensees: Any = opensees
        self._nodes = [nodes] if isinstance(nodes, int) else [int(node) for node in nodes]
        several = [directions] * len(self._nodes) if isinstance(directions, int) else directions
        self._directions = [int(direction) for direction in several]
        self._tag = tag
        self._check()
        self._freedoms = [self._opensees.getNDF(node)[0] for node in self._nodes]
        self._start = self._motions("nodeDisp")
        self._last: Array | None = None
        self._time = 0.0
        if not own_analysis:
            self._analyse()
        try:
            self._opensees.timeSeries("Constant", tag)
        except self._opensees.OpenSeesError:
            raise ValueError(f"tag = {tag}: must be unused, as it is before another `Structure`") from None

    def __call__(self, force: float | Array, dt: float) -> tuple[Any, Any]:
        """Take one step.

        Parameters
        ----------
        force : float or numpy.ndarray
            Mean force on each node over the step, N.
        dt : float
            Length of the step, s.

        Returns
        -------
        tuple
            Displacements (m) and velocities (m/s) at its end; numbers if `force` is a number.

        Raises
        ------
        StructureError
            If it does not converge.
        """
        mean = np.atleast_1d(np.asarray(force, dtype=np.float64))
        if mean.size != len(self._nodes):
            raise ValueError(f"nodes = {self._nodes}: must be one for each of {mean.size} actuators")
        last = np.zeros_like(mean) if self._last is None else self._last
        self._load(1.5 * mean - 0.5 * last)
        self._last = mean
        self._time += dt
        if self._opensees.analyze(1, dt) != 0 and self._opensees.analyze(_FINER, dt / _FINER) != 0:
            raise StructureError(f"the model of OpenSees did not converge at {self._time:.6g} s of the test")
        displacements, velocities = self._motions("nodeDisp") - self._start, self._motions("nodeVel")
        if np.ndim(force) == 0:
            return float(displacements[0]), float(velocities[0])
        return displacements, velocities

    def _check(self) -> None:
        if len(self._directions) != len(self._nodes) or not self._nodes:
            counts = f"{len(self._directions)} values: must be one for each of {len(self._nodes)} nodes"
            raise ValueError(f"directions = {counts}")
        there = set(self._opensees.getNodeTags() or ())
        for node, direction in zip(self._nodes, self._directions, strict=True):
            if node not in there:
                raise ValueError(f"nodes = {node}: must be a node of the present model in OpenSees")
            freedoms = self._opensees.getNDF(node)[0]
            if not 1 <= direction <= freedoms:
                raise ValueError(f"directions = {direction}: must be from 1 to {freedoms} at node {node}")
            if direction in (self._opensees.getFixedDOFs(node) or ()):
                raise ValueError(f"nodes = {node}: must be free to move in direction {direction}")

    def _analyse(self) -> None:
        ops = self._opensees
        ops.wipeAnalysis()
        ops.constraints("Transformation")
        ops.numberer("RCM")
        ops.system("BandGeneral")
        ops.test("NormDispIncr", 1e-12, 25, 0)
        ops.algorithm("Newton")
        ops.integrator("Newmark", 0.5, 0.25)
        ops.analysis("Transient")

    def _load(self, forces: Array) -> None:
        ops, tag = self._opensees, self._tag
        if self._last is not None:
            ops.remove("loadPattern", tag)
        ops.pattern("Plain", tag, tag)
        for node, direction, freedoms, force in zip(
            self._nodes, self._directions, self._freedoms, forces, strict=True
        ):
            load = [0.0] * freedoms
            load[direction - 1] = float(force)
            ops.load(node, *load)

    def _motions(self, kind: str) -> Array:
        read = getattr(self._opensees, kind)
        return np.array([read(*where) for where in zip(self._nodes, self._directions, strict=True)])
