"""Count the instructions of a tick by purpose: `python benches/profile.py benches/profile.json`.

Needs cargo, valgrind and addr2line. The counts of two lengths of the same sweep are subtracted, so only ticks
remain. An instruction belongs to the first part with one of the functions that it was inlined from.
"""

import collections
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from eft._files import write_text

LOOP = "the loop, copies, spilled registers"
PARTS = [
    ("checks of the step: regular, within limits, finite", "is_regular|at_limits|is_finite|magnitude"),
    ("valve command, for its trace", "driven_command"),
    ("load flow: curve and root", "flow_and_gain"),
    ("propagating the state", "predict|correct"),
    ("compensation: correction, inverse curve, lead network", r", 64>|advance_calibrated|required_opening"),
    ("propagating the state", "step<"),
    ("inputs and output of the controller", "sample|signals|Analog"),
    ("traces, or metrics", r"record|append|\nadd<"),
]
SWEEP = Path(__file__).parents[1] / "target" / "release" / "examples" / "sweep"


def counts(what, seconds):
    """Instructions executed at each address of a sweep."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        call = ["valgrind", "--tool=callgrind", "--dump-instr=yes", f"--callgrind-out-file={out}"]
        subprocess.run([*call, SWEEP, what, str(seconds)], check=True, capture_output=True)
        lines = out.read_text().splitlines()
    names, inside, called, address = {}, False, False, 0
    found = collections.Counter()
    for line in lines:
        if match := re.match(r"(c?)ob=\((\d+)\)(?: (.*))?", line):
            if match[3]:
                names[match[2]] = match[3]
            if not match[1]:
                inside = names[match[2]].endswith(SWEEP.name)
        elif line.startswith("calls="):
            called = True
        elif match := re.match(r"(\*|[+-]?\w+) \S+ (\d+)$", line):
            place = match[1]
            if place != "*":
                address = address + int(place) if place[0] in "+-" else int(place, 16)
            # The cost of a call has a separate line, and is also counted in the called function.
            if inside and not called:
                found[address] += int(match[2])
            called = False
    return found


def inlined(addresses):
    """The functions that each address was inlined from."""
    call = ["addr2line", "-a", "-i", "-f", "-C", "-e", SWEEP]
    text = "\n".join(hex(address) for address in addresses)
    said = subprocess.run(call, input=text, check=True, capture_output=True, text=True).stdout
    blocks = re.split(r"^0x([0-9a-f]{16})$", said, flags=re.MULTILINE)[1:]
    return {int(at, 16): lines for at, lines in zip(blocks[::2], blocks[1::2], strict=True)}


def parts(what, lanes):
    """Instructions per tick of one rig by part."""
    more = counts(what, 2) - counts(what, 1)
    per_tick = collections.Counter()
    for address, stack in inlined(more).items():
        if "with_avx2" in stack:
            part = next((part for part, names in PARTS if re.search(names, stack)), LOOP)
            per_tick[part] += more[address] / 4096 / lanes
    return per_tick


if __name__ == "__main__":
    build = ["cargo", "build", "--release", "--locked", "--package", "eft-sim", "--example", "sweep"]
    subprocess.run(build, check=True)
    one, batch = parts("one", 1), parts("batch", 8)
    table = {part: [round(one[part], 1), round(batch[part], 1)] for part in [*dict(PARTS), LOOP]}
    write_text(Path(sys.argv[1]), json.dumps(table, indent=2) + "\n")
