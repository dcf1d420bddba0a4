"""The influence of a study's settings: rank correlation with the force error."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from eft._study import Study

Array = NDArray[np.float64]


def ranking(study: Study, metric: str = "nrmse") -> list[tuple[str, float, int]]:
    """Setting, rank correlation of its values with the metric, and number of tests; the strongest first.

    For numbers it is Spearman's, from -1 to 1. For words, switches and lists it is the correlation ratio of
    the ranks, from 0 to 1. Only completed tests count.
    """
    completed = (study["status"] == "completed") & np.isfinite(study[metric])
    error = study[metric][completed]
    if error.size < 3:
        return []
    kinds = {column.name: column.type for column in study.columns}
    found = []
    for name in study.parameters:
        values = study[name][completed]
        if kinds[name] == "list":
            values = np.array([str(value) for value in values])
        if len(set(values.tolist())) < 2:
            continue
        numbers = kinds[name] in ("float", "int")
        told = _spearman(values.astype(np.float64), error) if numbers else _ratio(values, error)
        if np.isfinite(told):
            found.append((name, told, int(error.size)))
    return sorted(found, key=lambda row: -abs(row[1]))


def _ranks(values: Array) -> Array:
    """Ranks from 0; equal values have the mean of their ranks."""
    _, inverse, counts = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    mean: Array = (last - 0.5 * (counts + 1))[inverse]
    return mean


def _spearman(values: Array, error: Array) -> float:
    known = np.isfinite(values)
    if np.count_nonzero(known) < 3:
        return float("nan")
    one, other = _ranks(values[known]), _ranks(error[known])
    if np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return float("nan")
    return float(np.corrcoef(one, other)[0, 1])


def _ratio(values: NDArray[Any], error: Array) -> float:
    ranks = _ranks(error)
    total = float(((ranks - ranks.mean()) ** 2).sum())
    if total == 0.0:
        return float("nan")
    groups = [ranks[values == value] for value in set(values.tolist())]
    between = sum(group.size * float(group.mean() - ranks.mean()) ** 2 for group in groups)
    return float(np.sqrt(between / total))
