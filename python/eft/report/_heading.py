"""The heading of a report: the test and its verdict."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from eft._display import shown
from eft._run import TestRun

_GRADES = {"go": ("", "Go"), "caution": (" concern", "Caution"), "no": (" unusable", "No")}


def wholes(runs: Mapping[str, TestRun]) -> dict[str, TestRun]:
    """The tests; the actuators of one building are one test."""
    found: dict[str, TestRun] = {}
    for name, run in runs.items():
        base = run._building[0] if run._building else run
        if not any(base is other for other in found.values()):
            found[name.rpartition(", ")[0] or "building" if run._building else name] = base
    return found


def about(runs: Mapping[str, TestRun]) -> list[list[str]]:
    """Record, scale, mass, rig and date of each test; empty rows are left out."""
    several = list(runs.values())
    rows = {
        "rig": [run.rig["name"] or "" for run in several],
        "ground motion": [run.record for run in several],
        "factor on it": ["" if run.scale is None else f"{run.scale:g}" for run in several],
        "mass": [_mass(run.mass) for run in several],
        "duration": [f"{run.duration:.4g} s" for run in several],
        "date": [run.date.replace("T", " ").replace("+00:00", " UTC") for run in several],
    }
    return [[words, *(cell or "–" for cell in cells)] for words, cells in rows.items() if any(cells)]


def _mass(mass: Any) -> str:
    unit = shown("mass")
    if mass is None:
        return ""
    return ", ".join(f"{one * unit.factor:g}" for one in np.atleast_1d(mass)) + f" {unit.unit}"


def verdicts(runs: Mapping[str, TestRun]) -> list[str]:
    """One box for each test: grade, reasons, remedies."""
    return [_box(name if len(runs) > 1 else "", run) for name, run in runs.items()]


def _box(name: str, run: TestRun) -> str:
    verdict = run.verdict
    kind, word = _GRADES[verdict.grade]
    head = f"{name}: {word}" if name else word
    parts = [f"<b>{html.escape(head)}</b>", _listed(verdict.reasons)]
    if verdict.remedies:
        keys = [
            f"<code>{html.escape(f'{one.key} = {json.dumps(one.value)}')}</code>" for one in verdict.remedies
        ]
        parts += ["<p>What may help:</p>", f"<ul>{''.join(f'<li>{key}</li>' for key in keys)}</ul>"]
    parts.append(f"<p>{html.escape(verdict.summary)}</p><small>{html.escape(run.message)}</small>")
    return f'<div class="verdict{kind}">{"".join(parts)}</div>'


def _listed(sentences: Sequence[str]) -> str:
    if not sentences:
        return ""
    return f"<ul>{''.join(f'<li>{html.escape(one)}</li>' for one in sentences)}</ul>"
