"""Samplers: points distributed over ranges of settings."""

from __future__ import annotations

import hashlib
import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft._extras import need
from eft._native import Rig
from eft._study._values import Changes, Kind, Value, kind_of, plain

Bound = float | str
Range = tuple[Bound, Bound] | tuple[Bound, Bound, str] | Sequence[Any]


class _Span(NamedTuple):
    low: float
    high: float
    log: bool

    def at(self, place: float) -> float:
        """The value at a position from 0 to 1."""
        if self.log:
            return self.low * math.exp(place * math.log(self.high / self.low))
        return self.low + (self.high - self.low) * place


@dataclass(frozen=True)
class Sampler:
    """Points distributed over ranges of dotted keys.

    The value of a key is ``(low, high)`` for an even distribution, or ``(low, high, "log")`` for an even
    distribution of the logarithm. The entries of a list are equally frequent. The same seed gives the same
    points.
    """

    ranges: Mapping[str, Range]
    """The range or list of each dotted key, in SI units or as texts with a unit."""
    n: int
    """Number of points."""
    seed: int = 0
    """Seed of the points. The seed of the sensors' noise is the key ``sensors.seed``."""

    def __post_init__(self) -> None:
        if not isinstance(self.ranges, Mapping) or not self.ranges:
            raise ValueError(f"ranges = {self.ranges!r}: must be a mapping that names at least one key")
        for name, least, most in (("n", 1, 10_000_000), ("seed", 0, 2**63 - 1)):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
                raise ValueError(f"{name} = {value!r}: must be a whole number from {least} to {most}")

    @abstractmethod
    def _points(self) -> NDArray[np.float64]:
        """`n` points of the unit cube, one column per key."""

    def combinations(self, rig: Rig) -> Sampled:
        """Draw the points."""
        spans = {key: _span(key, given, kind_of(key, rig)) for key, given in self.ranges.items()}
        return Sampled(self, spans, self._points())


class LatinHypercube(Sampler):
    """A Latin hypercube (needs SciPy): each of `n` equal parts of every range is visited once.

    Raises
    ------
    ValueError
        If a range, `n` or `seed` is not allowed; the message names it.
    """

    def _points(self) -> NDArray[np.float64]:
        need("scipy", "study")
        from scipy.stats import qmc

        points = qmc.LatinHypercube(len(self.ranges), seed=np.random.default_rng(self.seed)).random(self.n)
        return np.asarray(points, dtype=np.float64)


class Sobol(Sampler):
    """A scrambled Sobol sequence (needs SciPy): even in every projection; `n` must be a power of two.

    Raises
    ------
    ValueError
        If a range, `n` or `seed` is not allowed; the message names it.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.n & (self.n - 1):
            above = 1 << self.n.bit_length()
            raise ValueError(
                f"n = {self.n}: must be a power of two, such as {above // 2} or {above}; "
                "other numbers of points are uneven"
            )

    def _points(self) -> NDArray[np.float64]:
        need("scipy", "study")
        from scipy.stats import qmc

        points = qmc.Sobol(len(self.ranges), seed=np.random.default_rng(self.seed)).random(self.n)
        return np.asarray(points, dtype=np.float64)


class Sampled:
    """The points of a sampler as combinations."""

    def __init__(
        self, sampler: Sampler, spans: Mapping[str, _Span | list[Value]], points: NDArray[np.float64]
    ) -> None:
        self._sampler = sampler
        self._spans = spans
        self._points = points
        self.keys = tuple(spans)

    def __len__(self) -> int:
        return self._sampler.n

    def __getitem__(self, index: int) -> Changes:
        places = map(float, self._points[index])
        return {key: _at(span, place) for (key, span), place in zip(self._spans.items(), places, strict=True)}

    def describe(self) -> dict[str, Any]:
        """Sampler, ranges, seed, and a digest of the points, because another SciPy may draw others."""
        return {
            "kind": type(self._sampler).__name__,
            "order": list(self.keys),
            "values": {
                key: span._asdict() if isinstance(span, _Span) else span for key, span in self._spans.items()
            },
            "n": self._sampler.n,
            "seed": self._sampler.seed,
            "sha256": hashlib.sha256(self._points.astype("<f8").tobytes()).hexdigest(),
        }


def _at(span: _Span | list[Value], place: float) -> Value:
    return span.at(place) if isinstance(span, _Span) else span[min(int(place * len(span)), len(span) - 1)]


def _span(key: str, given: Range, kind: Kind) -> _Span | list[Value]:
    name = f"ranges[{key!r}]"
    if isinstance(given, list) and given:
        return [plain(f"{name}[{i}]", value, kind) for i, value in enumerate(given)]
    if not isinstance(given, tuple) or len(given) not in (2, 3) or (len(given) == 3 and given[2] != "log"):
        raise ValueError(
            f'{name} = {given!r}: must be (low, high), (low, high, "log") or a list of at least one choice'
        )
    if kind.type != "float":
        raise ValueError(f"{name} = {given!r}: `{key}` has no values in between; give a list of choices")
    low, high = (plain(name, bound, kind) for bound in given[:2])
    log = len(given) == 3
    if not (isinstance(low, float) and isinstance(high, float) and -math.inf < low < high < math.inf):
        raise ValueError(f"{name} = {given!r}: low must lie below high, both finite")
    if log and low <= 0.0:
        raise ValueError(f"{name} = {given!r}: low must lie above zero, as a logarithm is asked for")
    return _Span(low, high, log)
