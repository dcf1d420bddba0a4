"""The charts of a report: data as text in the page, style as JSON."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eft._display import shown
from eft._native import Command
from eft._run import TestRun
from eft._signals import commands, endings, energy_edge, restoring_force
from eft._simulate import ideal_response
from eft._verdict import SPOOL_ADVICE
from eft.traces import Traces

Array = NDArray[np.float64]

MOST = 16384
"""Largest number of points of a curve."""

_LEAST = 4096
"""The same if many tests or actuators share the charts: two per pixel of a wide screen."""

_WEAKEST = 0.05
"""Share of the command's largest amplitude below which no ratio is shown."""

COMMAND_COLOR = "#9a9a9a"
"""Color of commands and configured values."""
_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


@dataclass
class Page:
    """Charts and their data, collected."""

    figures: list[str] = field(default_factory=list)
    data: list[str] = field(default_factory=list)
    thinned: int = 1
    """Samples per pair of extremes in the longest curve; 1 if no curve was thinned."""
    most: int = MOST
    """Points of one curve over time."""
    marks: list[dict[str, Any]] = field(default_factory=list)
    """Times at which tests ended early, with the cause, for every chart over time."""
    _names: dict[bytes, str] = field(default_factory=dict)

    def store(self, values: Array) -> str:
        """Store an array in the page and return its id. Single precision is enough for a chart."""
        whole = np.asarray(values, dtype="<f4").tobytes()
        if whole not in self._names:
            self._names[whole] = name = f"d{len(self.data)}"
            text = base64.b64encode(whole).decode("ascii")
            self.data.append(f'<script type="text/plain" id="{name}">{text}</script>')
        return self._names[whole]

    def history(
        self, label: str, color: str, values: Array, run: TestRun | Traces, width: float = 1.2
    ) -> dict[str, Any]:
        """A curve over time."""
        thin, step = _thin(values, self.most)
        self.thinned = max(self.thinned, step)
        pace = (step / 2 if step > 1 else 1) / run.sample_rate
        x = {"start": 0.0, "step": pace}
        return {"label": label, "color": color, "width": width, "x": x, "y": self.store(thin)}

    def curve(self, label: str, color: str, x: Array, y: Array) -> dict[str, Any]:
        """A curve over another quantity."""
        return {"label": label, "color": color, "width": 1.2, "x": self.store(x), "y": self.store(y)}

    def points(self, label: str, color: str, x: Array, y: Array) -> dict[str, Any]:
        """Separate points."""
        return self.curve(label, color, x, y) | {"points": True}

    def add(self, title: str, labels: tuple[str, str], series: list[dict[str, Any]], **spec: Any) -> None:
        """A figure with its legend."""
        named = [s for s in series if not s["label"].startswith("_")]
        # The title names a single curve.
        keys = (
            ""
            if len(named) < 2
            else "".join(
                f'<span class="{"key dot" if s.get("points") else "key"}" '
                f'style="--c:{s["color"]};--s:{s.get("dash") or "solid"}">'
                f"{html.escape(s['label'])}</span>"
                for s in named
            )
        )
        whole = {
            "xlabel": labels[0],
            "ylabel": labels[1],
            "rules": [],
            "marks": self.marks if spec.get("link") == "time" else [],
            "link": None,
            "box": False,
            "square": False,
        } | spec
        chart = html.escape(json.dumps(whole | {"series": series}), quote=True)
        kind = ' class="square"' if whole["square"] else ""
        name = html.escape(title)
        self.figures.append(
            f'<figure{kind} data-chart="{chart}">'
            f"<figcaption><b>{name}</b>{keys}<output></output></figcaption>"
            f'<canvas role="img" aria-label="{name}"></canvas></figure>'
        )


def draw(runs: Mapping[str, TestRun]) -> Page:
    """Every chart of one or several runs under the same command."""
    marks = [{"x": time, "label": words} for time, words in endings(runs)]
    page = Page(most=max(MOST // len(runs), _LEAST), marks=marks)
    colors = dict(zip(runs, cycle(len(runs)), strict=True))

    force, length, velocity, pressure = (shown(name) for name in ("force", "length", "velocity", "pressure"))

    def over_time(name: str, scale: float = 1.0) -> list[dict[str, Any]]:
        return [page.history(k, colors[k], getattr(r, name) * scale, r) for k, r in runs.items()]

    def add(title: str, words: str, unit: str, series: list[dict[str, Any]], **spec: Any) -> None:
        page.add(title, ("time (s)", f"{words} ({unit})"), series, link="time", **spec)

    wanted = [
        page.history(label, COMMAND_COLOR, run.command * force.factor, run, width=2.4)
        for label, run in commands(runs)
    ]
    floors = [run for run in runs.values() if run._building]
    if len(floors) == len(runs) > 1:
        _multiples(page, runs, colors)
    else:
        add("Force", "force", force.unit, [*wanted, *over_time("force", force.factor)])
    error = [page.history(k, colors[k], (r.force - r.command) * force.factor, r) for k, r in runs.items()]
    add("Force error: force less command", "force error", force.unit, error)
    moved = over_time("displacement", length.factor)
    if not floors:
        moved = [*ideals(page, commands(runs)), *moved]
    add("Displacement", "displacement", length.unit, moved)
    add("Velocity", "velocity", velocity.unit, over_time("velocity", velocity.factor))
    advice = [
        {"y": sign * SPOOL_ADVICE * 100, "label": f"{SPOOL_ADVICE:.0%} advised" if sign > 0 else ""}
        for sign in (1, -1)
    ]
    add("Spool opening", "spool opening", "%", over_time("spool", 100), rules=advice)
    add("Valve command", "valve command", "V", over_time("valve_command"))
    add("Load pressure", "load pressure", pressure.unit, over_time("load_pressure", pressure.factor))
    if any(np.ptp(run.supply_pressure) > 0.0 for run in runs.values()):
        set_to = sorted({run.rig["supply.pressure"] * pressure.factor for run in runs.values()})
        rules = [{"y": level, "label": "as configured"} for level in set_to]
        supplied = over_time("supply_pressure", pressure.factor)
        add("Supply pressure", "supply pressure", pressure.unit, supplied, rules=rules)
    _ratio(page, runs, colors)
    _hysteresis(page, runs, colors)
    return page


def ideals(page: Page, judged: Sequence[tuple[str, TestRun]]) -> list[dict[str, Any]]:
    """The ideal response to each command."""
    curves = []
    for label, run in judged:
        ideal = ideal_response(run.rig, Command(run.command, run.sample_rate)).displacement
        name = label.replace("commands", "ideal").replace("command", "ideal")
        curves.append(page.history(name, COMMAND_COLOR, ideal * shown("length").factor, run, width=2.4))
    return curves


def _multiples(page: Page, runs: Mapping[str, TestRun], colors: Mapping[str, str]) -> None:
    """A small chart of the force for each actuator of a building."""
    force, length = shown("force"), shown("length")
    page.figures.append('<div class="multiples">')
    for name, run in runs.items():
        wanted = page.history("command", COMMAND_COLOR, run.command * force.factor, run, width=2.4)
        given = page.history("force", colors[name], run.force * force.factor, run)
        page.add(f"Force, {name}", ("time (s)", f"force ({force.unit})"), [wanted, given], link="time")
    for (name, run), ideal in zip(runs.items(), _ideal_floors(runs), strict=True):
        curve = page.history("ideal", COMMAND_COLOR, ideal * length.factor, run, width=2.4)
        moved = page.history("test", colors[name], run.displacement * length.factor, run)
        labels = ("time (s)", f"displacement ({length.unit})")
        page.add(f"Displacement, {name}", labels, [curve, moved], link="time")
    page.figures.append("</div>")


def _ideal_floors(runs: Mapping[str, TestRun]) -> Iterator[Array]:
    """For each actuator of buildings the ideal displacement of its floor."""
    found: dict[int, Array] = {}
    for run in runs.values():
        if run._building is not None:
            base, index = run._building
            if id(base) not in found:
                command = Command(base.command, base.sample_rate)
                found[id(base)] = ideal_response(base.rig, command).displacement
            yield found[id(base)][index]


def _ratio(page: Page, runs: Mapping[str, TestRun], colors: Mapping[str, str]) -> None:
    series = []
    for name, run in runs.items():
        if run.command.any() and len(run) > 2:
            amplitude = np.abs(np.fft.rfft(run.command))
            frequency, ratio = run.fft_ratio(*_band(amplitude, run))
            # The ratio is meaningless where the command is almost zero.
            bins = np.rint(frequency * len(run) / run.sample_rate).astype(int)
            told = amplitude[bins] > _WEAKEST * amplitude[1:].max()
            if np.count_nonzero(told) > 1:
                series.append(page.curve(name, colors[name], frequency[told][:MOST], ratio[told][:MOST]))
    if series:
        rules = [{"y": 1.0, "label": "force = command"}]
        labels = ("frequency (Hz)", "|FFT(force)| / |FFT(command)|")
        page.add(
            "Force over command, at the frequencies that the command excites", labels, series, rules=rules
        )


def _band(amplitude: Array, run: TestRun) -> tuple[float, float]:
    """From above zero to the frequency below which 99 % of the command's energy lies, Hz."""
    bin_width = run.sample_rate / len(run)
    high = (energy_edge(amplitude[1:] ** 2) + 2) * bin_width
    return bin_width / 2, min(high, run.sample_rate / 2)


def _hysteresis(page: Page, runs: Mapping[str, TestRun], colors: Mapping[str, str]) -> None:
    across, up = shown("length"), shown("force")
    series = []
    for name, run in runs.items():
        if len(run) < 3 or run.rig["structure.kind"] == "shear_building":
            continue
        structure = run.rig.plant["structure"]
        force = restoring_force(run, structure["mass"], structure["damping"])
        every = -(-len(run) // (MOST // 2))
        x, y = run.displacement[::every] * across.factor, force[::every] * up.factor
        series.append(page.curve(name, colors[name], x, y))
    if series:
        labels = (f"displacement ({across.unit})", f"restoring force ({up.unit})")
        page.add("Restoring force of the structure", labels, series, box=True, square=True)


def _thin(values: Array, most: int) -> tuple[Array, int]:
    """Lowest and highest value of each interval, in their order; a short curve is unchanged."""
    if values.size <= most:
        return values, 1
    step = -(-values.size // (most // 2))
    whole = np.concatenate([values, np.full(-values.size % step, values[-1])]).reshape(-1, step)
    low, high = whole.argmin(axis=1), whole.argmax(axis=1)
    rows = np.arange(whole.shape[0])
    return np.stack(
        [whole[rows, np.minimum(low, high)], whole[rows, np.maximum(low, high)]], axis=1
    ).ravel(), step


def cycle(count: int) -> list[str]:
    """A number of colors; the first ones differ most."""
    return [_COLORS[i % len(_COLORS)] for i in range(count)]
