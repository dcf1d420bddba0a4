"""The samples of a test by trace."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eft._table import TRACES


class Samples(Mapping[str, NDArray[np.float64]]):
    """The traces of a test by name, from the outcome that Rust returns.

    Rust returns a trace of the learner as its changes. The samples are computed when the trace is first read,
    because a dozen traces that change once a window would otherwise take half of the memory.
    """

    def __init__(self, outcome: Mapping[str, Any]) -> None:
        """Keep the traces as they are."""
        self._traces: dict[str, Any] = {name: outcome[name] for name in TRACES if name in outcome}

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        trace: Any = self._traces[name]
        if isinstance(trace, list):
            shape = self._traces["command"].shape
            ends = [np.append(starts[1:], shape[-1]) for starts, _ in trace]
            rows = [
                np.repeat(values, end - starts) for (starts, values), end in zip(trace, ends, strict=True)
            ]
            trace = self._traces[name] = np.reshape(rows, shape)
        samples: NDArray[np.float64] = trace
        samples.setflags(write=False)
        return samples

    def __iter__(self) -> Iterator[str]:
        return iter(self._traces)

    def __len__(self) -> int:
        return len(self._traces)
