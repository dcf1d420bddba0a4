"""The page of a report."""

from __future__ import annotations

import base64
import hashlib
import html
import math
import platform
import re
from collections.abc import Mapping, Sequence
from importlib import metadata, resources
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from eft._display import Shown, shown
from eft._files import write_text
from eft._native import __version__
from eft._run import TestRun
from eft._signals import labelled
from eft._table import Metrics
from eft._verdict import told_delay
from eft.report._charts import Page, draw
from eft.report._estimates import draw_estimates
from eft.report._heading import about, verdicts, wholes
from eft.report._measured import compared, draw_measured
from eft.report._planned import planned
from eft.traces import Comparison, Traces

if TYPE_CHECKING:
    from eft._table import MetricName

_METRICS: dict[MetricName, tuple[str, float, str]] = {
    "nrmse": ("force error, rms over rms of the command", 100.0, "%"),
    "nrmse_delay_removed": ("the same without the delay", 100.0, "%"),
    "nrmse_bias_free": ("the same without the offset", 100.0, "%"),
    "peak_error": ("largest force error over the largest command", 100.0, "%"),
    "oscillation": ("oscillation of the oil column, 30 to 150 Hz", 100.0, "%"),
    "delay": ("delay of the force", 1e3, "ms"),
    "fei_amplitude": ("evaluation index: amplitude", 1.0, ""),
    "fei_delay": ("evaluation index: delay", 1e3, "ms"),
    "fei_frequency": ("evaluation index: frequency", 1.0, "Hz"),
    "tracking_indicator": ("tracking indicator, negative when the force lags", 1.0, "N²"),
    "displacement_error": ("displacement error against the ideal response, rms", 100.0, "%"),
    "max_spool": ("largest spool opening", 100.0, "%"),
    "min_supply_pressure": ("smallest supply pressure", 1.0, "Pa"),
    "drift": ("largest drift of the story", 1.0, "m"),
}


def write_report(
    runs: TestRun | Mapping[str, TestRun],
    path: str | PathLike[str],
    title: str = "Effective force test",
    *,
    measured: Mapping[str, Traces] | None = None,
) -> Path:
    """Write a report of one or several tests as one HTML file.

    The report marks tests with different commands. The actuators of a shear building are shown like separate
    tests.

    The report has the verdict with reasons and remedies, the metrics, and time histories with the ideal
    response and a zoom. It has the ratio of force to command over the frequency, and the spool opening with
    the advised limit of 60 %. It has the restoring force, and the supply pressure if it changes. For a rig
    that adapts it has the estimates of flow gain, valve gain, level, response delay and flow curve. Demands,
    margins, configuration and versions follow. A table and charts compare each test of `measured` with the
    first run, aligned in time. The page uses no network. It is written under a temporary name and renamed.

    Parameters
    ----------
    runs : TestRun or mapping of str to TestRun
        The tests, by name if there are several.
    path : path-like
        The HTML file.
    title : str
        Heading of the page.
    measured : mapping of str to Traces, optional
        Measured tests, by name.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    TypeError
        If it is no run, such as a list or a study, for which there is `write_study_report`.
    ValueError
        If there is no run; if a measured test has no signal in common with the run.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eft
    >>> from eft.report import write_report
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 4.0, 1.0, 512.0))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_report(run, pathlib.Path(folder) / "run.html").name
    'run.html'
    """
    named = labelled(runs, alone="test")
    if not named:
        raise ValueError("runs is empty: a report needs at least one run")
    target = Path(path)
    notes = [f'<p class="note">{DIFFERENT}</p>'] if commands_differ(runs) else []
    write_text(target, _page(named, title, notes, compared(named, measured or {})))
    return target


DIFFERENT = "These tests have different commands or sample rates: each is judged by its own."


def commands_differ(runs: TestRun | Mapping[str, TestRun]) -> bool:
    """Whether tests have different commands or sample rates; one that ended early has only the first part."""
    first, *others = runs.values() if isinstance(runs, Mapping) else [runs]

    def differs(other: TestRun) -> bool:
        shared = min(len(first), len(other))
        alike = np.array_equal(first.command[..., :shared], other.command[..., :shared])
        return first.sample_rate != other.sample_rate or not alike

    return any(differs(other) for other in others)


@np.errstate(over="ignore", invalid="ignore")  # a file may hold any number
def _page(
    runs: Mapping[str, TestRun], title: str, notes: Sequence[str], over: Mapping[str, Comparison]
) -> str:
    charts = draw(runs)
    draw_estimates(charts, runs)
    draw_measured(charts, over)
    tested = wholes(runs)
    parts = [
        *notes,
        html_table(["", *(tested if len(tested) > 1 else [""])], about(tested), "about"),
        *verdicts(tested),
        "<h2>Metrics</h2>",
        html_table(["", *runs], _metrics(list(runs.values()))),
        *(_measured(title, one) for title, one in over.items()),
        "<h2>Signals</h2>",
        HINT,
        _thinned(charts),
        *charts.figures,
        *_planned(runs),
        "<h2>Configuration</h2>",
        *_configuration(runs),
        "<h2>Versions</h2>",
        f"<p>{html.escape(_versions(list(runs.values())))}</p>",
    ]
    return whole_page(title, parts, charts)


def _measured(title: str, one: Comparison) -> str:
    header, *rows = one.table()
    moved = f"Moved by {-one.shift:.6g} s, by the {one.aligned_by}."
    return f"<h2>{html.escape(title)}</h2>{html_table(header, rows)}<p>{html.escape(moved)}</p>"


POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
"""The security policy of the page: the browser may only display it."""

HINT = '<p class="hint">Drag to zoom, double-click to see all. <button id="reset">Show all</button></p>'


def whole_page(title: str, parts: Sequence[str], charts: Page) -> str:
    """Title, parts, data and script as one file."""
    here = resources.files("eft.report")
    style, script = (here.joinpath(name).read_text(encoding="utf-8") for name in ("page.css", "chart.js"))
    # Only this script may run, even if a name or a value contains another.
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    policy = f"{POLICY}; script-src 'sha256-{digest}'"
    body = [f"<h1>{html.escape(title)}</h1>", *parts, *charts.data, f"<script>{script}</script>"]
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        # Nothing is loaded, not even the icon that browsers request.
        '<link rel="icon" href="data:,">'
        f"<title>{html.escape(title)}</title><style>{style}</style></head><body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


def _metrics(runs: Sequence[TestRun]) -> list[list[str]]:
    judged = [run.to_its_end() for run in runs]
    found = [_told(run.metrics()) if run.command.any() else {} for run in judged]
    rows = []
    if any(len(part) < len(run) for part, run in zip(judged, runs, strict=True)):
        rows.append(["the test ended after; up to there:", *(_number(part.duration, "s") for part in judged)])
    force, length, pressure = shown("force"), shown("length"), shown("pressure")
    squared = Shown(f"{force.unit}²", force.factor**2)
    in_units = {"N²": squared, "Pa": pressure, "m": length}
    for key, (words, own, si) in _METRICS.items():
        # The drift of one mass is its displacement.
        if key == "drift" and not any(run._building for run in runs):
            continue
        unit, scale = in_units.get(si, Shown(si, own))
        if any(key in metrics for metrics in found):
            cells = [_number(metrics.get(key, math.nan) * scale, unit) for metrics in found]
            rows.append([words, *cells])
    moved = (float(abs(run.displacement).max()) * length.factor for run in judged)
    rows.append(["largest displacement", *(_number(value, length.unit) for value in moved)])
    for signal in ("force", "command"):
        largest = (float(abs(getattr(r, signal)).max()) * force.factor for r in judged)
        rows.append([f"largest {signal}", *(_number(value, force.unit) for value in largest)])
    rows.append(["duration of the command", *(_number(r.duration, "s") for r in runs)])
    return rows


def _planned(runs: Mapping[str, TestRun]) -> list[str]:
    parts = []
    for title, header, rows in planned(runs):
        parts += [f"<p>{html.escape(title)}:</p>"] if title else []
        parts.append(html_table(header, rows))
    return ["<h2>Feasibility and margins</h2>", *parts] if parts else []


def _told(metrics: Metrics) -> dict[str, float]:
    return {str(name): value for name, value in metrics.items()} | {"delay": float(told_delay(metrics))}


def _number(value: float, unit: str) -> str:
    return "–" if math.isnan(value) else f"{value:.4g} {unit}".rstrip()


def html_table(header: Sequence[str], rows: Sequence[Sequence[str]], kind: str = "") -> str:
    """A table of plain text; `kind` is its class."""
    # Keys may break at dots and underscores, so that the other columns fit on narrow screens.
    broken = (re.sub(r"([._])(?=\w)", r"\1<wbr>", html.escape(cell)) for cell in header)
    head = "".join(f"<th>{cell}</th>" for cell in broken)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in row) + "</tr>" for row in rows)
    opening = f'<table class="{kind}">' if kind else "<table>"
    return f"{opening}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _thinned(charts: Page) -> str:
    if charts.thinned == 1:
        return ""
    return (
        f'<p class="note">The longest histories show the extremes of each {charts.thinned} samples; '
        "the metrics are those of all samples.</p>"
    )


def _configuration(runs: Mapping[str, TestRun]) -> list[str]:
    """The complete first rig, and the differences of the others from it."""
    (name, first), *others = runs.items()
    base = _flat(first.rig.to_dict())
    alike = [name, *(other for other, run in others if run.rig == first.rig)]
    parts = [f"<p>{html.escape(', '.join(alike))}:</p>"] if others else []
    parts.append(f"<pre>{html.escape(first.rig.to_toml().strip())}</pre>")
    for other, run in others:
        if other in alike:
            continue
        keys = _flat(run.rig.to_dict())
        changed = [k for k in sorted(base | keys) if base.get(k) != keys.get(k)]
        lines = "\n".join(f"{key} = {keys.get(key, '(absent)')}" for key in changed)
        parts.append(f"<p>{html.escape(other)}, where it differs:</p><pre>{html.escape(lines)}</pre>")
    return parts


def _flat(tree: Mapping[str, object], prefix: str = "") -> dict[str, object]:
    answer: dict[str, object] = {}
    for key, value in tree.items():
        if isinstance(value, Mapping):
            answer |= _flat(value, f"{prefix}{key}.")
        else:
            answer[prefix + key] = value
    return answer


def _versions(runs: Sequence[TestRun]) -> str:
    simulated = ", ".join(dict.fromkeys(run.version for run in runs))
    precision = ", ".join(dict.fromkeys(run.dtype for run in runs))
    rates = ", ".join(dict.fromkeys(f"{run.sample_rate:g}" for run in runs))
    return f"Simulated by eft {simulated}, controller in {precision} at {rates} Hz. {reporter()}"


def reporter() -> str:
    """The software that wrote the report."""
    return (
        f"Report by eft {__version__}, Python {platform.python_version()}, "
        f"NumPy {metadata.version('numpy')}, {platform.system()} {platform.machine()}."
    )
