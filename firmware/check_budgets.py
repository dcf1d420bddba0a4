#!/usr/bin/env python3
"""Compares the measured cost of every function of budgets.toml with its budget, and writes the docs table.

usage: check_budgets.py IMAGE LOOP_TABLE M4F M33 M0+
IMAGE is the measuring image for the Cortex-M4F (for sizes and calls), LOOP_TABLE the page to write. The
others are the outputs of the measuring images on each processor.
"""

import re
import subprocess
import sys
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
# Assumed for the shares; the page has the values of a model.
CYCLES_PER_INSTRUCTION = 2.5
# The compiler's software arithmetic, mostly of doubles.
SOFT_FLOAT = re.compile(r"__aeabi_(d|f|u?[il]2[df])|__[a-z]+[sd]f\d?$|__fix[a-z]+$|compiler_builtins.*float")


def function(subject: str) -> str:
    """The function of a subject, which may name a setting: `function, setting`."""
    return subject.partition(",")[0]


@dataclass
class Cost:
    """The measured cost of a function."""

    instructions: int
    code: int
    stack: int
    m33: int
    m0plus: int


def output(*command: str) -> str:
    """The output of a program."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def symbols(image: str) -> dict[str, tuple[int, int]]:
    """First address and bytes of every symbol."""
    rows = (line.split() for line in output("arm-none-eabi-nm", "-S", image).splitlines())
    return {row[3]: (int(row[0], 16) & ~1, int(row[1], 16)) for row in rows if len(row) == 4}


def calls(image: str, where: dict[str, tuple[int, int]]) -> dict[str, set[str]]:
    """The functions that each function calls or jumps to."""
    found: dict[str, set[str]] = {}
    name = ""
    for line in output("arm-none-eabi-objdump", "-d", "--no-show-raw-insn", image).splitlines():
        if head := re.match(r"^[0-9a-f]+ <(.*)>:$", line):
            name = head[1]
            found[name] = set()
        elif branch := re.match(r" *([0-9a-f]+):\tb\S*\t[0-9a-f]+ <([^+>]+)", line):
            start, length = where.get(name, (0, 0))
            # Padding after a function can look like a branch.
            if not length or int(branch[1], 16) < start + length:
                found[name] |= {branch[2]} - {name}
    return found


def reached(name: str, graph: dict[str, set[str]]) -> set[str]:
    """A function and all functions that it calls."""
    found, waiting = set(), [name]
    while waiting:
        function = waiting.pop()
        if function not in found:
            found.add(function)
            waiting += graph.get(function, ())
    return found


RATES, CLOCKS = [1000, 2048, 4096, 5000, 10000, 20000], [48, 84, 168, 216, 480]
# A window lasts at least 2.5 ms at any sample rate.
MOST_WINDOWS = 400


def shares(head: str, cycles: dict[str, float]) -> list[str]:
    """A table of the processor's share by clock, for a number of cycles per second."""
    lines = [
        f"| {head} | " + " | ".join(f"{clock} MHz" for clock in CLOCKS) + " |",
        "| --- |" + " --- |" * len(CLOCKS),
    ]
    for name, each in cycles.items():
        lines.append(f"| {name} | " + " | ".join(f"{100 * each / (c * 1e6):.2f} %" for c in CLOCKS) + " |")
    return lines


def costs(rows: dict[str, Cost], names: list[str]) -> list[str]:
    """A table of functions."""
    lines = [
        "| function | instructions | code, bytes | stack, bytes | on a Cortex-M33 | on a Cortex-M0+ |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name in names:
        cost, called = rows[name], function(name)
        cells = (cost.instructions, cost.code, cost.stack, cost.m33, cost.m0plus)
        lines.append(f"| `{called}`{name[len(called) :]} | " + " | ".join(map(str, cells)) + " |")
    return lines


# Each kind of channel, with its function in a `static`.
TICKS = {
    "paper": "paper_tick",
    "self-calibrating": "self_calibrating_tick",
    "curve": "self_calibrating_curve_tick",
    "crowded": "crowded_tick",
    "guarded": "guarded_tick",
    "watched": "watched_tick",
}
# Functions that run in a task, besides the learner.
TASK = ("configure", "check", "integrity")


def ways(rows: dict[str, Cost], budgets: dict[str, dict[str, int]]) -> list[str]:
    """A table of the three ways to call a channel, with the budgets in brackets."""
    lines = ["| tick | `static` in Rust | by reference | from C | goal |", "| --- | --- | --- | --- | --- |"]
    for kind, static in TICKS.items():
        names = (static, f"channel_step, {kind}", f"eft_step_f32, {kind}")
        cells = [f"{rows[name].instructions} ({budgets[name]['instructions']})" for name in names]
        lines.append(f"| {kind} | " + " | ".join(cells) + f" | {budgets[static].get('goal', 'none')} |")
    return lines


def loop_table(rows: dict[str, Cost], budgets: dict[str, dict[str, int]]) -> str:
    """The costs of the interrupt and the learner, as Markdown."""
    tick, update = rows["self_calibrating_curve_tick"], rows["learner_update, curve"]
    once_a_window = update.instructions + rows["channel_publish"].instructions
    task = [name for name in rows if any(word in name for word in TASK)]
    learner = [name for name in rows if "learn" in function(name) and name not in task]
    once = [name for name in rows if "publish" in name or "offer" in name]
    ticks = [name for name in rows if name.startswith(("channel_step", "eft_step")) or name.endswith("_tick")]
    parts = [name for name in rows if name not in task + learner + once + ticks]
    stacks = {end: max(rows[name].stack for name in task if name.endswith(end)) for end in ("f32", "f64")}
    text = (HERE / "loop-budget.md.in").read_text()
    plain = [kind for kind in TICKS if kind not in ("guarded", "watched")]

    def further(name: str, than: Callable[[str], str]) -> list[str]:
        more = [rows[f"{name}, {kind}"].instructions - rows[than(kind)].instructions for kind in plain]
        return [" to ".join(map(str, sorted({min(more), max(more)})))]

    tables = {
        "WAYS": ways(rows, budgets),
        "BY_REFERENCE": further("channel_step", lambda kind: TICKS[kind]),
        "FROM_C": further("eft_step_f32", lambda kind: f"channel_step, {kind}"),
        "TICKS": costs(rows, ticks),
        "TICK_INSTRUCTIONS": [str(tick.instructions)],
        "SHARES": shares(
            "sample rate, Hz",
            {str(rate): rate * tick.instructions * CYCLES_PER_INSTRUCTION for rate in RATES},
        ),
        "ONCE": costs(rows, once),
        "LEARNER": costs(rows, learner),
        "WINDOWS": [str(MOST_WINDOWS)],
        "WINDOW_INSTRUCTIONS": [str(once_a_window)],
        "LEARNER_SHARES": shares("", {"at most": MOST_WINDOWS * once_a_window * CYCLES_PER_INSTRUCTION}),
        "TASK": costs(rows, task),
        "STACK_F32": [str(stacks["f32"])],
        "STACK_F64": [str(stacks["f64"])],
        "PARTS": costs(rows, parts),
        "CYCLES": [str(CYCLES_PER_INSTRUCTION)],
    }
    for name, lines in tables.items():
        text = text.replace(f"@{name}@", "\n".join(lines))
    return text


def counts(measurements: str) -> dict[str, tuple[int, int]]:
    """Instructions and bytes of stack of each subject, as an image printed them."""
    lines = (line.rsplit(maxsplit=2) for line in Path(measurements).read_text().splitlines())
    return {name: (int(instructions), int(stack)) for name, instructions, stack in lines}


def main(image: str, page: str, m4f: str, m33: str, m0plus: str) -> int:
    """Print budgets against measurements; 1 if any is exceeded."""
    budgets = tomllib.loads((HERE / "budgets.toml").read_text())
    where = symbols(image)
    graph = calls(image, where)
    measured: dict[str, Cost] = {}
    problems = []
    on_m33, on_m0plus = counts(m33), counts(m0plus)
    for name, (instructions, stack) in counts(m4f).items():
        code = reached(function(name), graph)
        size = sum(where[f][1] for f in code if f in where)
        measured[name] = Cost(instructions, size, stack, on_m33[name][0], on_m0plus[name][0])
        # A configuration is designed in doubles, in a task.
        if "configure" not in name and "check" not in name:
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
        pairs["instructions on a Cortex-M33"] = (cost.m33, budget["instructions"])
        problems += [f"{name}: {m} {what}, {b} allowed" for what, (m, b) in pairs.items() if m > b]
    path, text = Path(page), loop_table(measured, budgets)
    if not path.exists() or path.read_text() != text:
        path.write_text(text)
        print(f"{path} has changed: commit it")
    print("\n".join(problems) or "every budget holds; no soft-float routine is reachable from any tick")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
