"""Charts of a learning controller: estimates over time, and the learned flow curve."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from eft._display import shown
from eft._run import TestRun
from eft.report._charts import COMMAND_COLOR, Page, cycle

_ESTIMATES = (
    ("flow_gain_estimate", "flow gain", None),
    ("valve_gain_estimate", "valve gain", "dashed"),
    ("level", "level", "dotted"),
)


def draw_estimates(page: Page, runs: Mapping[str, TestRun]) -> None:
    """Draw the estimates and the learned curve of the runs that have them."""
    colors = dict(zip(runs, cycle(len(runs)), strict=True))
    adaptive = {name: run for name, run in runs.items() if run.rig["compensation.adaptive"]}
    guarded = {name: run for name, run in runs.items() if run.rig["compensation.guard"] or name in adaptive}
    gains: list[dict[str, Any]] = []
    alone = cycle(len(_ESTIMATES))
    for (trace, words, dash), hue in zip(_ESTIMATES, alone, strict=True):
        for name, run in (guarded if trace == "level" else adaptive).items():
            if trace not in run:
                continue  # a saved run of an older version
            # Each of several runs has its color, and each estimate its line style.
            label, color, style = (f"{name}: {words}", colors[name], dash)
            if len(guarded) == 1:
                label, color, style = words, hue, None
            gains.append(page.history(label, color, getattr(run, trace), run) | {"dash": style})
    if gains:
        rules = [{"y": 1.0, "label": "as configured"}]
        labels = ("time (s)", "over the configured (1)")
        page.add("Estimates of flow gain and valve gain, and level", labels, gains, link="time", rules=rules)
    if adaptive:
        for key, title in (("response_delay", "Response delay"), ("velocity_delay", "Velocity delay")):
            delays = [
                page.history(_label(name, runs), colors[name], getattr(run, f"{key}_estimate") * 1e3, run)
                for name, run in adaptive.items()
                if f"{key}_estimate" in run
            ]
            if not delays:
                continue
            configured = {run.rig[f"compensation.{key}"] for run in adaptive.values()}
            rules = [{"y": delay * 1e3, "label": "as configured"} for delay in configured]
            labels = ("time (s)", f"{title.lower()} (ms)")
            page.add(f"{title} that is compensated", labels, delays, link="time", rules=rules)
    _found(page, adaptive, colors)


def _label(name: str, runs: Mapping[str, object]) -> str:
    """A single run has no name."""
    return name if len(runs) > 1 else "found"


def _found(page: Page, runs: Mapping[str, TestRun], colors: Mapping[str, str]) -> None:
    """The learned flow curves and the configured ones."""
    curves: list[dict[str, Any]] = []
    ratios: list[dict[str, Any]] = []
    flow = shown("flow")
    known: list[dict[str, Any]] = []
    for name, run in runs.items():
        corrects = run.rig["compensation.adaptive"] and run.rig["compensation.curve_correction"]
        if run.rig["compensation.mode"] == "linear" or run.found_flows is None or not corrects:
            continue
        table = run.rig["servovalve.flow_table"]
        if table not in known:
            known.append(table)
        openings, flows = np.asarray(table["openings"]) * 100, np.asarray(table["flows"])
        label = _label(name, colors)
        curves.append(page.curve(label, colors[name], openings, run.found_flows * flow.factor))
        moved = flows != 0.0
        ratio = run.found_flows[moved] / flows[moved]
        ratios.append(page.points(label, colors[name], openings[moved], ratio))
    if not curves:
        return
    given = [
        page.curve(
            "as configured",
            COMMAND_COLOR,
            np.asarray(table["openings"]) * 100,
            np.asarray(table["flows"]) * flow.factor,
        )
        | {"width": 2.4}
        for table in known
    ]
    labels = ("spool opening (%)", f"no-load flow ({flow.unit})")
    page.add("Flow curve as found by the end", labels, [*given, *curves])
    labels = ("spool opening (%)", "flow over the configured (1)")
    rules = [{"y": 1.0, "label": "as configured"}]
    page.add("Flow found over the configured flow", labels, ratios, rules=rules)
