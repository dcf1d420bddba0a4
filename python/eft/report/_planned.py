"""Tables of a report: the demands of a test on its rig, and the stability of the loop."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from eft import _native
from eft._display import shown
from eft._feasibility import Demand
from eft._planning import StabilityMargins, stability_margins
from eft._run import TestRun
from eft.report._heading import wholes

_MOST = 4
"""Largest number of tests with separate tables, which would otherwise hide the charts."""


def planned(runs: Mapping[str, TestRun]) -> Iterator[tuple[str, list[str], list[list[str]]]]:
    """Title, header and rows of each table; a building has one table for all of its actuators."""
    whole = wholes(runs)
    alone = len(whole) == 1
    for name, run in list(whole.items())[:_MOST]:
        title = "" if alone else name
        if len(run) < 2 or not run.command.any():
            continue
        command = _native.Command(run.command, run.sample_rate)
        demands = [Demand(**one) for one in _native.demands(run.rig, command)]
        yield title, ["demand of the command", "", "advised", "capacity"], [_demand(one) for one in demands]
        try:
            rate = run.sample_rate
            margins = stability_margins(run.rig, sampled=True, sample_rate=rate, flow_gain="steeper")
        except ValueError:
            yield title, ["margin", "from", "to"], [["the linear model is unstable at any level", "–", "–"]]
        else:
            yield title, ["each alone, in the linear model", "from", "to"], _margins(margins)


def _demand(one: Demand) -> list[str]:
    unit = shown(one.unit or "ratio")
    return [one.name, *(unit(value) for value in (one.required, one.advised, one.available))]


def _margins(found: StabilityMargins) -> list[list[str]]:
    def span(words: str, low: float | None, high: float | None, scale: float, unit: str) -> list[str]:
        def cell(value: float | None) -> str:
            if value is None:
                return "–"
            return "any" if math.isinf(value) else f"{value * scale:.4g} {unit}".strip()

        return [words, cell(low), cell(high)]

    nothing: tuple[None, None] = (None, None)
    delay, flow = found.response_delay or nothing, found.flow_gain or nothing
    return [
        span("compensation level", 0.0, found.level, 1.0, ""),
        span("factor on the force loop", None, found.loop_gain, 1.0, ""),
        span("true flow gain over the configured one", flow[0], flow[1], 1.0, ""),
        span("response delay given to the controller", delay[0], delay[1], 1e3, "ms"),
        span("dead time in addition", 0.0, found.dead_time, 1e3, "ms"),
    ]
