#!/usr/bin/env python3
"""Measures every function of budgets.toml on the target and holds it against its budget.

usage: check_budgets.py IMAGE MEASUREMENTS [LOOP_TABLE]
IMAGE is the measuring image (for sizes), MEASUREMENTS what it printed, LOOP_TABLE where to write the
docs table.
"""

import subprocess
import sys
import tomllib
from pathlib import Path

HERE = Path(__file__).parent
# Bound on cycles per instruction used in the table: no instruction of the tick but divide and root (14 each
# on a Cortex-M4F) takes more than 3, most take 1; flash wait states behind a prefetch are within it.
CYCLES_PER_INSTRUCTION = 2.5


def sizes(image: str) -> dict[str, int]:
    """Bytes of every symbol."""
    out = subprocess.run(["arm-none-eabi-nm", "-S", image], check=True, capture_output=True, text=True).stdout
    rows = (line.split() for line in out.splitlines())
    return {row[3]: int(row[1], 16) for row in rows if len(row) == 4}


def loop_table(rows: dict[str, tuple[int, int, int]]) -> str:
    """The share of the period one tick takes, as Markdown."""
    instructions = rows["eft_step_f32"][0]
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
    lines += ["", "| function | instructions | code, bytes | stack, bytes |", "| --- | --- | --- | --- |"]
    lines += [f"| `{name}` | {i} | {code} | {stack} |" for name, (i, code, stack) in rows.items()]
    return "\n".join(lines) + "\n"


def main(image: str, measurements: str, table: str | None = None) -> int:
    """Print budgets against measurements; 1 if any is exceeded."""
    budgets = tomllib.loads((HERE / "budgets.toml").read_text())
    pinned = budgets.pop("toolchain")
    size = sizes(image)
    measured = {}
    for line in Path(measurements).read_text().splitlines():
        name, instructions, stack = line.split()
        measured[name] = (int(instructions), size[name], int(stack))
    failed = False
    print(f"{'function':28} {'instructions':>16} {'code':>12} {'stack':>10}   (measured / budget)")
    for name, budget in budgets.items():
        if name not in measured:
            print(f"{name:28} was not measured")
            failed = True
            continue
        limits = (budget["instructions"], budget["code"], budget["stack"])
        cells = [f"{m}/{b}" for m, b in zip(measured[name], limits, strict=True)]
        over = any(m > b for m, b in zip(measured[name], limits, strict=True))
        note = "OVER BUDGET" if over else ""
        if budget.get("goal", limits[0]) < limits[0]:
            note += f" goal {budget['goal']} not met: {budget['why']}"
        print(f"{name:28} {cells[0]:>16} {cells[1]:>12} {cells[2]:>10}   {note}")
        failed |= over
    for name in measured.keys() - budgets.keys():
        print(f"{name} has no budget")
        failed = True
    if table:
        path = Path(table)
        text = loop_table(measured)
        if not path.exists() or path.read_text() != text:
            path.write_text(text)
            print(f"{path} has changed: commit it")
    if failed:
        version = subprocess.run(["rustc", "--version"], capture_output=True, text=True).stdout.split()[1]
        print(f"budgets are for rustc {pinned}, this is {version}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
