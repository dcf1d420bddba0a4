"""Proves the lemmas of `lemmas/` for the code of the release build, and refutes a broken twin of each.

    python proofs/prove.py [--fast] [--only WORDS] [--seconds N] [--processes N]

Needs Rust with the target thumbv7em-none-eabihf and `pip install bitwuzla`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from multiprocessing import get_context
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
TARGET = "thumbv7em-none-eabihf"
BUILT = HERE.parent / "target" / "proofs"
UNROLL = 4000
"""Largest unrolled loop, in LLVM's units; the release build's own limit leaves one loop of the tick in `f64`."""


def lowered() -> list[Path]:
    """The LLVM IR of the steps and of the core, as the release build makes it with its loops unrolled."""
    for package in ([], ["-p", "eft-core", "--lib"]):
        command = ["cargo", "rustc", "--quiet", "--locked", "--release", "--target", TARGET, *package]
        subprocess.run(
            [*command, "--", "--emit=llvm-ir", "-C", f"llvm-args=-unroll-threshold={UNROLL}"],
            cwd=HERE / "lowered",
            env={**os.environ, "CARGO_TARGET_DIR": str(BUILT)},
            check=True,
        )
    folder = BUILT / TARGET / "release" / "deps"
    # Older builds leave their files; the newest one counts.
    return [
        max(folder.glob(f"{crate}-*.ll"), key=lambda p: p.stat().st_mtime)
        for crate in ("eft_lowered", "eft_core")
    ]


def _lemma(task):
    from lemma import check
    from lemmas import LEMMAS

    number, precision, broken, seconds, files = task
    texts = [Path(file).read_text() for file in files]
    return task[:3], check(texts, LEMMAS[number], precision, broken, seconds)


def _rule(task):
    import rounding
    import rules
    from lemma import solved

    number, op, size, broken, seconds, _ = task
    rule = [*rules.CHECKS, *rounding.CHECKS][number][0]
    return task[:4], solved([], {"rule": rules.shown(rule, op, size, broken)}, seconds)


def _run(task):
    return _rule(task) if len(task) == 6 else _lemma(task)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--fast", action="store_true", help="single precision, without what takes long, and no rules"
    )
    parser.add_argument("--only", default="", help="lemmas whose name holds these words")
    parser.add_argument(
        "--seconds", type=int, default=240, help="of the processor for one claim (default: %(default)s)"
    )
    parser.add_argument(
        "--processes", type=int, default=min(2, os.cpu_count() or 1), help="at once (default: %(default)s)"
    )
    arguments = parser.parse_args()
    try:
        import bitwuzla  # noqa: F401
    except ImportError:
        print("make prove needs bitwuzla: pip install 'bitwuzla>=0.9,<0.10'", file=sys.stderr)
        return 1
    import rounding
    import rules
    from lemmas import LEMMAS

    start = time.monotonic()
    files = [str(path) for path in lowered()]
    tasks: list[tuple] = []
    labels: dict[tuple, str] = {}
    for number, lemma in enumerate(LEMMAS):
        for precision in lemma.precisions:
            if arguments.only in lemma.name and not (
                arguments.fast and (precision == "f64" or not lemma.fast)
            ):
                for broken in (False, True):
                    tasks.append((number, precision, broken, arguments.seconds, files))
                    labels[number, precision, broken] = f"{lemma.name}, {precision}"
    for number, (_, name, operations, sizes) in enumerate([*rules.CHECKS, *rounding.CHECKS]):
        for op in operations:
            for size in sizes:
                if not arguments.fast and arguments.only in f"rule: {name}":
                    for broken in (False, True):
                        tasks.append((number, op, size, broken, arguments.seconds, files))
                        labels[number, op, size, broken] = f"rule: {name}, {op}, {8 * size} bits"
    # The hard lemmas come last, so that an interrupted run has printed the others.
    tasks.sort(key=lambda task: len(task) != 6 and LEMMAS[task[0]].hard)
    width = max(map(len, labels.values()))
    good = bad = unknown = 0
    # One process for each lemma, so that the solver's memory is freed.
    results = {}
    with get_context("spawn").Pool(arguments.processes, maxtasksperchild=1) as pool:
        for key, outcome in pool.imap_unordered(_run, tasks):
            results[key] = outcome
            lemma, twin = (results.get((*key[:-1], broken)) for broken in (False, True))
            if lemma is None or twin is None:
                continue
            right = lemma.verdict == "proven" and twin.verdict == "refuted"
            hard = len(key) == 3 and LEMMAS[key[0]].hard and "refused" not in (lemma.verdict, twin.verdict)
            is_open = hard and not right and lemma.verdict != "refuted" and twin.verdict != "proven"
            good, unknown, bad = good + right, unknown + is_open, bad + (not right and not is_open)
            times = (
                f"{lemma.verdict:12} {lemma.seconds:6.1f} s   broken: {twin.verdict} {twin.seconds:6.1f} s"
            )
            print(f"{labels[key]:{width}}  {times}", flush=True)
            if not right:
                print(f"  {lemma.text} {twin.text}", file=sys.stderr, flush=True)
    print(f"{good} proven and their broken twins refuted, {unknown} open for want of time, {bad} fail")
    print(f"in {time.monotonic() - start:.0f} s; those above are seconds of the processor")
    return 1 if bad or not good else 0


if __name__ == "__main__":
    sys.exit(main())
