"""A section of the page with the paper's figures: the paper's statement, the pictures and the result."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from eft._files import atomic_write

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Shown:
    """A figure of the paper, the paper's statement about it, and the result of this run."""

    number: str
    title: str
    statement: str
    found: str
    figures: dict[str, Figure]

    def text(self, folder: Path) -> str:
        """The section of the page; its pictures are written into the folder."""
        title = f"Fig. {self.number}: {self.title}" if self.number else self.title
        parts = [f"## {title}\n", f"*The paper:* {self.statement}\n"]
        for name, figure in self.figures.items():
            path = folder / f"{name}.png"
            with atomic_write(path) as temporary:
                figure.savefig(temporary, format="png")
            parts.append(f"![{title}]({path.name})\n")
        return "\n".join([*parts, f"*This run:* {self.found}\n"])


def table(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A table of Markdown."""
    lines = [header, ("---",) * len(header), *rows]
    return "\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines)
