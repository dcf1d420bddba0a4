"""Writes the generated parts of the Python reference: the names of each topic."""

import importlib
import inspect
import tomllib
from pathlib import Path

from eft._files import write_text

CONSTANTS = {
    "COMPETITORS": "The controllers that ship with the benchmark, by name.",
    "BUILDINGS": "Cases 1 to 4 of the benchmark: each a building of three floors.",
    "QUESTIONS": "What a data sheet must say, in its order.",
    "TEMPLATE": "A data sheet to fill in, as TOML.",
    "STABILITY_MAPS": "The named stability maps: each name with the function that computes the map.",
    "SPOOL_ADVICE": "The largest spool opening that the paper advises, a fraction of the stroke.",
}
TOPICS = tomllib.loads((Path(__file__).parent / "python" / "topics.toml").read_text(encoding="utf-8"))


def write(folder: Path) -> None:
    """One part for each topic: a table of the names, and then each of them."""
    for topic, modules in TOPICS.items():
        lines = ["```{eval-rst}"]
        for module, names in modules.items():
            lines += [f".. currentmodule:: {module}", "", ".. autosummary::", ""]
            lines += [f"   {name}" for name in names if callable(_named(module, name))] + [""]
        for module, names in modules.items():
            lines += [f".. currentmodule:: {module}", ""]
            for name in names:
                lines += [*_entry(module, name), ""]
        write_text(folder / f"python-{topic}.md", "\n".join([*lines, "```"]) + "\n")


def _named(module: str, name: str) -> object:
    return getattr(importlib.import_module(module), name)


def _entry(module: str, name: str) -> list[str]:
    thing = _named(module, name)
    if inspect.isclass(thing):
        entry = [f".. autoclass:: {name}", "   :members:"]
        # The traces of a run are attributes of what it is made from.
        return [*entry, "   :inherited-members:"] if name == "TestRun" else entry
    if callable(thing):
        return [f".. autofunction:: {name}"]
    # The docstring of a value is that of its type.
    return [f".. py:data:: {name}", "", f"   {CONSTANTS[name]}"]
