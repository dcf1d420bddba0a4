"""Damaged files, folders and messages for the readers of the Python package.

    python fuzz/damage.py KIND... [--minutes M] [--seed N] [--only K]

Each attempt damages a sound example at random. The reader must return, or raise ValueError or OSError with
a short message of one line. `eft` must end with a documented exit code and at most one line of error. A
worker process makes the attempts. Each may use 5 s of processor time and 160 MiB of further memory.
`--only K` repeats attempt K of a seed.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import io
import json
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path
from random import Random
from typing import IO

import readers

SECONDS, MEBIBYTES, HANG = 5.0, 160.0, 90.0
LONGEST = 1300
READY = "ready"


def peak() -> float:
    """Largest memory of this process since the last call of `anew`, MiB; 0 where it is unknown."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM"):
                return int(line.split()[1]) / 1024
    return 0.0


def anew() -> float:
    """Begin a new peak; returns the memory now."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return peak()


def attempt(reader: readers.Reader, chance: Random) -> str:
    """Make one attempt; the result is `read`, `refused`, or a defect."""
    reader.damage(chance)
    before, began, said = anew(), time.process_time(), ""
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            reader.read(chance)
    except (ValueError, OSError) as error:
        said = str(error)
        if not said or "\n" in said or len(said) > LONGEST:
            return f"DEFECT message {said[:300]!r}"
    except BaseException:
        where = traceback.format_exc().split("\n")
        return "DEFECT " + " | ".join(line.strip() for line in where[-8:] if line.strip(" ~^"))[-900:]
    seconds, taken = time.process_time() - began, peak() - before
    if seconds > SECONDS or taken > MEBIBYTES:
        return f"DEFECT {seconds:.1f} s, {taken:.0f} MiB"
    return "refused" if said else "read"


def work(kind: str, seed: int, first: int, count: int) -> None:
    """Make attempts, and print a line for each."""
    with tempfile.TemporaryDirectory() as folder:
        with contextlib.redirect_stdout(io.StringIO()):
            reader = readers.KINDS[kind](Path(folder))
        print(READY, flush=True)
        for number in range(first, first + count):
            faulthandler.dump_traceback_later(HANG, exit=True)
            print(json.dumps(attempt(reader, Random(f"{seed} {kind} {number}"))), flush=True)


def end_of(said: IO[str], worker: subprocess.Popen[str]) -> str:
    """The last characters that a worker wrote before its end."""
    worker.wait()
    said.seek(0)
    return said.read()[-900:]


def tried(kind: str, seed: int, minutes: float, only: int | None) -> Counter[str]:
    """Let workers make attempts until the time is over; returns the numbers of results."""
    count: Counter[str] = Counter()
    end, number = time.monotonic() + 60 * minutes, only or 0
    # A new worker from time to time, so that memory does not accumulate.
    many = 300 if only is None else 1
    while time.monotonic() < end and not (only is not None and count):
        command = [sys.executable, __file__, kind, f"--seed={seed}", f"--worker={number}", f"--count={many}"]
        # A file, because a worker would wait for ever for space in a pipe that nobody reads.
        with (
            tempfile.TemporaryFile("w+") as said,
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=said, text=True) as worker,
        ):
            if not worker.stdout.readline():
                sys.exit(f"{kind}: the worker does not start: {end_of(said, worker)}")
            for _ in range(many):
                line = worker.stdout.readline()
                result = json.loads(line) if line else "DEFECT the worker ended: " + end_of(said, worker)
                count[result.split()[0]] += 1
                if result.startswith("DEFECT"):
                    print(f"{kind} --seed {seed} --only {number}: {result}", flush=True)
                number += 1
                if not line or time.monotonic() > end:
                    break
            worker.kill()
    return count


def main() -> int:
    """Make attempts for each kind, and print their numbers; 1 if one shows a defect."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "kinds", nargs="+", choices=readers.KINDS, metavar="KIND", help=", ".join(readers.KINDS)
    )
    parser.add_argument(
        "--minutes", type=float, default=1.0, help="wall time for each kind (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the damage (default: %(default)s)")
    parser.add_argument("--only", type=int, help="make one attempt only")
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--count", type=int, help=argparse.SUPPRESS)
    a = parser.parse_args()
    if a.worker is not None:
        work(a.kinds[0], a.seed, a.worker, a.count)
        return 0
    defects = 0
    for kind in a.kinds:
        count = tried(kind, a.seed, a.minutes, a.only)
        defects += count["DEFECT"]
        print(
            f"{kind}: {count.total()} attempts, {count['read']} read, {count['refused']} refused, "
            f"{count['DEFECT']} defects",
            flush=True,
        )
    return int(defects > 0)


if __name__ == "__main__":
    sys.exit(main())
