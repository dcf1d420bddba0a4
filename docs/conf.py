"""Sphinx configuration; `make docs` builds with warnings as errors."""

from importlib import metadata

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
exclude_patterns = ["_build", "*/_generated"]

autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_default_options = {"members": True, "show-inheritance": False}

html_theme = "furo"
html_title = f"eft {release}"
