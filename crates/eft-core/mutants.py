"""Mutants of the core: small wrong changes, one at a time, that its own tests must notice.

    python crates/eft-core/mutants.py [FOLDER|FILE...] [--sample N] [--seed N] [--seconds N]

A change is textual: a comparison, an operator, a sign, a constant or a truth value. The tests run
on a copy of the repository below `target/mutants`; the sources do not change. A change that does not
compile does not count.
"""

from __future__ import annotations

import argparse
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COPY = ROOT / "target" / "mutants"
FOLDERS = (
    "compensation",
    "force_loop",
    "table",
    "protection",
    "velocity",
    "learning",
    "channel",
    "controller",
    "number",
    "parameters",
    "cause",
    "signals",
    "status",
    "error",
    "integrity",
)
SHARE = 0.95

#: Patterns in code, and their replacements.
CHANGES = [
    (r"(?<= )<(?= )", ">="),
    (r"(?<= )<=(?= )", "<"),
    (r"(?<= )>(?= )", "<="),
    (r"(?<= )>=(?= )", ">"),
    (r"(?<= )==(?= )", "!="),
    (r"(?<= )!=(?= )", "=="),
    (r"(?<=[\w)] )\+(?= )", "-"),
    (r"(?<=[\w)] )-(?= )", "+"),
    (r"(?<=[\w)] )\*(?= )", "/"),
    (r"(?<= )/(?= )", "*"),
    (r"&&", "||"),
    (r"\|\|(?! \w+ in)", "&&"),
    (r"\.lt\(", ".gt("),
    (r"\.gt\(", ".lt("),
    (r"\.le\(", ".gt("),
    (r"\btrue\b", "false"),
    (r"\bfalse\b", "true"),
    (r"saturating_add\(1\)", "saturating_add(2)"),
    (r"(?<=splat\()\d+\.\d+(?=\))", "0.75"),
]


@dataclass(frozen=True)
class Mutant:
    """A piece of a line, and what takes its place."""

    file: Path
    line: int
    start: int
    end: int
    text: str

    def __str__(self) -> str:
        before = (ROOT / self.file).read_text().splitlines()[self.line]
        change = f"{before[self.start : self.end]} -> {self.text}"
        return f"{self.file}:{self.line + 1}: {change}   in: {before.strip()}"


def sources(folders: Iterable[str]) -> Iterator[tuple[Path, list[str]]]:
    """The files of some folders, and their lines up to the tests."""
    source = ROOT / "crates/eft-core/src"
    for folder in folders:
        # A folder's parent module is a file of the same name.
        for file in sorted([*source.glob(f"{folder}.rs"), *(source / folder).rglob("*.rs")]):
            if file.stem in ("tests", "established") or file.parent.name == "tests":
                continue
            lines = file.read_text().splitlines()
            for number, line in enumerate(lines):
                if line.strip() == "#[cfg(test)]":
                    item = next(below for below in lines[number + 1 :] if not below.startswith("#["))
                    if item.endswith("{"):
                        lines = lines[:number]
                        break
            yield file.relative_to(ROOT), lines


def mutants(folders: list[str]) -> list[Mutant]:
    """All mutants, except in tests, documentation and generic bounds."""
    found = []
    for file, lines in sources(folders):
        for number, line in enumerate(lines):
            code = line.split("//")[0]
            if not code.strip() or code.strip().startswith(("#", "use ", "impl", "fn ", "pub fn", "where")):
                continue
            for pattern, text in CHANGES:
                for match in re.finditer(pattern, code):
                    found.append(Mutant(file, number, match.start(), match.end(), text))
    return found


def copied() -> None:
    """Copy the files of the repository, without build results."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True, text=True
    ).stdout
    shutil.rmtree(COPY / "src", ignore_errors=True)
    for name in filter(None, listed.split("\0")):
        if name.startswith(("crates/", "src/", "benches/", "firmware/golden", "Cargo")):
            to = COPY / "src" / name
            to.parent.mkdir(parents=True, exist_ok=True)
            # With a new time, so that nothing built from the last mutant of a stopped run stays.
            shutil.copyfile(ROOT / name, to)


def tested(seconds: int) -> str:
    """Result of the core's tests: "passes", "noticed", "too slow" or "does not compile"."""
    # The unit tests notice most mutants. Without optimization they compile in a third of the time.
    for tests, level in ((["--lib"], 0), (["--test", "core"], 1)):
        cargo = ["cargo", "test", "--quiet", "--offline", "--locked", "-p", "eft-core", *tests]
        with subprocess.Popen(
            cargo,
            cwd=COPY / "src",
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            # In a group of its own, because the end of cargo does not end the tests that it has started.
            start_new_session=True,
            env={
                **os.environ,
                "CARGO_TARGET_DIR": str(COPY / f"build{level}"),
                "CARGO_PROFILE_DEV_DEBUG": "0",
                "CARGO_PROFILE_DEV_OPT_LEVEL": str(level),
            },
        ) as running:
            try:
                _, said = running.communicate(timeout=seconds)
            except subprocess.TimeoutExpired:
                os.killpg(running.pid, signal.SIGKILL)
                return "too slow"
        if running.returncode:
            return "does not compile" if "could not compile" in said else "noticed"
    return "passes"


def main() -> int:
    """Try the mutants, and print the result of each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "folders", nargs="*", default=FOLDERS, help="folder or file of the core without .rs, as learning/gate"
    )
    parser.add_argument("--sample", type=int, help="number of mutants, drawn at random")
    parser.add_argument("--seed", type=int, default=1, help="seed of the draw (default: %(default)s)")
    parser.add_argument(
        "--seconds", type=int, default=120, help="limit for the tests of one mutant (default: %(default)s)"
    )
    arguments = parser.parse_args()
    found = mutants(arguments.folders)
    print(f"{len(found)} mutants of {', '.join(arguments.folders)}")
    if arguments.sample:
        # In the order of the draw, so that the tried ones are a random sample at any time.
        found = random.Random(arguments.seed).sample(found, min(arguments.sample, len(found)))
    copied()
    if (before := tested(10 * arguments.seconds)) != "passes":
        print(f"without a mutant: {before}", file=sys.stderr)
        return 1
    noticed, survivors = 0, 0
    start = time.monotonic()
    for mutant in found:
        file = COPY / "src" / mutant.file
        original = file.read_text()
        lines = original.splitlines(keepends=True)
        line = lines[mutant.line]
        lines[mutant.line] = line[: mutant.start] + mutant.text + line[mutant.end :]
        file.write_text("".join(lines))
        result = tested(arguments.seconds)
        file.write_text(original)
        noticed += result in ("noticed", "too slow")
        survivors += result == "passes"
        print(f"{'SURVIVES' if result == 'passes' else result:17}{mutant}", flush=True)
    tried = noticed + survivors
    share = noticed / tried if tried else 0.0
    print(f"{noticed} of {tried} noticed, {100 * share:.1f} %, in {time.monotonic() - start:.0f} s")
    return 0 if share >= SHARE else 1


if __name__ == "__main__":
    sys.exit(main())
