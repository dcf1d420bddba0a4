#!/usr/bin/env python3
"""Measures every function of budgets.toml on the target and holds it against its budget.

usage: check_budgets.py IMAGE MEASUREMENTS [LOOP_TABLE]
IMAGE is the measuring image (for sizes and calls), MEASUREMENTS what it printed, LOOP_TABLE where to write
the docs table.
"""

import re
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
# Bound on cycles per instruction used in the table: no instruction of the tick but divide and root (14 each
# on a Cortex-M4F) takes more than 3, most take 1; flash wait states behind a prefetch are within it.
CYCLES_PER_INSTRUCTION = 2.5
# The compiler's arithmetic in software, doubles above all.
SOFT_FLOAT = re.compile(r"__aeabi_(d|f|u?[il]2[df])|__[a-z]+[sd]f\d?$|__fix[a-z]+$|compiler_builtins.*float")


def function(subject: str) -> str:
    """The function of a subject, which may be one of its settings: `function, setting`."""
    return subject.partition(",")[0]


@dataclass
class Cost:
    """What a function was found to cost."""

    instructions: int
    code: int
    stack: int


def output(*command: str) -> str:
    """What a program prints."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def symbols(image: str) -> dict[str, tuple[int, int]]:
    """First address and bytes of every symbol."""
    rows = (line.split() for line in output("arm-none-eabi-nm", "-S", image).splitlines())
    return {row[3]: (int(row[0], 16) & ~1, int(row[1], 16)) for row in rows if len(row) == 4}


def calls(image: str, where: dict[str, tuple[int, int]]) -> dict[str, set[str]]:
    """Which functions each function calls or jumps to."""
    found: dict[str, set[str]] = {}
    name = ""
    for line in output("arm-none-eabi-objdump", "-d", "--no-show-raw-insn", image).splitlines():
        if head := re.match(r"^[0-9a-f]+ <(.*)>:$", line):
            name = head[1]
            found[name] = set()
        elif branch := re.match(r" *([0-9a-f]+):\tb\S*\t[0-9a-f]+ <([^+>]+)", line):
            start, length = where.get(name, (0, 0))
            # What fills the gap behind a function only looks like a branch.
            if not length or int(branch[1], 16) < start + length:
                found[name] |= {branch[2]} - {name}
    return found


def reached(name: str, graph: dict[str, set[str]]) -> set[str]:
    """A function and everything it leads to."""
    found, waiting = set(), [name]
    while waiting:
        function = waiting.pop()
        if function not in found:
            found.add(function)
            waiting += graph.get(function, ())
    return found


def adaptive_load(rows: dict[str, Cost]) -> str:
    """What the adaptive tick takes of a second, at a high and a low sample rate."""
    loads = []
    for rate, setting in [(4096, ""), (2048, ", 2048 Hz")]:
        each = rows[f"eft_adaptive_step_f32{setting}"].instructions
        loads.append(
            f"at {rate} Hz at most {each} instructions a tick, {each * rate / 1e6:.2f} million a second"
        )
    return "; ".join(loads)


def loop_table(rows: dict[str, Cost]) -> str:
    """The share of the period one tick takes, as Markdown."""
    instructions = rows["eft_step_f32"].instructions
    cycles = instructions * CYCLES_PER_INSTRUCTION
    rates, clocks = [1000, 2048, 4096, 5000, 10000, 20000], [48, 84, 168, 216, 480]
    lines = [
        "<!-- Written by firmware/check_budgets.py; do not edit. -->",
        "# Loop budget",
        "",
        f"One `eft_step_f32` takes at most {instructions} instructions on a Cortex-M4F, counted under QEMU "
        "over all inputs tried. They are instructions, not cycles of silicon; the table assumes "
        f"{CYCLES_PER_INSTRUCTION} cycles per instruction ({cycles:.0f} cycles), and gives the share of the "
        "sample period that the tick takes.",
        "",
        "| sample rate, Hz | " + " | ".join(f"{c} MHz" for c in clocks) + " |",
        "| --- |" + " --- |" * len(clocks),
    ]
    for rate in rates:
        shares = " | ".join(f"{100 * cycles * rate / (clock * 1e6):.2f} %" for clock in clocks)
        lines.append(f"| {rate} | {shares} |")
    lines += [
        "",
        "The functions, each with everything it reaches. `make firmware` fails when one exceeds its entry "
        "in `firmware/budgets.toml`, built by the compiler that `firmware/rust-toolchain.toml` names and "
        "with the wrapper `firmware/rustc-leaves`, which takes off the frame pointer that rustc forces on "
        "ARM functions (without it a function takes two to five instructions more).",
        "",
        "The adaptive functions are measured with feedforward, estimators and guard on, at 4096 Hz where the "
        "name has no rate behind it; `curve` is with the flow table corrected as well. From 3200 Hz up a "
        "tick does one sixteenth of a window's work, below that two, in ticks that last longer: "
        f"{adaptive_load(rows)}.",
        "",
        "| function | instructions | code, bytes | stack, bytes |",
        "| --- | --- | --- | --- |",
    ]
    for name, c in rows.items():
        what = f"`{function(name)}`{name[len(function(name)) :]}"
        lines.append(f"| {what} | {c.instructions} | {c.code} | {c.stack} |")
    return "\n".join(lines) + "\n"


def main(image: str, measurements: str, table: str | None = None) -> int:
    """Print budgets against measurements; 1 if any is exceeded."""
    budgets = tomllib.loads((HERE / "budgets.toml").read_text())
    where = symbols(image)
    graph = calls(image, where)
    measured: dict[str, Cost] = {}
    problems = []
    for line in Path(measurements).read_text().splitlines():
        name, instructions, stack = line.rsplit(maxsplit=2)
        code = reached(function(name), graph)
        measured[name] = Cost(int(instructions), sum(where[f][1] for f in code if f in where), int(stack))
        problems += [f"{name} reaches {f}: software arithmetic" for f in code if SOFT_FLOAT.search(f)]
    if not any(SOFT_FLOAT.search(f) for f in reached("main", graph)):
        problems.append("the image configures in doubles, and no routine was found: the search is blind")
    problems += [f"{name} was not measured" for name in budgets.keys() - measured.keys()]
    problems += [f"{name} has no budget" for name in measured.keys() - budgets.keys()]
    print(f"{'function':52} {'instructions':>16} {'code':>12} {'stack':>10}   (measured / budget)")
    for name, cost in measured.items():
        budget = budgets.get(name)
        if budget is None:
            continue
        pairs = {what: (getattr(cost, what), budget[what]) for what in ("instructions", "code", "stack")}
        cells = [f"{m}/{b}" for m, b in pairs.values()]
        note = ""
        if budget.get("goal", budget["instructions"]) < budget["instructions"]:
            note = f"goal {budget['goal']} not met: {budget['why']}"
        print(f"{name:52} {cells[0]:>16} {cells[1]:>12} {cells[2]:>10}   {note}")
        problems += [f"{name}: {m} {what}, {b} allowed" for what, (m, b) in pairs.items() if m > b]
    if table:
        path, text = Path(table), loop_table(measured)
        if not path.exists() or path.read_text() != text:
            path.write_text(text)
            print(f"{path} has changed: commit it")
    print("\n".join(problems) or "every budget holds; no soft-float routine is reachable from any of them")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
