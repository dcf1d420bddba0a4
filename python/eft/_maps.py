"""Stability maps: a stability quantity of the sampled loop over two settings of a rig."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eft import _native
from eft._extras import need
from eft._native import Rig
from eft._read_only import ReadOnly
from eft._study._values import kind_of, plain

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["STABILITY_MAPS", "StabilityMap", "stability_map"]

Quantity = Literal["growth_rate", "level"]
MapName = Literal["level-damping", "delay-rate", "rate-realization"]
Axis = tuple[str, Sequence[Any] | NDArray[Any]]
FlowGain = Literal["nominal", "steeper", "shallower", "mean"]


@dataclass(frozen=True, eq=False)
class StabilityMap(ReadOnly):
    """A quantity of the sampled loop over two settings of a rig; `eft.plots.stability_map` draws it."""

    quantity: Quantity
    """The mapped quantity.

    ``"growth_rate"`` is the growth rate of the least damped mode in 1/s, negative if the loop is stable.
    ``"level"`` is the largest stable compensation level, NaN if no level is stable.
    """
    horizontal_key: str
    """Dotted key of the rig that varies along a row."""
    horizontal: NDArray[Any]
    """Its values."""
    vertical_key: str
    """Dotted key of the rig that varies from row to row."""
    vertical: NDArray[Any]
    """Its values."""
    values: NDArray[np.float64]
    """One row for each value of `vertical`."""
    left_out: tuple[str, ...] = ()
    """Keys of the rig with an effect on small signals that the linear model does not contain, at any
    point."""

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether the loop is stable at each point; in a map of levels, whether any level is stable."""
        return np.asarray(self.values < 0 if self.quantity == "growth_rate" else ~np.isnan(self.values))

    def plot(self, **options: Any) -> Any:
        """Draw the map: `eft.plots.stability_map`.

        Parameters
        ----------
        **options
            Those of `eft.plots.stability_map`.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        TypeError
            If there is no such option.

        Examples
        --------
        >>> import eft
        >>> axes = ("compensation.level", [0.9, 1.0]), ("structure.damping", [4e3, 5e3])
        >>> found = eft.linear.stability_map(eft.Rig.zhao2005(), *axes)
        >>> axes = found.plot()
        """
        from eft import plots

        return plots.stability_map(self, **options)

    def _repr_html_(self) -> str:
        from eft import _notebook, plots

        rows = [("points", self.values.size), ("stable", f"{self.stable.mean():.0%}")]
        return _notebook.shown("Stability map", rows, _notebook.on_axes(plots.stability_map, self), 3.0)

    def to_pandas(self) -> pd.DataFrame:
        """Return the map as a data frame, `horizontal` along its columns (needs pandas).

        Returns
        -------
        pandas.DataFrame
            One row for each value of `vertical`.

        Raises
        ------
        ModuleNotFoundError
            If pandas is not installed.

        Examples
        --------
        >>> import eft
        >>> axes = ("compensation.level", [0.9, 1.0]), ("structure.damping", [4e3, 5e3])
        >>> found = eft.linear.stability_map(eft.Rig.zhao2005(), *axes)
        >>> found.to_pandas().columns.name
        'compensation.level'
        """
        need("pandas")
        import pandas as pd

        return pd.DataFrame(
            self.values,
            index=pd.Index(self.vertical, name=self.vertical_key),
            columns=pd.Index(self.horizontal, name=self.horizontal_key),
        )


@overload
def stability_map(rig: Rig, horizontal: MapName) -> StabilityMap: ...
@overload
def stability_map(
    rig: Rig,
    horizontal: Axis,
    vertical: Axis,
    *,
    quantity: Quantity = ...,
    flow_gain: FlowGain = ...,
) -> StabilityMap: ...
def stability_map(
    rig: Rig,
    horizontal: MapName | Axis,
    vertical: Axis | None = None,
    *,
    quantity: Quantity = "growth_rate",
    flow_gain: FlowGain = "nominal",
) -> StabilityMap:
    """Map a quantity of the exactly sampled loop over any two settings of a rig.

    Each point is `linearize` with ``sampled=True`` for the rig with both settings, at that rig's
    ``controller.sample_rate``.

    Parameters
    ----------
    rig : Rig
        The rig.
    horizontal, vertical : tuple of str and sequence
        A dotted key of the rig, such as ``"compensation.level"``, with its values, in SI units or as texts
        with a unit such as ``"7 t"``. Or only the name of a common map:
        ``"level-damping"`` is the growth rate over compensation level (0.9 to 1.15) and viscous
        damping of the structure (0.5 to 10 % of critical); ``"delay-rate"`` the growth rate over sample rate
        (200 Hz to 12.8 kHz) and response delay (0 to ten times the rig's own);
        ``"rate-realization"`` the largest stable level over the sample rate, for both realizations of the
        force loop.
    quantity : {"growth_rate", "level"}
        The growth rate of the least damped mode in 1/s, or the largest stable compensation level.
    flow_gain : {"nominal", "steeper", "shallower", "mean"}
        As of `linearize`.

    Returns
    -------
    StabilityMap
        One row for each value of `vertical`.

    Raises
    ------
    ValueError
        If a key or a value is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> levels, dampings = ("compensation.level", [0.9, 1.2]), ("structure.damping", [2e3, 4e3])
    >>> eft.linear.stability_map(eft.Rig.zhao2005(), levels, dampings).stable.tolist()
    [[True, False], [True, False]]
    """
    _native.check_rig(rig)
    if isinstance(horizontal, str):
        if horizontal not in STABILITY_MAPS:
            known = ", ".join(f'"{name}"' for name in STABILITY_MAPS)
            raise ValueError(f"map = {horizontal!r}: must be one of {known}, or two keys with their values")
        return STABILITY_MAPS[horizontal](rig)
    if vertical is None:
        raise ValueError("vertical = None: must be a key with its values, as horizontal is")
    (x_key, x), (y_key, y) = ((key, _in_si(rig, key, list(given))) for key, given in (horizontal, vertical))
    values = _native.stability_map(rig, (x_key, x), (y_key, y), quantity, flow_gain)
    left_out: dict[str, None] = {}
    # Each value occurs in at least one of these points.
    for i in range(max(len(x), len(y))):
        point = rig.replace({x_key: x[min(i, len(x) - 1)], y_key: y[min(i, len(y) - 1)]})
        left_out |= dict.fromkeys(_native.linearize(point, sampled=True).left_out)
    return StabilityMap(quantity, x_key, np.asarray(x), y_key, np.asarray(y), values, tuple(left_out))


def _in_si(rig: Rig, key: str, values: list[Any]) -> list[Any]:
    """Texts with a unit as SI values, and whole numbers as such where the key needs them."""
    kind = kind_of(key, rig)
    if kind.type == "int":
        return [int(one) if isinstance(one, float) and one.is_integer() else one for one in values]
    texts = kind.type in ("float", "list")
    return [plain(key, one, kind) if texts and isinstance(one, (str, list)) else one for one in values]


def level_damping_map(
    rig: Rig, levels: ArrayLike | None = None, dampings: ArrayLike | None = None
) -> StabilityMap:
    """Growth rate (1/s) over compensation level (1) and viscous damping of the structure (N·s/m).

    Without values: levels from 0.9 to 1.15, dampings from 0.5 to 10 % of critical.
    """
    structure = rig["structure"]
    if structure["kind"] == "shear_building":
        raise ValueError('structure.kind = "shear_building": must have one mass and one damper for this map')
    critical = 2.0 * np.sqrt(structure["stiffness"] * structure["mass"])
    x = np.linspace(0.9, 1.15, 51) if levels is None else np.asarray(levels)
    y = critical * np.linspace(0.005, 0.1, 39) if dampings is None else np.asarray(dampings)
    return stability_map(rig, ("compensation.level", x), ("structure.damping", y))


def delay_rate_map(rig: Rig, delays: ArrayLike | None = None, rates: ArrayLike | None = None) -> StabilityMap:
    """Growth rate (1/s) over sample rate (Hz) and the response delay given to the lead network (s).

    Without values: delays from 0 to ten times the rig's own (at least 50 ms), rates from 200 Hz to 12.8 kHz.
    """
    longest = max(10.0 * rig["compensation.response_delay"], 0.05)
    y = np.linspace(0.0, longest, 41) if delays is None else np.asarray(delays)
    return stability_map(rig, ("controller.sample_rate", _rates(rates)), ("compensation.response_delay", y))


def rate_realization_map(rig: Rig, rates: ArrayLike | None = None) -> StabilityMap:
    """Largest stable compensation level (1) over sample rate (Hz), of both realizations of the force loop.

    NaN if the loop is unstable at any level. A digital force loop needs a minimum rate.

    Without values: rates from 200 Hz to 12.8 kHz.
    """
    return stability_map(
        rig,
        ("controller.sample_rate", _rates(rates)),
        ("controller.realization", ["analog", "digital"]),
        quantity="level",
    )


def _rates(given: ArrayLike | None) -> NDArray[Any]:
    return np.geomspace(200.0, 12800.0, 49) if given is None else np.asarray(given)


STABILITY_MAPS: Mapping[str, Callable[[Rig], StabilityMap]] = {
    "level-damping": level_damping_map,
    "delay-rate": delay_rate_map,
    "rate-realization": rate_realization_map,
}
"""The common maps by name, as functions of a rig."""
