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


RATES, CLOCKS = [1000, 2048, 4096, 5000, 10000, 20000], [48, 84, 168, 216, 480]
# A window lasts 2.5 ms at the least, whatever the sample rate.
MOST_WINDOWS = 400


def shares(head: str, cycles: dict[str, float]) -> list[str]:
    """A table of the processor's share, by clock, of so many cycles a second."""
    lines = [
        f"| {head} | " + " | ".join(f"{clock} MHz" for clock in CLOCKS) + " |",
        "| --- |" + " --- |" * len(CLOCKS),
    ]
    for name, each in cycles.items():
        lines.append(f"| {name} | " + " | ".join(f"{100 * each / (c * 1e6):.2f} %" for c in CLOCKS) + " |")
    return lines


def costs(rows: dict[str, Cost], names: list[str]) -> list[str]:
    """A table of functions."""
    lines = ["| function | instructions | code, bytes | stack, bytes |", "| --- | --- | --- | --- |"]
    for name in names:
        cost, called = rows[name], function(name)
        what = f"`{called}`{name[len(called) :]}"
        lines.append(f"| {what} | {cost.instructions} | {cost.code} | {cost.stack} |")
    return lines


def loop_table(rows: dict[str, Cost]) -> str:
    """What the interrupt and the learner cost, as Markdown."""
    tick, update = rows["self_calibrating_curve_tick"], rows["learner_update, curve"]
    once_a_window = update.instructions + rows["channel_publish"].instructions
    learner = [name for name in rows if "learn" in function(name)]
    once = [name for name in rows if "publish" in name or "offer" in name]
    ticks = [name for name in rows if name.startswith(("channel_step", "eft_step")) or name.endswith("_tick")]
    parts = [name for name in rows if name not in learner + once + ticks]
    lines = [
        "<!-- Written by firmware/check_budgets.py; do not edit. -->",
        "# Loop budget",
        "",
        "Instructions on a Cortex-M4F, counted under QEMU over all inputs "
        "tried, NaN and infinities included, of "
        "a plain `cargo build --release` by the compiler that `firmware/rust-toolchain.toml` names. "
        "`make firmware` fails when a function exceeds its entry in `firmware/budgets.toml`. They are "
        f"instructions, not cycles of silicon; the shares assume {CYCLES_PER_INSTRUCTION} cycles for each.",
        "",
        "## The interrupt",
        "",
        "The worst of all ticks, the first and the last of a window included. "
        "A rig that stands in a `static`, as "
        "`eft export` writes it for Rust, is known to the compiler, which "
        "leaves out what the rig does not have: "
        "these are the functions that end in `_tick`. The paper's has limits and a measured velocity; the "
        "self-calibrating one feedforward, estimators and guard as well, and with `curve` its flow table is "
        "corrected; `guarded` is `firmware/rigs/guarded.toml`, with velocity observer, protection and supply "
        "correction. `channel_step` takes any channel by reference, and "
        "`eft_step_f32` is that from C, with its "
        "checks and the whole output.",
        "",
        *costs(rows, ticks),
        "",
        f"Share of the processor that the self-calibrating tick with the curve takes ({tick.instructions} "
        "instructions a tick):",
        "",
        *shares(
            "sample rate, Hz",
            {str(rate): rate * tick.instructions * CYCLES_PER_INSTRUCTION for rate in RATES},
        ),
        "",
        "Once a window the interrupt hands a window over and takes a calibration, between two ticks:",
        "",
        *costs(rows, once),
        "",
        "## The learner",
        "",
        "Once a window (16 ticks at 4096 Hz), inline behind the tick or in a task of lower "
        "priority, which may take up to a whole window:",
        "",
        *costs(rows, learner),
        "",
        "Share of the processor that it takes with the curve, publishing "
        "included, at any sample rate (at most "
        f"{MOST_WINDOWS} windows a second of {once_a_window} instructions):",
        "",
        *shares("", {"at most": MOST_WINDOWS * once_a_window * CYCLES_PER_INSTRUCTION}),
        "",
        "## The parts by themselves",
        "",
        *costs(rows, parts),
    ]
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
