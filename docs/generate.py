"""Writes the pages that are generated: the paper beside the results, the keys of a rig, wrong input."""

import sys
from pathlib import Path

import fixed_against_adaptive
import paper_figures
import random_rigs
import wrong_input

import eft
from eft._files import write_text
from eft.demo.__main__ import main

FOLDER = Path(__file__).parent / "_generated"


def keys() -> str:
    """The table of configuration keys, straight from the schema that checks them."""
    lines = ["| key | unit | allowed | meaning |", "| --- | --- | --- | --- |"]
    believed = (key for key in eft.rig_keys() if not key["key"].startswith("truth."))
    for key in believed:
        cells = (f"`{key['key']}`", key["unit"], key["allowed"], key["doc"])
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    write_text(FOLDER / "keys.md", keys())
    paper_figures.write(FOLDER)
    wrong_input.write(FOLDER)
    random_rigs.report(FOLDER)
    fixed_against_adaptive.report(FOLDER)
    # A number off its reference makes no page: the documentation must not show it as a result.
    sys.exit(main(["--output", str(FOLDER)]))
