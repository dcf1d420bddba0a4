"""The rig with the flow curve that a test found."""

from __future__ import annotations

from typing import TYPE_CHECKING

from eft import _native

if TYPE_CHECKING:
    from eft._native import Rig
    from eft._run import TestRun


def corrected_rig(run: TestRun) -> Rig:
    """Return the rig with the flow curve found; see `TestRun.corrected_rig`."""
    if run.found_flows is None:
        raise ValueError(
            "found_flows = None: must have been found here: a processor in the loop keeps its flows"
        )
    if run.found_flows.ndim > 1:
        actuators = run.found_flows.shape[0]
        raise ValueError(
            f"a run of {actuators} actuators has one flow curve for each: take run.actuator(0)'s"
        )
    return _native.corrected_rig(run.rig, run.found_flows)
