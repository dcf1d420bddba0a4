"""The nine criteria of the benchmark, each a function of two signals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eft._numbers import real_number, whole_number

Array = NDArray[np.float64]

_LAGS = 50
"""Number of lags of J1 in samples: that of the benchmark, 12 ms at its 4096 Hz."""


class Criteria(NamedTuple):
    """The nine criteria of one test: J1 in s, the others as fractions of 1."""

    j1: float
    """Delay of the measured displacement after its target, s."""
    j2: float
    """Root mean square of the tracking error over that of the target."""
    j3: float
    """Peak of the tracking error over that of the target."""
    j4: float
    """As J2, of the measured displacement against the reference of the first floor."""
    j5: float
    """As J3, of the measured displacement against the reference of the first floor."""
    j6: float
    """As J2, of the second floor against its reference."""
    j7: float
    """As J2, of the third floor against its reference."""
    j8: float
    """As J3, of the second floor against its reference."""
    j9: float
    """As J3, of the third floor against its reference."""


def delay(target: ArrayLike, measured: ArrayLike, sample_rate: float, *, lags: int = _LAGS) -> float:
    """Compute J1: the lag at which the measured signal correlates best with its target.

    The correlation is Pearson's, of the parts that overlap. A signal that leads has a delay of 0, and the
    answer is a whole number of samples. It is wrong if the true delay is beyond the lags.
    `eft.identify_delay` resolves fractions of a sample.

    Parameters
    ----------
    target : array_like
        The target, in any unit.
    measured : array_like
        The measured signal, of the same length and unit.
    sample_rate : float
        Samples per second, Hz.
    lags : int
        Number of lags, from 0 on, in samples; the benchmark uses 50.

    Returns
    -------
    float
        In s.

    Raises
    ------
    ValueError
        If the signals differ in length, are constant, not finite or shorter than twice the lags, or the
        sample rate is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> import eft
    >>> time = np.arange(8192) / 4096.0
    >>> target = np.sin(2 * np.pi * 3.0 * time)
    >>> f"{1e3 * eft.rths.delay(target, np.roll(target, 16), 4096.0):.2f} ms"
    '3.91 ms'
    """
    sample_rate, lags = real_number("sample_rate", sample_rate), whole_number("lags", lags)
    if not (np.isfinite(sample_rate) and sample_rate > 0.0):
        raise ValueError(f"sample_rate = {sample_rate!r}: must be positive and finite")
    wanted, found = _pair("target", target, "measured", measured)
    if lags < 1 or wanted.size < 2 * lags:
        raise ValueError(f"lags = {lags!r}: must be from 1 to half the {wanted.size} samples")
    count = wanted.size
    best = [np.corrcoef(found[lag:], wanted[: count - lag])[0, 1] for lag in range(lags)]
    return float(np.argmax(best)) / sample_rate


def rms_error(wanted: ArrayLike, found: ArrayLike) -> float:
    """Compute J2, J4, J6 and J7: the standard deviation of the error over that of the target.

    The means are removed, as in the benchmark. `run.metrics().nrmse` includes them.

    Parameters
    ----------
    wanted : array_like
        The target, in any unit.
    found : array_like
        The measured signal, of the same length and unit.

    Returns
    -------
    float
        As a fraction of 1.

    Raises
    ------
    ValueError
        If the signals differ in length, or are constant or not finite.

    Examples
    --------
    >>> import eft
    >>> run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.0, 5.0, 4.0, 4096.0))
    >>> f"{eft.rths.rms_error(run.command, run.force):.1%}"
    '4.0%'
    """
    wanted, found = _pair("wanted", wanted, "found", found)
    return float(np.std(found - wanted) / np.std(wanted))


def peak_error(wanted: ArrayLike, found: ArrayLike) -> float:
    """Compute J3, J5, J8 and J9: the largest error over the largest value of the target.

    Parameters
    ----------
    wanted : array_like
        The target, in any unit.
    found : array_like
        The measured signal, of the same length and unit.

    Returns
    -------
    float
        As a fraction of 1.

    Raises
    ------
    ValueError
        If the signals differ in length, or are constant or not finite.

    Examples
    --------
    >>> import eft
    >>> eft.rths.peak_error([0.0, 2.0, -4.0], [0.0, 3.0, -4.0])
    0.25
    """
    wanted, found = _pair("wanted", wanted, "found", found)
    return float(np.abs(found - wanted).max() / np.abs(wanted).max())


def criteria(
    target: ArrayLike, measured: ArrayLike, reference: ArrayLike, sample_rate: float, *, lags: int = _LAGS
) -> Criteria:
    """Judge a hybrid test of a three-story building whose first floor is in the laboratory.

    Parameters
    ----------
    target : array_like
        Displacements that the numerical substructure computed, (3, samples), the first floor's first; any
        unit. The first row is the target of the actuator.
    measured : array_like
        Measured displacement of the first floor, (samples), in the same unit.
    reference : array_like
        Displacements of the whole building without a hybrid test, (3, samples), in the same unit.
    sample_rate : float
        Samples per second, Hz.
    lags : int
        As of `delay`.

    Returns
    -------
    Criteria
        J1 to J9.

    Raises
    ------
    ValueError
        If an array has another shape, is constant or not finite.

    Examples
    --------
    >>> import numpy as np
    >>> import eft
    >>> floors = np.outer([1.0, 1.8, 2.2], np.sin(np.arange(4096) / 180.0))
    >>> judged = eft.rths.criteria(floors, 0.98 * floors[0], floors, 4096.0)
    >>> f"{judged.j2:.1%} {judged.j4:.1%} {judged.j6:.1%}"
    '2.0% 2.0% 0.0%'
    """
    floors, truth = _floors("target", target), _floors("reference", reference)
    first, second, third = truth
    return Criteria(
        delay(floors[0], measured, sample_rate, lags=lags),
        rms_error(floors[0], measured),
        peak_error(floors[0], measured),
        rms_error(first, measured),
        peak_error(first, measured),
        rms_error(second, floors[1]),
        rms_error(third, floors[2]),
        peak_error(second, floors[1]),
        peak_error(third, floors[2]),
    )


def _floors(name: str, values: ArrayLike) -> Array:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[0] != 3:
        raise ValueError(f"{name} has the shape {array.shape}: must be (3, samples)")
    return array


def _pair(wanted_name: str, wanted: ArrayLike, found_name: str, found: ArrayLike) -> tuple[Array, Array]:
    """Two valid signals of equal length, neither of which is constant."""
    pair = []
    for name, values in ((wanted_name, wanted), (found_name, found)):
        array = np.asarray(values, dtype=np.float64)
        if array.ndim != 1 or array.size < 2:
            raise ValueError(f"{name} has the shape {array.shape}: must be one row of at least two samples")
        if not np.isfinite(array).all():
            raise ValueError(f"{name}[{int(np.argmin(np.isfinite(array)))}]: must be finite")
        if np.ptp(array) == 0.0:
            raise ValueError(f"{name} = {array[0]:g} throughout: must not be constant")
        pair.append(array)
    if pair[0].size != pair[1].size:
        raise ValueError(f"{found_name} = {pair[1].size} samples: must be {pair[0].size}, as {wanted_name}")
    return pair[0], pair[1]
