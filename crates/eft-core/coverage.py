"""Branch coverage of the core by its own tests.

    python crates/eft-core/coverage.py [FOLDER|FILE...]

It needs a nightly Rust with `llvm-tools`, because only a nightly compiler counts branches. A branch is
missed if it was never taken, or always. Test code does not count. Without arguments all modules count, and
the exit code is 1 below the goal.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

from mutants import FOLDERS, ROOT, sources

BUILD = ROOT / "target" / "coverage"
SHARE = 0.95


def tools() -> Path:
    """The folder of llvm-profdata and llvm-cov."""
    rustc = ["rustc", "+nightly", "--print", "target-libdir"]
    folder = (
        Path(subprocess.run(rustc, capture_output=True, check=True, text=True).stdout.strip()).parent / "bin"
    )
    if not (folder / "llvm-cov").exists():
        sys.exit(f"no llvm-cov in {folder}: rustup component add llvm-tools --toolchain nightly")
    return folder


def tested() -> list[str]:
    """Run the tests, and return their executables."""
    shutil.rmtree(BUILD / "profiles", ignore_errors=True)
    environment = {
        **os.environ,
        "CARGO_TARGET_DIR": str(BUILD),
        "RUSTFLAGS": "-C instrument-coverage -Z coverage-options=branch",
        "LLVM_PROFILE_FILE": str(BUILD / "profiles" / "%p-%m.profraw"),
    }
    cargo = ["cargo", "+nightly", "test", "--quiet", "--locked", "--package", "eft-core", "--tests"]
    subprocess.run(cargo, cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)
    listing = [*cargo, "--no-run", "--message-format=json"]
    listed = subprocess.run(
        listing, cwd=ROOT, env=environment, check=True, capture_output=True, text=True
    ).stdout
    messages = (json.loads(line) for line in listed.splitlines() if line.startswith("{"))
    return [message["executable"] for message in messages if message.get("executable")]


def branches(executables: list[str]) -> dict[Path, dict[tuple[int, ...], list[int]]]:
    """For each file and each place of a branch: how often it was taken, and how often not."""
    folder, data = tools(), BUILD / "tests.profdata"
    profiles = [str(file) for file in (BUILD / "profiles").glob("*.profraw")]
    subprocess.run([folder / "llvm-profdata", "merge", "-sparse", *profiles, "-o", data], check=True)
    objects = [part for name in executables for part in ("-object", name)]
    export = [str(folder / "llvm-cov"), "export", *objects, f"-instr-profile={data}"]
    export.append("--ignore-filename-regex=/(rustc|registry)/")
    report = json.loads(subprocess.run(export, capture_output=True, check=True, text=True).stdout)
    found: dict[Path, dict[tuple[int, ...], list[int]]] = {}
    for file in report["data"][0]["files"]:
        places = found.setdefault(Path(file["filename"]).relative_to(ROOT), {})
        for *place, taken, not_taken, _, _, _ in file["branches"]:
            counts = places.setdefault(tuple(place), [0, 0])
            counts[0], counts[1] = counts[0] + taken, counts[1] + not_taken
    return found


def main() -> int:
    """Print the missed branches and the share of the others."""
    folders = sys.argv[1:] or FOLDERS
    found = branches(tested())
    total, missed = 0, 0
    for file, lines in sources(folders):
        for (line, *_), counts in sorted(found.get(file, {}).items()):
            if line > len(lines):
                continue
            total += 2
            for count, what in zip(counts, ("never taken", "always taken"), strict=True):
                if count == 0:
                    missed += 1
                    print(f"{file}:{line}: {what}: {lines[line - 1].strip()}")
    share = 1.0 - missed / total if total else 0.0
    print(f"{total - missed} of {total} branches, {100 * share:.1f} %")
    return 0 if sys.argv[1:] or share >= SHARE else 1


if __name__ == "__main__":
    sys.exit(main())
