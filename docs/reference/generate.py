"""Writes the generated parts of the reference: keys of a rig, wrong input, Python names, the C header."""

from pathlib import Path

import c_header
import keys
import python_names
import wrong_input

FOLDER = Path(__file__).parent / "_generated"

if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for part in (keys, wrong_input, python_names, c_header):
        part.write(FOLDER)
