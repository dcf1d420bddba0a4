"""The report of a study: the outcomes of its tests, and their dependence on the settings."""

from __future__ import annotations

import html
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eft._files import write_text
from eft._finding import GRADES
from eft._findings import worst
from eft._native import Rig
from eft._study import Study
from eft._study._rows import Column
from eft._study._summary import SHOWN, reasons, summary
from eft._verdict import FORCE_ERROR, SPOOL_ADVICE
from eft.report._charts import MOST, Page, cycle
from eft.report._page import HINT, html_table, reporter, whole_page
from eft.report._ranking import ranking

_WORST = 10
"""Number of tests in the table of the worst."""
_GROUPS = 6
"""Number of groups with a color."""
_UNUSABLE = "#b00020"


def write_study_report(
    study: Study, path: str | PathLike[str], title: str = "Study of effective force tests"
) -> Path:
    """Write the report of a study, finished or not, as one HTML file that loads nothing from a network.

    It says how many tests ended in which way and why. It shows force error and spool opening over each
    setting and their distribution, and lists the worst tests. It ends with the configuration and the
    versions. The file is written under another name and then renamed.

    Parameters
    ----------
    study : Study
        The study.
    path : path-like
        The HTML file.
    title : str
        Heading of the page.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    ValueError
        If the study has no rows yet.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eft
    >>> from eft.report import write_study_report
    >>> sweep = eft.sine_sweep(2000.0, 0.5, 4.0, 1.0, 512.0)
    >>> study = eft.study(eft.Rig.zhao2005(), sweep, {"compensation.level": [0.9, 1.0]}, progress=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_study_report(study, pathlib.Path(folder) / "study.html").name
    'study.html'
    """
    if not len(study):
        raise ValueError("the study has no rows yet: a report needs at least one")
    target = Path(path)
    write_text(target, _page(study, title))
    return target


@np.errstate(over="ignore", invalid="ignore")  # a file may hold any number
def _page(study: Study, title: str) -> str:
    told = summary(study)
    charts = Page()
    _draw(study, charts)
    parts = [
        _verdict(study),
        "<h2>How the tests ended</h2>",
        html_table(["status", "tests"], [[word, str(n)] for word, n in told["status"].items()]),
        *_reasons(study),
        "<h2>Metrics of the completed tests</h2>",
        html_table(["", "median", "95 %", "largest", "in test"], _metrics(told)),
        "<h2>What matters</h2>",
        *_ranking(study),
        "<h2>What depends on what</h2>",
        HINT,
        *charts.figures,
        f"<h2>The {_WORST} worst</h2>",
        html_table(*_worst(study)),
        "<h2>Configuration</h2>",
        *_configuration(study),
        "<h2>Versions</h2>",
        f"<p>Simulated by eft {html.escape(told['version'])}, controller in "
        f"{html.escape(study.description['dtype'])}. "
        f"{html.escape(reporter())}</p>",
    ]
    return whole_page(title, parts, charts)


def _verdict(study: Study) -> str:
    completed = study["status"] == "completed"
    whole = int(completed.sum())
    good = int(((study["nrmse"] <= FORCE_ERROR) & (study["max_spool"] <= SPOOL_ADVICE) & completed).sum())
    told = ""
    if _judged(study):
        count = ", ".join(f"{int((study['verdict'] == grade).sum())} {grade}" for grade in GRADES)
        told = f"Verdict: {count}. "
    text = (
        f"{told}{len(study)} of {study.tests} tests; {whole} of them completed; {good} with a "
        f"force error up to {FORCE_ERROR:.0%} (rms) and a spool opening up to {SPOOL_ADVICE:.0%}."
    )
    kind = "" if good == len(study) else " concern" if whole == len(study) else " unusable"
    if _judged(study):
        worst_grade = worst(study["verdict"].tolist())
        kind = {"go": "", "caution": " concern", "no": " unusable"}[worst_grade]
    return f'<div class="verdict{kind}">{html.escape(text)}</div>'


def _judged(study: Study) -> bool:
    """Whether the tests have verdicts, which older studies do not have."""
    return any(column.name == "verdict" for column in study.columns)


def _reasons(study: Study) -> list[str]:
    found = reasons(study)
    if not found:
        return []
    items = "".join(f"<li>{number} × {html.escape(reason)}</li>" for reason, number in found[:_WORST])
    rest = len(found) - _WORST
    return [f"<ul>{items}</ul>", f"<p>and {rest} other reasons</p>" if rest > 0 else ""]


def _metrics(told: dict[str, Any]) -> list[list[str]]:
    rows = []
    for name, (words, form, scale) in SHOWN.items():
        if numbers := told["metrics"].get(name):
            cells = [form.format(numbers[key] * scale) for key in ("median", "95%", "largest")]
            rows.append([words, *cells, str(numbers["test"])])
    return rows


def _ranking(study: Study) -> list[str]:
    found = ranking(study)
    if not found:
        return ["<p>Too few completed tests for a ranking of the settings.</p>"]
    words = {column.name for column in study.columns if column.type in ("str", "bool", "list")}
    rows = [
        [name, f"{told:.2f}" if name in words else f"{told:+.2f}", str(tests)] for name, told, tests in found
    ]
    note = (
        "Rank correlation of each setting with the force error of the completed tests, from -1 to 1. "
        "For words, switches and lists it has no sign."
    )
    return [html_table(["setting", "rank correlation", "tests"], rows), f'<p class="note">{note}</p>']


def _worst(study: Study) -> tuple[list[str], list[list[str]]]:
    ended = np.where(study["status"] == "completed", study["nrmse"], np.inf)
    order = np.argsort(-np.nan_to_num(ended, nan=np.inf), kind="stable")[:_WORST]
    several = len(study.description["commands"]) > 1
    names = ["index", *(["command"] if several else []), *study.parameters, "status", "nrmse", "max_spool"]
    if _judged(study):
        names.insert(names.index("status"), "verdict")
    columns = {name: study[name] for name in names}
    rows = [[_cell(name, columns[name][place]) for name in names] for place in order]
    shown = {"index": "test", "nrmse": "force error", "max_spool": "spool opening"}
    return [shown.get(name, name) for name in names], rows


def _cell(name: str, value: Any) -> str:
    if value is None or value != value:
        return "–"
    if name in _DRAWN:
        return f"{value:.1%}"
    return f"{value:.5g}" if isinstance(value, float) else str(value)


_DRAWN = {
    "nrmse": ("force error", FORCE_ERROR, f"{FORCE_ERROR:.0%}: worth a look"),
    "max_spool": ("spool opening", SPOOL_ADVICE, f"{SPOOL_ADVICE:.0%} advised"),
}


def _draw(study: Study, page: Page) -> None:
    settings = [column for column in study.columns if column.name in study.parameters]
    every = -(-len(study) // MOST)
    columns = {name: study[name][::every] for name in ("command", "status", *study.parameters, *_DRAWN)}
    completed = columns["status"] == "completed"
    words = [setting.name for setting in settings if setting.type in ("str", "bool")]
    groups = _groups(columns, [*words, "command"])
    for name in _DRAWN:
        _sorted(page, name, columns, completed, groups)
        for setting in settings:
            if setting.type in ("float", "int") and np.unique(columns[setting.name]).size > 1:
                _over(page, setting, name, columns, completed, groups)


_Columns = dict[str, NDArray[Any]]
_Groups = dict[str, tuple[str, NDArray[np.bool_]]]
"""The groups by name: a color and the tests of the group."""


def _groups(columns: _Columns, words: list[str]) -> _Groups:
    """The tests grouped by the first setting in words with few values, or all in one group."""
    for name in words:
        values = [value for value in dict.fromkeys(columns[name].tolist()) if value is not None]
        if 1 < len(values) <= _GROUPS:
            colors = cycle(len(values))
            return {str(v): (c, columns[name] == v) for v, c in zip(values, colors, strict=True)}
    return {"all": (cycle(1)[0], np.ones(columns["status"].size, dtype=np.bool_))}


def _sorted(page: Page, name: str, columns: _Columns, completed: NDArray[np.bool_], groups: _Groups) -> None:
    words, limit, label = _DRAWN[name]
    series = []
    for group, (color, inside) in groups.items():
        values = columns[name][inside & completed]
        ordered = np.sort(values[np.isfinite(values)]) * 100.0
        if ordered.size:
            share = 100.0 * (np.arange(ordered.size) + 1) / ordered.size
            series.append(page.curve(group, color, share, ordered))
    if series:
        labels = ("share of the completed tests up to there (%)", f"{words} (%)")
        rules = [{"y": limit * 100.0, "label": label}]
        page.add(f"{words.capitalize()}, sorted", labels, series, rules=rules, box=True)


def _over(
    page: Page, setting: Column, name: str, columns: _Columns, completed: NDArray[np.bool_], groups: _Groups
) -> None:
    """One metric over one setting; incomplete tests are in a row above the others."""
    words, limit, label = _DRAWN[name]
    x, y = columns[setting.name].astype(np.float64), columns[name] * 100.0
    known = np.isfinite(x)
    told = completed & np.isfinite(y) & known
    series = [
        page.points(group, color, x[inside & told], y[inside & told])
        for group, (color, inside) in groups.items()
        if (inside & told).any()
    ]
    if (lost := ~told & known).any():
        above = 1.1 * float(np.max(y[told], initial=limit * 100.0))
        series.append(page.points("no whole test", _UNUSABLE, x[lost], np.full(int(lost.sum()), above)))
    if series:
        unit = f" ({setting.unit})" if setting.unit else ""
        labels = (f"{setting.name}{unit}", f"{words} (%)")
        rules = [{"y": limit * 100.0, "label": label}]
        page.add(f"{words.capitalize()} over {setting.name}", labels, series, rules=rules, box=True)


def _configuration(study: Study) -> list[str]:
    about = study.description
    lines = [
        f"command {name}: {one['samples']} samples at {one['sample_rate']:g} Hz"
        for name, one in about["commands"].items()
    ]
    drawn = about["parameters"]
    lines.append(f"parameters: {drawn['kind']}" + (f", seed {drawn['seed']}" if "seed" in drawn else ""))
    lines += [f"{key} = {_short(values)}" for key, values in drawn.get("values", {}).items()]
    rig = Rig.from_dict(about["rig"]).to_toml()
    text = "\n".join(lines)
    return [
        f"<pre>{html.escape(text)}</pre>",
        "<p>Each test changes some values of this rig:</p>",
        f"<pre>{html.escape(rig.strip())}</pre>",
    ]


def _short(values: Any) -> str:
    if isinstance(values, dict):
        return f"{values['low']:g} to {values['high']:g}" + (", in the logarithm" if values["log"] else "")
    shown = ", ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in values[:12])
    return shown if len(values) <= 12 else f"{shown}, … {len(values)} values"
