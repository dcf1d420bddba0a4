"""The rig with the flow curve that a test found."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    adapts = any(run.rig[f"compensation.{part}"] for part in ("adaptive", "guard", "supply_correction"))
    if adapts and run.rig["compensation.mode"] == "linear":
        raise ValueError(
            'compensation.mode = "linear": must be "nonlinear" for a flow table to be found: '
            "the linear scheme uses none"
        )
    valve = run.rig.plant["servovalve"]
    return run.rig.replace(
        {
            "truth.servovalve.flow_table": None,
            "calibration": None,
            "servovalve.true_flow_table": valve.get("true_flow_table", valve["flow_table"]),
            "servovalve.flow_table.flows": run.found_flows.tolist(),
        }
    )
