"""What is measured and computed before a test: Figs. 4a, 4b and 6, and stability maps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

import eft
from eft.plots._style import BLUE, GREEN, LIMIT, VERMILION, axes_or_new, finish

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

    from eft import Estimate, FlowTable, Rig


def response_delay(delay: Estimate, *, ax: Axes | None = None) -> Axes:
    """Phase lag of the spool behind its command against frequency, with the fitted line, as in Fig. 4a."""
    ax = axes_or_new(ax)
    frequency = np.asarray(delay.details["frequency"])
    ax.plot(frequency, delay.details["lag"], ".", color="0.5", markersize=3, label="measured")
    line = 2 * np.pi * frequency * float(delay) - delay.details["intercept"]
    ax.plot(frequency, line, color=BLUE, label=f"delay {float(delay) * 1e3:.2f} ms")
    return finish(ax, xlabel="frequency (Hz)", ylabel="phase lag (rad)")


def flow_curve(
    table: FlowTable,
    *,
    spool: ArrayLike | None = None,
    displacement: ArrayLike | None = None,
    sample_rate: float | None = None,
    piston_area: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Flow in l/s against spool opening, as in Fig. 4b.

    With one run's spool, displacement (m), sample rate (Hz) and piston area (m²), its flow by central
    differences lies beneath.
    """
    ax = axes_or_new(ax)
    if spool is not None and displacement is not None and sample_rate and piston_area:
        flow = piston_area * np.gradient(np.asarray(displacement), 1 / sample_rate) * 1e3
        ax.plot(np.asarray(spool), flow, ".", color="0.7", markersize=2, label="measured")
    ax.plot(table.openings, table.flows * 1e3, "o-", color=BLUE, markersize=3, label="control points")
    return finish(ax, xlabel="spool opening (1)", ylabel="flow (l/s)")


def inverse_dynamics(
    rig: Rig, *, band: tuple[float, float] = (0.1, 100.0), axes: Sequence[Axes]
) -> Sequence[Axes]:
    """Valve, lead network and both in series: gain over that at rest, and phase, as in Fig. 6."""
    upper, lower = axes
    frequency = np.geomspace(*band, 400)
    valve, lead = eft.inverse_dynamics(rig, frequency)
    rest = [abs(response[0]) for response in eft.inverse_dynamics(rig, [0.0])]
    parts = {
        "valve": (valve / rest[0], VERMILION, "--"),
        "lead network": (lead / rest[1], GREEN, ":"),
        "both": (valve * lead / (rest[0] * rest[1]), BLUE, "-"),
    }
    for label, (response, color, style) in parts.items():
        upper.semilogx(frequency, abs(response), color=color, linestyle=style, label=label)
        lower.semilogx(frequency, np.degrees(np.unwrap(np.angle(response))), color=color, linestyle=style)
    finish(upper, xlabel="", ylabel="gain over that at rest")
    finish(lower, xlabel="frequency (Hz)", ylabel="phase (°)", legend=False)
    return axes


def stability_map(
    rig: Rig,
    horizontal: tuple[str, Sequence[float]],
    vertical: tuple[str, Sequence[float]],
    *,
    ax: Axes | None = None,
) -> Axes:
    """Growth rate (1/s) of the least damped mode of the sampled loop over two settings, and where it is zero.

    Each setting is a dotted key of the rig, such as ``"compensation.level"`` or
    ``"controller.sample_rate"``, with its values.
    """
    ax = axes_or_new(ax)
    (x_key, x_values), (y_key, y_values) = horizontal, vertical
    growth = np.array(
        [
            [eft.linearize(rig.replace({x_key: x, y_key: y}), sampled=True).growth_rate for x in x_values]
            for y in y_values
        ]
    )
    # Beyond that, how fast it grows no longer matters.
    shown = np.clip(growth, -2.0, 2.0)
    mesh = ax.pcolormesh(x_values, y_values, shown, cmap="RdBu_r", vmin=-2.0, vmax=2.0, shading="nearest")
    if growth.min() < 0 < growth.max():
        ax.contour(x_values, y_values, growth, levels=[0.0], colors=LIMIT.color)
    ax.figure.colorbar(mesh, ax=ax, label="growth rate (1/s)", extend="both")
    return finish(ax, xlabel=x_key, ylabel=y_key, legend=False)
