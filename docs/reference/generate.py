"""Writes what the pages of reference include: the keys of a rig, and wrong input."""

from pathlib import Path

import wrong_input

import eft
from eft._files import write_text

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
    wrong_input.write(FOLDER)
