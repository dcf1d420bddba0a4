"""The summary of a study."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from eft._study._result import Study
from eft._table import Metrics
from eft._verdict import told_delay

SHOWN = {
    "nrmse": ("force error, rms over rms", "{:.2%}", 1.0),
    "peak_error": ("largest force error over largest command", "{:.2%}", 1.0),
    "delay": ("delay of the force, ms", "{:.2f}", 1e3),
    "max_spool": ("largest spool opening", "{:.1%}", 1.0),
}
"""Words, format and scale of the metrics in the summary."""


def summary(study: Study) -> dict[str, Any]:
    """Number of tests by status; median, 95 % quantile and maximum of each metric of the completed tests.

    A delay that is unknown, as `told_delay` has it, is not counted.
    """
    completed = study["status"] == "completed"
    metrics = {}
    delay = told_delay(Metrics({name: study[name] for name in ("delay", "nrmse_delay_removed")}))
    for name in SHOWN:
        values = (delay if name == "delay" else study[name])[completed]
        if np.isfinite(values).any():
            worst = int(np.nanargmax(np.abs(values)))
            metrics[name] = {
                "median": float(np.nanmedian(values)),
                "95%": float(np.nanpercentile(values, 95)),
                "largest": float(values[worst]),
                "test": int(study["index"][completed][worst]),
            }
    return {
        "version": study.description["version"],
        "tests": study.tests,
        "status": study.count(),
        "parameters": list(study.parameters),
        "metrics": metrics,
    }


def reasons(study: Study) -> list[tuple[str, int]]:
    """Reasons why tests were not completed, the most frequent first."""
    return Counter(reason for reason in study["error"] if reason is not None).most_common()
