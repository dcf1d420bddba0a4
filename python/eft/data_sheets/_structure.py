"""Keys of a specimen from mass, frequency and damping ratio."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eft._extras import need
from eft.data_sheets._values import Value, above_zero, damping_ratio_of

__all__ = ["stories", "structure"]

_FIT = 1e-6
"""A negative damper below this share of the largest one is a rounding error."""


def structure(mass: Value, frequency: Value, damping_ratio: Value) -> dict[str, Any]:
    """Keys of a linear specimen of one mass: ``k = m·ω²`` and ``c = 2ζ·m·ω``.

    Parameters
    ----------
    mass : float or str
        In kg, or such as ``"12 t"``.
    frequency : float or str
        Natural frequency, Hz.
    damping_ratio : float or str
        Of critical, below 1, such as 0.03 or ``"3 %"``.

    Returns
    -------
    dict
        Keys for `Rig.replace`.

    Raises
    ------
    ValueError
        If a value is not allowed; the message names it.

    Examples
    --------
    >>> import eft
    >>> keys = eft.data_sheets.structure("12 t", "2.3 Hz", "2 %")
    >>> f"{keys['structure.stiffness'] / 1e6:.3f} kN/mm"
    '2.506 kN/mm'
    """
    kilograms = above_zero("mass", mass, "kg")
    omega = 2.0 * np.pi * above_zero("frequency", frequency, "Hz")
    ratio = damping_ratio_of("damping_ratio", damping_ratio)
    return {
        "structure.kind": "linear",
        "structure.mass": kilograms,
        "structure.stiffness": kilograms * omega**2,
        "structure.damping": 2.0 * ratio * kilograms * omega,
    }


def stories(
    masses: Sequence[Value],
    stiffnesses: Sequence[Value],
    damping_ratios: Value | Sequence[Value],
    *,
    rayleigh: tuple[int, int] | None = None,
) -> dict[str, Any]:
    """Keys of a shear building from its modes' damping ratios.

    The dampers of the stories give every mode its ratio by the modal damping ``φᵀCφ/(2ω)``. Modes are coupled
    if the dampers are not proportional to the stiffnesses. Dampers between the floors damp higher modes more.
    If no such dampers have these ratios, the nearest ones keep the ratio of the lowest mode, and a warning
    states their ratios.

    Parameters
    ----------
    masses : sequence of float or str
        Of the floors from the ground up, kg.
    stiffnesses : sequence of float or str
        Of the columns below each floor, N/m.
    damping_ratios : float, str or sequence of them
        One for each mode, from the lowest; a single one holds for all of them. With `rayleigh`, one or two.
    rayleigh : tuple of int, optional
        The two modes, counted from 1, at which Rayleigh damping has `damping_ratios`; the others follow from
        ``ζ = a/(2ω) + b·ω/2``.

    Returns
    -------
    dict
        Keys for `Rig.replace`.

    Raises
    ------
    ValueError
        If a value is not allowed; the message names it.

    Warns
    -----
    UserWarning
        If no dampers between the floors have the ratios.

    Examples
    --------
    >>> import eft
    >>> keys = eft.data_sheets.stories(["4 t", "3 t"], ["900 kN/m", "700 kN/m"], "3 %")
    >>> [round(c) for c in keys["structure.stories.dampings"]]
    [7611, 136]
    """
    m = np.array([above_zero(f"masses[{i}]", mass, "kg") for i, mass in enumerate(masses)])
    k = np.array([above_zero(f"stiffnesses[{i}]", one, "N/m") for i, one in enumerate(stiffnesses)])
    if not len(m) or len(m) != len(k):
        raise ValueError(f"stiffnesses = {len(k)} values: must be one for each of {len(m)} masses")
    omega, drifts = _modes(m, k)
    ratios = _ratios(damping_ratios, omega, rayleigh)
    # Row: mode; column: damper. The modes are normalised by the masses.
    c = np.linalg.solve(drifts**2, 2.0 * omega * ratios)
    if c.min() < -_FIT * np.abs(c).max():
        c = _nearest(drifts, omega, ratios)
        wanted, found = (
            ", ".join(f"{ratio:.2%}" for ratio in some) for some in (ratios, drifts**2 @ c / (2.0 * omega))
        )
        warnings.warn(
            f"damping_ratios = {wanted}: no dampers between the floors have them; the nearest have {found}",
            stacklevel=2,
        )
    return {
        "structure.kind": "shear_building",
        "structure.mass": float(m.sum()),
        "structure.stiffness": float(k[0]),
        "structure.damping": float(max(c[0], 0.0)),
        "structure.stories.masses": m.tolist(),
        "structure.stories.stiffnesses": k.tolist(),
        "structure.stories.dampings": np.maximum(c, 0.0).tolist(),
    }


def _nearest(drifts: NDArray[Any], omega: NDArray[Any], ratios: NDArray[Any]) -> NDArray[Any]:
    """Dampers of at least zero whose ratios have the least relative error; the lowest mode weighs most."""
    need("scipy", "study")
    from scipy.optimize import nnls

    weight = 1.0 / np.maximum(2.0 * omega * ratios, 1e-12 * omega.max())
    weight[0] *= 1e3
    found: NDArray[Any] = nnls(weight[:, None] * drifts**2, weight * 2.0 * omega * ratios)[0]
    return found


def _modes(m: NDArray[Any], k: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Natural frequencies (rad/s), and each mode's drift of every story."""
    between = np.eye(len(m)) - np.eye(len(m), k=-1)  # drifts from displacements
    half = between / np.sqrt(m)
    squares, vectors = np.linalg.eigh(half.T @ (k[:, None] * half))
    return np.sqrt(squares), (half @ vectors).T


def _ratios(given: Any, omega: NDArray[Any], rayleigh: tuple[int, int] | None) -> NDArray[Any]:
    listed = (
        list(given) if isinstance(given, Sequence | np.ndarray) and not isinstance(given, str) else [given]
    )
    values = [damping_ratio_of(f"damping_ratios[{i}]", one) for i, one in enumerate(listed)]
    wanted = len(omega) if rayleigh is None else 2
    if len(values) == 1:
        values *= wanted
    if len(values) != wanted:
        raise ValueError(f"damping_ratios = {len(values)} values: must be 1 or {wanted}")
    if rayleigh is None:
        return np.array(values)
    if len(rayleigh) != 2 or rayleigh[0] == rayleigh[1] or not all(1 <= i <= len(omega) for i in rayleigh):
        raise ValueError(f"rayleigh = {rayleigh!r}: must be two different modes from 1 to {len(omega)}")
    at = omega[[mode - 1 for mode in rayleigh]]
    a, b = np.linalg.solve(np.column_stack([0.5 / at, 0.5 * at]), values)
    found: NDArray[Any] = 0.5 * a / omega + 0.5 * b * omega
    return found
