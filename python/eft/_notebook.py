"""Display of results in a notebook: a small table, and a picture for some."""

from __future__ import annotations

import base64
import html
import io
import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from eft import _display
from eft._explore import explore
from eft._linear_model import modes
from eft._native import Command, FlowTable, LinearModel, Record, Rig

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["shown", "teach_native"]

_DOTS = 90
"""Dots per inch: legible on a screen, with 40 kB per picture."""

Rows = Iterable[tuple[str, Any]]


def shown(
    title: str, rows: Rows = (), draw: Callable[[Figure], Any] | None = None, height: float = 2.4
) -> str:
    """A heading, a table of names and values, and a picture, as HTML."""
    cells = "".join(
        f'<tr><td style="text-align:left">{html.escape(str(name))}</td>'
        f'<td style="text-align:right">{html.escape(_text(value))}</td></tr>'
        for name, value in rows
    )
    table = f"<table><tbody>{cells}</tbody></table>" if cells else ""
    return f"<div><b>{html.escape(title)}</b>{table}{_picture(title, draw, height) if draw else ''}</div>"


def _text(value: Any) -> str:
    if isinstance(value, float):
        return "–" if math.isnan(value) else f"{value:.4g}"
    return str(value)


def _picture(title: str, draw: Callable[[Figure], Any], height: float) -> str:
    # Imported here, because matplotlib is slow to import. A figure without pyplot opens no window.
    from matplotlib.figure import Figure

    from eft.plots._style import WIDTH, printed

    with printed():
        figure = Figure(figsize=(WIDTH, height), layout="constrained")
        draw(figure)
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=_DOTS)
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    return f'<img alt="{html.escape(title, quote=True)}" src="data:image/png;base64,{data}"/>'


def on_axes(draw: Callable[..., Any], what: Any) -> Callable[[Figure], Any]:
    """A drawing function for a figure from one for axes."""
    return lambda figure: draw(what, ax=figure.subplots())


def verdict_rows(verdict: Any) -> Rows:
    """Reasons and remedies of a verdict."""
    return [
        ("verdict", verdict.grade),
        *(("reason", reason) for reason in verdict.reasons),
        *((f"may help: {one.key}", one.value) for one in verdict.remedies),
        ("summary", verdict.summary),
    ]


def fields_rows(mapping: Mapping[Any, Any]) -> Rows:
    """Names with spaces, and their values."""
    return [(name.replace("_", " "), value) for name, value in mapping.items()]


def _record(self: Record) -> str:
    from eft import plots

    peak = _display.shown("acceleration")(self.pga)
    rows = [("duration, s", len(self) * self.dt), ("peak", peak), ("step, s", self.dt)]
    return shown(self.name or "Record", rows, on_axes(plots.record, self))


def _command(self: Command) -> str:
    from eft import plots

    rows: list[tuple[str, Any]] = [("duration, s", self.duration), ("sample rate, Hz", self.sample_rate)]
    rows.append(("peak", _display.shown("force")(float(abs(self.values).max()))))
    if self.record is not None:
        rows += [("ground motion", self.record.name), ("factor", self.scale), ("mass, kg", self.mass)]
    return shown("Force command", rows, on_axes(plots.command, self))


def _flow_table(self: FlowTable) -> str:
    from eft import plots

    largest = _display.shown("flow")(float(abs(self.flows).max()))
    rows = [("points", len(self)), ("largest flow", largest)]
    return shown("Flow curve", rows, on_axes(plots.flow_curve, self))


def _linear_model(self: LinearModel) -> str:
    from eft import plots

    rows = [
        ("stable", "yes" if self.stable else "no"),
        ("growth rate, 1/s", self.growth_rate),
        ("states", len(self.states)),
        ("not in the model", ", ".join(self.left_out) or "nothing"),
    ]
    return shown("Linear model", rows, lambda figure: plots.linear_model(self, figure=figure), 4.0)


def _rig(self: Rig) -> str:
    shown_keys = (
        "structure.kind", "structure.mass", "structure.stiffness", "actuator.piston_area", "actuator.stroke",
        "supply.pressure", "controller.force_loop", "compensation.mode", "compensation.adaptive",
    )  # fmt: skip
    return shown(self["name"] or "Rig", [(key, self[key]) for key in shown_keys])


_PLOT = """Draw it: `eft.plots.{name}` with the same options.

Parameters
----------
**options
    Those of `eft.plots.{name}`.

Returns
-------
matplotlib.{kind}

Raises
------
TypeError
    If there is no such option.

Examples
--------
>>> import eft
>>> drawn = {make}.plot()
"""


def teach_native() -> None:
    """Add the methods for pictures to the classes of the native module."""
    from eft import _native

    def plotter(name: str, kind: str, make: str) -> Callable[..., Any]:
        def plot(self: Any, **options: Any) -> Any:
            from eft import plots

            return getattr(plots, name)(self, **options)

        plot.__doc__ = _PLOT.format(name=name, kind=kind, make=make)
        return plot

    for kind, name, to_html, drawn, make in (
        (_native.Record, "record", _record, "axes.Axes", "eft.Record([0.0, 1.0, 0.0], 0.01)"),
        (_native.Command, "command", _command, "axes.Axes", "eft.Command.sine(2e3, 1.0, 2.0, 256.0)"),
        (
            _native.FlowTable,
            "flow_curve",
            _flow_table,
            "axes.Axes",
            "eft.FlowTable([-1.0, 1.0], [-1e-3, 1e-3])",
        ),
        (
            _native.LinearModel,
            "linear_model",
            _linear_model,
            "figure.Figure",
            "eft.linearize(eft.Rig.zhao2005())",
        ),
    ):
        # Set by setattr, because a type checker takes the methods from the stubs.
        setattr(kind, "plot", plotter(name, drawn, make))  # noqa: B010
        setattr(kind, "_repr_html_", to_html)  # noqa: B010
    setattr(_native.Rig, "_repr_html_", _rig)  # noqa: B010
    setattr(_native.Rig, "explore", explore)  # noqa: B010
    setattr(_native.LinearModel, "modes", modes)  # noqa: B010
