"""Sphinx configuration; `make docs` builds with warnings as errors."""

import re
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.ext import autosummary
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

project = "eft"
author = "The eft developers"
project_copyright = "2026, The eft developers"
release = metadata.version("effective-force-testing")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
]
myst_enable_extensions = ["amsmath", "colon_fence", "dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "_explore", "*/_generated"]

# Names in single backquotes link to their documentation, if it exists.
default_role = "py:obj"
autosummary_generate = False
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_type_aliases = {name: name for name in ("ArrayLike", "Array")}
napoleon_use_ivar = True

# Browsers draw MathML without a script, so the pages need no network.
html_math_renderer = "mathml"
html_theme = "furo"
html_title = f"eft {release}"
html_static_path = ["static"]
# The page of `make explore`, if it was made.
html_extra_path = ["_explore"] if (Path(__file__).parent / "_explore").is_dir() else []
html_css_files = ["eft.css"]


def _refuse_colons(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Napoleon interprets an attribute's text up to a colon as its type."""
    if what in ("attribute", "property") and lines and ":" in lines[0].replace(":py:", "").replace("::", ""):
        logging.getLogger(__name__).warning("%s: its first line must not have a colon", name)


# A summary must not end after them.
autosummary.WELL_KNOWN_ABBREVIATIONS += ("Fig.", "Figs.", "Eq.", "Eqs.")


def _longest_signature(
    signatures: str, max_chars: int = 30, short: Callable[[str, int], str] = autosummary.mangle_signature
) -> str:
    """Of an overloaded function, a table of names shows the signature with the most arguments."""
    # The mark for a short name is no part of a signature that can be parsed.
    return short(max(signatures.splitlines(), key=len, default="").replace("~", ""), max_chars)


autosummary.mangle_signature = _longest_signature


def _inline(page: HTML5Translator, node: nodes.math) -> None:
    page.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _displayed(page: HTML5Translator, node: nodes.math_block) -> None:
    page.body.append(f'<div class="math">{convert(node.astext(), display="block")}</div>')
    raise nodes.SkipNode


def _breakable(app: Sphinx, document: nodes.document, page: str) -> None:
    """In a table a long name may break after a point or an underscore, and nowhere else."""
    for entry in document.findall(nodes.entry):
        for name in list(entry.findall(nodes.literal)):
            first, *parts = re.split(r"(?<=[._])(?=\w)", name.astext())
            name.children = [nodes.Text(first)]
            for part in parts:
                name += [nodes.raw("", "<wbr>", format="html"), nodes.Text(part)]


def setup(app: Sphinx) -> None:
    """Draw equations, break long names, and check the texts of attributes before napoleon reads them."""
    app.add_html_math_renderer("mathml", (_inline, None), (_displayed, None))
    app.connect("autodoc-process-docstring", _refuse_colons, priority=400)
    app.connect("doctree-resolved", _breakable)
