"""The report: Markdown, and the same as one HTML file with its figures inside."""

from __future__ import annotations

import base64
import html
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from markdown_it import MarkdownIt

from eft._files import write_text
from eft._native import __version__
from eft.demo.figures import Shown
from eft.demo.tables import Table
from eft.report._page import POLICY

_STYLE = """
body { font: 11pt/1.5 system-ui, sans-serif; color: #1a1a1a;
  max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
table { border-collapse: collapse; font-size: 0.82rem; font-variant-numeric: tabular-nums;
  display: block; overflow-x: auto; }
th, td { padding: 0.25rem 0.6rem; border-bottom: 1px solid #ddd; } th { border-bottom: 2px solid #666; }
img { max-width: 100%; } pre { background: #f6f6f6; padding: 0.8rem; overflow-x: auto; font-size: 0.8rem; }
@media print { body { margin: 0; max-width: none; } h2, img, tr { break-inside: avoid; } }
"""


@dataclass(frozen=True)
class Section:
    """A table and the figures that belong to it."""

    title: str
    text: str
    table: Table
    figures: Sequence[Shown]


def write(folder: Path, verdict: str, sections: Sequence[Section], configuration: str) -> Path:
    """Write figures, ``report.md`` and ``report.html`` into `folder`; returns the HTML file."""
    for section in sections:
        for shown in section.figures:
            shown.save(folder)
    text = _markdown(verdict, sections, configuration)
    write_text(folder / "report.md", text)
    page = folder / "report.html"
    write_text(page, _html(text, folder))
    return page


def _markdown(verdict: str, sections: Sequence[Section], configuration: str) -> str:
    parts = ["# Effective force testing: the paper's tests on the virtual rig", verdict]
    for section in sections:
        parts += [f"## {section.title}", section.text, section.table.markdown()]
        for shown in section.figures:
            parts += [f"### {shown.title}", f"![{shown.title}]({shown.name}.png)", shown.caption]
    parts += [
        "## What was run",
        f"{_versions()}. Each test changes some keys of this rig:",
        f"```toml\n{configuration.strip()}\n```",
    ]
    return "\n\n".join(parts) + "\n"


def _versions() -> str:
    numpy = metadata.version("numpy")
    machine = f"{platform.machine()} {platform.system()}"
    return f"eft {__version__}, Python {platform.python_version()}, numpy {numpy}, {machine}"


def _html(text: str, folder: Path) -> str:
    body = str(MarkdownIt("commonmark", {"html": False}).enable("table").render(text))
    for picture in sorted(folder.glob("*.png")):
        data = base64.b64encode(picture.read_bytes()).decode("ascii")
        body = body.replace(f'src="{picture.name}"', f'src="data:image/png;base64,{data}"')
    title = html.escape(text.split("\n", 1)[0].lstrip("# "))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}"><title>{title}</title>'
        f"<style>{_STYLE}</style></head><body>\n{body}</body></html>\n"
    )
