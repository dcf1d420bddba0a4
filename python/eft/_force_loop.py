"""The robust force loop, designed from a rig."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eft import _native
from eft._native import LinearModel, Rig

if TYPE_CHECKING:
    import control

__all__ = ["ForceLoop", "ForceLoopMargins", "design_force_loop"]


@dataclass(frozen=True)
class ForceLoopMargins:
    """Robustness of a force loop on the rig it is designed for, with the piston at rest."""

    gain: float
    """Largest stable factor on the loop's gain."""
    delay: float
    """Largest stable additional delay, s."""
    damping: float
    """Damping ratio of the oil column's mode."""
    e_max: float
    """Normalised coprime margin, the least of ``|1 + L| / sqrt(2 (1 + |L|²))`` over the loop gain L."""


@dataclass(frozen=True, eq=False)
class ForceLoop:
    """A designed force loop; made by `design_force_loop`."""

    coefficients: dict[str, float]
    """Keys and values for `Rig.replace`, ``controller.proportional_gain``,
    ``controller.derivative_gain`` (s) and ``controller.integral_gain`` (1/s)."""
    margins: ForceLoopMargins
    """The margins of the loop."""
    open_loop: LinearModel
    """From force command to measured force (N), opened after the load cell and sampled."""
    closed_loop: LinearModel
    """The closed loop from force command to measured force (N)."""

    def poles(self) -> NDArray[np.complex128]:
        """Return the poles of the closed loop in the z-plane, by magnitude.

        Returns
        -------
        numpy.ndarray
            Complex numbers.

        Examples
        --------
        >>> import eft
        >>> len(eft.design_force_loop(eft.Rig.zhao2005()).poles())
        5
        """
        return self.closed_loop.poles()

    def plot(self, **options: Any) -> Any:
        """Draw the Nyquist diagram with its margin: `eft.plots.force_loop`.

        Parameters
        ----------
        **options
            Those of `eft.plots.force_loop`.

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
        >>> axes = eft.design_force_loop(eft.Rig.zhao2005()).plot()
        """
        from eft import plots

        return plots.force_loop(self, **options)

    def _repr_html_(self) -> str:
        from eft import _notebook, plots

        rows = [*self.coefficients.items(), *_notebook.fields_rows(asdict(self.margins))]
        return _notebook.shown("Force loop", rows, _notebook.on_axes(plots.force_loop, self), 3.4)

    def to_control(self) -> control.StateSpace:
        """Return the open loop as a python-control ``StateSpace`` (needs the package control).

        Returns
        -------
        control.StateSpace
            From force command to measured force, opened after the load cell and sampled.

        Raises
        ------
        ModuleNotFoundError
            If python-control is not installed.

        Examples
        --------
        >>> import eft
        >>> eft.design_force_loop(eft.Rig.zhao2005()).to_control().dt == 1 / 4096
        True
        """
        return self.open_loop.to_control()


def design_force_loop(rig: Rig, sample_rate: float | None = None) -> ForceLoop:
    """Design gains of the digital force loop that keep the oil column damped on deviating rigs.

    The controller is the paper's, Eq. (1). The compensation supplies the flow of the motion, so the design
    uses valve and oil with the piston at rest. For each ratio ``G_d/G_p``, ``G_p`` is the largest that keeps
    four deviating rigs damped. Their oil is 0.6 or 1.5 times as stiff, and their pilot time constant 0.5 or 2
    times as long. Each has 10 % more flow gain and more delay: two samples and half a millisecond. The chosen
    ratio has the lowest peak of the sensitivity. The integral part has 1.75 times the valve's time scale, or
    longer where the margins require it. It reduces the errors at the specimen's frequency and removes the
    offset of a null bias.
    ``controller.force_loop = "robust"`` in a rig uses this design.

    Parameters
    ----------
    rig : Rig
        The rig as configured in the controller; ``truth`` has no effect.
    sample_rate : float, optional
        Sample rate in Hz; the rig's ``controller.sample_rate`` by default.

    Returns
    -------
    ForceLoop
        Coefficients, margins and models.

    Raises
    ------
    ValueError
        If no useful gains keep the oil column damped, or the sample rate is not allowed.

    Examples
    --------
    >>> import eft
    >>> loop = eft.design_force_loop(eft.Rig.zhao2005())
    >>> loop.margins.damping > 0.4 and loop.margins.gain > 10
    True
    """
    _native.check_rig(rig)
    rate = rig["controller.sample_rate"] if sample_rate is None else sample_rate
    (proportional, derivative, integral), margins, opened, closed = _native.design_force_loop(rig, rate)
    coefficients = {
        "controller.proportional_gain": proportional,
        "controller.derivative_gain": derivative,
        "controller.integral_gain": integral,
    }
    return ForceLoop(coefficients, ForceLoopMargins(*margins), opened, closed)
