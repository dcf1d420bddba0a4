"""Writes the page that compares each figure of the paper with a run of this version, and its pictures."""

from pathlib import Path

from paper_figures_earthquake import figures_9_and_10
from paper_figures_sweeps import figure_8, figure_11, stability
from paper_figures_valve import figure_4, figure_6

from eft._files import write_text


def write(folder: Path) -> None:
    """Write page and pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    shown = [*figure_4(), figure_6(), figure_8(), *figures_9_and_10(), *figure_11(), stability()]
    write_text(folder / "figures.md", "\n".join(each.text(folder) for each in shown))


if __name__ == "__main__":
    write(Path(__file__).parent / "_generated")
