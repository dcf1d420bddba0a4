"""Advice on the gains of the force loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eft import _native
from eft._force_loop import design_force_loop
from eft._native import Rig
from eft._read_only import ReadOnly

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["ForceLoopTuning", "tune_force_loop"]

_RATIOS = 33
"""Number of ratios of derivative to proportional gain at which the margin is computed."""

_LARGEST_FACTOR = 1e3
"""Largest factor on the gains that `eft.linear.stability_margins` tries."""

_AS_BELIEVED = {"truth": None, "controller.force_loop": "pd"}
"""The rig as its controller knows it, with gains that can be set."""


@dataclass(frozen=True, eq=False)
class ForceLoopTuning(ReadOnly):
    """Advised proportional and derivative gain, and the gain margin over both."""

    coefficients: dict[str, float]
    """Advised ``controller.proportional_gain`` and ``controller.derivative_gain``, for `Rig.replace`."""
    proportional_gain: float
    """Present G_p of the rig."""
    derivative_gain: float
    """Present G_d of the rig, s."""
    realization: str
    """``"analog"`` or ``"digital"``, the realization of the loop."""
    ratios: NDArray[np.float64]
    """G_d over G_p for which the limit was computed, s."""
    largest_gains: NDArray[np.float64]
    """The G_p at which the loop becomes unstable for each ratio; infinite if it stays stable."""

    @property
    def margin(self) -> float:
        """Gain margin of the rig with its present gains."""
        return float(self.margin_at(self.proportional_gain, self.derivative_gain))

    @property
    def advised_margin(self) -> float:
        """Gain margin with the advised gains."""
        proportional, derivative = self.coefficients.values()
        return float(self.margin_at(proportional, derivative))

    def margin_at(self, proportional_gain: ArrayLike, derivative_gain: ArrayLike) -> NDArray[np.float64]:
        """Gain margin for any gains, between the computed lines by linear interpolation.

        The margin is the factor on both gains that makes the loop unstable; below 1 the loop is unstable.

        Parameters
        ----------
        proportional_gain, derivative_gain : array_like
            G_p, above zero, and G_d in s.

        Returns
        -------
        numpy.ndarray
            One margin for each pair of gains.

        Examples
        --------
        >>> import eft
        >>> advice = eft.tune_force_loop(eft.Rig.zhao2005())
        >>> bool(advice.margin_at(0.1, 0.0) > advice.margin_at(0.2, 0.0))
        True
        """
        gain = np.asarray(proportional_gain, dtype=np.float64)
        ratio = np.asarray(derivative_gain, dtype=np.float64) / gain
        # Interpolates the reciprocal, which is finite even for an infinite limit.
        share = np.interp(ratio, self.ratios, 1.0 / self.largest_gains)
        with np.errstate(divide="ignore"):
            found: NDArray[np.float64] = 1.0 / (gain * share)
        return found

    def _repr_html_(self) -> str:
        from eft import _notebook, plots

        rows = [*self.coefficients.items(), ("margin", self.margin), ("advised margin", self.advised_margin)]
        draw = _notebook.on_axes(plots.force_loop_gains, self)
        return _notebook.shown("Gains of the force loop", rows, draw, 3.4)

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw the margin over the gains, with the rig's own and the advised ones.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes to draw into; by default those of a new figure.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> import eft
        >>> axes = eft.tune_force_loop(eft.Rig.zhao2005()).plot()
        """
        from eft import plots

        return plots.force_loop_gains(self, ax=ax)


def tune_force_loop(rig: Rig, sample_rate: float | None = None) -> ForceLoopTuning:
    """Advise on G_p and G_d of a rig's force loop, and compute the gain margin over both.

    The advised gains are those of `eft.design_force_loop`. The margin is the ``loop_gain`` of
    `eft.linear.stability_margins`, sampled, for the configured rig in its own realization. The verdict uses
    the same margin.

    Parameters
    ----------
    rig : Rig
        The rig; ``truth`` has no effect.
    sample_rate : float, optional
        In Hz; the rig's ``controller.sample_rate`` by default.

    Returns
    -------
    ForceLoopTuning
        Advised gains, present gains and the margin over both; ``.plot()`` draws it.

    Raises
    ------
    ValueError
        If no useful gains keep the oil column damped, or the sample rate is not allowed.

    Examples
    --------
    >>> import eft
    >>> rig = eft.Rig.zhao2005().replace({"controller.realization": "digital"})
    >>> advice = eft.tune_force_loop(rig)
    >>> advice.advised_margin > 2.0 > advice.margin > 1.0
    True
    """
    designed = design_force_loop(rig, sample_rate).coefficients
    rate = rig["controller.sample_rate"] if sample_rate is None else sample_rate
    keys = ("controller.proportional_gain", "controller.derivative_gain")
    coefficients = {key: designed[key] for key in keys}
    robust = rig["controller.force_loop"] == "robust"
    advised_gain, advised_derivative = coefficients.values()
    own = (advised_gain, advised_derivative) if robust else (
        rig["controller.proportional_gain"], rig["controller.derivative_gain"]
    )  # fmt: skip
    realization = "digital" if robust else rig["controller.realization"]
    believed = rig.replace(_AS_BELIEVED | {"controller.realization": realization})
    longest = 2.0 * max(advised_derivative / advised_gain, own[1] / own[0])
    exact = (own[1] / own[0], advised_derivative / advised_gain)
    ratios = np.unique([*np.linspace(0.0, longest, _RATIOS), *exact])
    # The integral gain is scaled with the other gains.
    integral = designed["controller.integral_gain"] if robust else rig["controller.integral_gain"]
    per_gain = integral / own[0]
    limits = [_largest_gain(believed, ratio, per_gain, advised_gain, rate) for ratio in ratios]
    return ForceLoopTuning(coefficients, own[0], own[1], realization, ratios, np.array(limits))


def _largest_gain(rig: Rig, ratio: float, integral: float, start: float, rate: float) -> float:
    """The proportional gain at which the loop with these ratios of the other gains becomes unstable."""
    for _ in range(12):
        gains = {
            "controller.proportional_gain": start,
            "controller.derivative_gain": ratio * start,
            "controller.integral_gain": integral * start,
        }
        _, found = _native.margins_within(rig.replace(gains), rate, 1.0, -1.0, _LARGEST_FACTOR, "nominal")
        if found is not None:
            return found[2] * start
        start /= 2.0
    return start
