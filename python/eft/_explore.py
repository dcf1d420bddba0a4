"""The page of the virtual rig in a notebook."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from eft._native import Rig
from eft._study._values import value_in_effect

__all__ = ["explore", "page", "settings"]

FILE = Path(__file__).parent / "data" / "explore.html"
"""The page, which `make explore` builds."""

SLIDERS = {
    "l": ("compensation.level", 0.01),
    "t": ("compensation.response_delay", 1e-3),
    "g": ("truth.servovalve.flow_gain_scale", 0.01),
    "m": ("structure.mass", 1e3),
    "k": ("structure.stiffness", 1e3),
    "c": ("structure.damping", 1e3),
    "p": ("supply.pressure", 1e6),
}
"""The sliders of the page: key of the rig, and factor from the slider's unit to SI."""

MODULE = """
function render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.title = "The virtual rig";
  frame.setAttribute("sandbox", "allow-scripts");
  frame.style = `width:100%;height:${model.get("height")}px;border:0`;
  frame.srcdoc = model.get("page");
  const told = ({ source, data }) => {
    if (source !== frame.contentWindow || typeof data?.toml !== "string") return;
    model.set("toml", data.toml);
    model.save_changes();
  };
  addEventListener("message", told);
  el.append(frame);
  return () => removeEventListener("message", told);
}
export default { render };
"""
"""The script in the notebook: it shows the page in a frame and receives the test from it."""


def settings(rig: Rig) -> str:
    """The differences from the paper's rig, one line ``key = value`` each, as the page reads them."""
    paper = leaves(Rig.zhao2005().to_dict())
    own = leaves(rig.to_dict())
    name = own.get("name", "")
    if not name.isprintable() or '"' in name:
        del own["name"]
    lines = [f"{key} = none" for key in paper if key not in own]
    # A configuration has only values that are written alike in TOML and JSON.
    lines += [
        f"{key} = {json.dumps(value, ensure_ascii=False)}"
        for key, value in own.items()
        if paper.get(key) != value
    ]
    return "\n".join(lines)


def leaves(tree: dict[str, Any], before: str = "") -> dict[str, Any]:
    """Values of a tree of sections by dotted key."""
    found = {}
    for name, value in tree.items():
        inside = leaves(value, f"{before}{name}.") if isinstance(value, dict) else {f"{before}{name}": value}
        found.update(inside)
    return found


def page(rig: Rig) -> str:
    """The page for a rig, as HTML.

    Raises
    ------
    FileNotFoundError
        If this installation has no page.
    """
    if not FILE.is_file():
        raise FileNotFoundError(
            "this installation has no page of the virtual rig: install the wheel, or run `make explore` first"
        )
    values = {}
    for name, (key, factor) in SLIDERS.items():
        values[name] = float(value_in_effect(rig, key)) / factor
    start = {
        "lines": settings(rig),
        "values": values,
        "robust": rig["controller.force_loop"] == "robust",
    }
    text = json.dumps(start).replace("</", "<\\/")
    return FILE.read_text(encoding="utf-8").replace("/*@START@*/{}", text)


def explore(self: Rig, *, height: int = 1000) -> Any:
    """Show the virtual rig in a notebook, with sliders; each change runs a sine sweep in the browser.

    The page starts with this rig. Its numbers have the bits of `eft.simulate`. The widget's ``toml`` is the
    test with the page's present settings. `eft run` reads it, and `eft.Rig` reads it without its section
    ``command``.

    Parameters
    ----------
    height : int
        Of the page, in pixels.

    Returns
    -------
    anywidget.AnyWidget
        To be shown as the last line of a cell.

    Raises
    ------
    ModuleNotFoundError
        If anywidget is not installed: ``pip install 'effective-force-testing[notebook]'``.
    FileNotFoundError
        If this installation has no page.

    Examples
    --------
    >>> import eft
    >>> widget = eft.Rig.zhao2005().explore()  # doctest: +SKIP
    """
    try:
        import anywidget
    except ModuleNotFoundError as error:
        sentence = "rig.explore() needs anywidget: pip install 'effective-force-testing[notebook]'"
        raise ModuleNotFoundError(sentence, name="anywidget") from error
    import traitlets

    # The page has a frame of its own, which reaches neither the notebook nor a network.
    kind = type(
        "Explorer",
        (anywidget.AnyWidget,),
        {
            "_esm": MODULE,
            "page": traitlets.Unicode().tag(sync=True),
            "toml": traitlets.Unicode().tag(sync=True),
            "height": traitlets.Int().tag(sync=True),
        },
    )
    return kind(page=page(self), height=height)
