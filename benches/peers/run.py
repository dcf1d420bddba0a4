"""Measure the package against its peers in one run: `make bench`.

The subjects take turns in several rounds. Every ratio is the median of the ratios of the rounds, so other
load of the machine affects both alike. The script writes `results.json`, from which `page.py` makes the
figures and the page. ``run.py short.json --short`` runs everything once, without a page.
"""

import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from subjects import DURATION, RATE, Subjects, building, seconds

import eft
from eft import _native

SHORT = "--short" in sys.argv
LEAST, ROUNDS, PATIENCE = (1, 1, 0.0) if SHORT else (5, 25, 60.0)
BATCH = 128
WIDE, KEPT = 32, 8
"""Tests of the other batches, and of that with traces."""
SCIPY_TICKS = 1024
JAX_RIGS, JAX_TICKS = 64, 8192
TESTS = 100 if SHORT else 10_000


def distance(force, reference):
    """Largest error over the largest force of the reference."""
    return float(np.abs(force - reference[: force.size]).max() / np.abs(reference).max())


def interleaved(subjects):
    """Seconds of each subject in each round; beyond a minute fewer rounds, down to a minimum."""
    times = {name: [] for name in subjects}
    for work in subjects.values():
        work()
    start = time.perf_counter()
    for n in range(ROUNDS):
        if n >= LEAST and time.perf_counter() - start > PATIENCE:
            break
        for name, work in subjects.items():
            times[name].append(seconds(work))
    return times


def ratio(times, name, to):
    return statistics.median(a / b for a, b in zip(times[name], times[to], strict=True))


def median_ms(times, name, tests=1):
    return 1e3 * statistics.median(times[name]) / tests


def compare(s, converged):
    """One test, and batches on one core and on two."""
    # Each kind in separate turns: memory that a large batch frees causes page faults in a single test.
    single = interleaved({"c": s.c_one, "eft": s.eft_one, "numba": s.numba_one, "adaptive": s.eft_adaptive})
    plain = interleaved(
        {
            "c": s.c_one,
            "batch": lambda: s.eft_batch(BATCH, 1),
            "batch on two cores": lambda: s.eft_batch(BATCH, 2),
        }
    )
    others = interleaved(
        {
            "c": s.c_one,
            "batch with traces": lambda: s.eft_batch_with_traces(KEPT, 1),
            "adaptive batch": lambda: s.eft_batch(WIDE, 1, s.adaptive),
            "noisy batch": lambda: s.eft_batch(WIDE, 1, s.noisy),
            "batch of buildings": lambda: s.eft_batch_of_buildings(WIDE, 1),
        }
    )
    scipy = min(seconds(lambda: s.scipy(SCIPY_TICKS)) for _ in range(3)) * DURATION * RATE / SCIPY_TICKS
    s.jax(JAX_RIGS, JAX_TICKS)
    jax = min(seconds(lambda: s.jax(JAX_RIGS, JAX_TICKS)) for _ in range(3))
    jax *= DURATION * RATE / JAX_TICKS / JAX_RIGS
    c = median_ms(single, "c")
    return {
        "one over c": ratio(single, "eft", "c"),
        "c over numba": ratio(single, "c", "numba"),
        "solve_ivp over one": 1e3 * scipy / median_ms(single, "eft"),
        "batch throughput over c": ratio(plain, "c", "batch") * BATCH,
        "adaptive over c": ratio(single, "adaptive", "c"),
        "adaptive throughput over c": ratio(others, "c", "adaptive batch") * WIDE,
        "noisy throughput over c": ratio(others, "c", "noisy batch") * WIDE,
        "traces throughput over c": ratio(others, "c", "batch with traces") * KEPT,
        "stories throughput over c": ratio(others, "c", "batch of buildings") * WIDE,
        "two cores over one": ratio(plain, "batch", "batch on two cores"),
        "milliseconds": {
            "eft, one test": median_ms(single, "eft"),
            "C, one step a tick": c,
            "numba, one step a tick": median_ms(single, "numba"),
            "eft, batch on one core": median_ms(plain, "batch", BATCH),
            "eft, batch on two cores": median_ms(plain, "batch on two cores", BATCH),
            "eft, batch on one core, traces kept": median_ms(others, "batch with traces", KEPT),
            "eft, one adaptive test": median_ms(single, "adaptive"),
            "eft, batch on one core, adaptive": median_ms(others, "adaptive batch", WIDE),
            "eft, batch on one core, adaptive, noise on every sensor": median_ms(others, "noisy batch", WIDE),
            "eft, batch on one core, three stories": median_ms(others, "batch of buildings", WIDE),
            "SciPy solve_ivp": 1e3 * scipy,
            f"JAX, vmap over {JAX_RIGS} rigs": 1e3 * jax,
        },
        "errors": {
            "eft, one test": distance(s.eft_one(), converged),
            "C, one step a tick": distance(s.c_one(), converged),
            "numba, one step a tick": distance(s.numba_one(), converged),
            "eft, batch on one core": distance(s.eft_batch_with_traces(8, 1)[0].traces["force"], converged),
            "SciPy solve_ivp": distance(s.scipy(SCIPY_TICKS), converged[:SCIPY_TICKS]),
            f"JAX, vmap over {JAX_RIGS} rigs": distance(
                np.asarray(s.jax(JAX_RIGS, JAX_TICKS)), converged[:JAX_TICKS]
            ),
            "C, converged": distance(s.c_one(steps=64), converged),
        },
    }


def ten_thousand(s, tests):
    """Many different tests on two cores, compared with as many in C one after another."""
    script = Path(__file__).with_name("ten_thousand.py")
    command = [sys.executable, script, str(tests), "2"]
    answer = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    some = [{"c": 4330.0 * (0.8 + 0.02 * n), "mode": 2.0 - (n % 3 == 1)} for n in range(20)]
    c = [seconds(lambda changes=changes: s.c_one(**changes)) for changes in some]
    answer["c seconds"] = tests * statistics.mean(c)
    answer["ratio"] = answer["seconds"] / answer["c seconds"]
    return answer


def side_by_side(s):
    """Largest relative difference of any metric of a lane against the same rig alone; whether flags agree."""
    rigs = [
        rig.replace({"compensation.mode": mode, "compensation.level": level, "structure.damping": damping})
        for rig in (s.rig, s.noisy)
        for mode in ("off", "linear", "nonlinear")
        for level in (0.98, 1.02)
        for damping in (3e3, 4330.0, 9e3)
    ]
    largest, flags = 0.0, True
    for rig, result in zip(rigs, _native.simulate_batch(rigs, s.command, fft=False), strict=True):
        alone = eft.simulate(rig, s.command)
        metrics = alone.metrics()
        flags &= result.status == alone.flags
        for name, value in result.metrics.items():
            largest = max(largest, abs(value - metrics[name]) / abs(metrics[name]))
    return {"difference": largest, "flags agree": bool(flags), "rigs": len(rigs)}


def accuracy(s, converged):
    """Error against time for each choice of method and step."""
    rows = []
    for method in ("exponential", "runge-kutta"):
        for steps in (1, 2, 4, 8):
            choice = {"method": method, "largest_step": 1 / (RATE * steps)}
            taken = statistics.median(seconds(lambda choice=choice: s.eft_one(**choice)) for _ in range(3))
            rows.append((f"eft, {method}", steps, 1e3 * taken, distance(s.eft_one(**choice), converged)))
    for name, one in (("C", s.c_one), ("numba", s.numba_one)):
        for steps in (1, 2, 4, 8):
            taken = statistics.median(seconds(lambda one=one, steps=steps: one(steps)) for _ in range(3))
            rows.append((name, steps, 1e3 * taken, distance(one(steps), converged)))
    return rows


def growth(s):
    """Time against duration, rigs and stories."""

    def timed(work):
        return 1e3 * statistics.median(seconds(work) for _ in range(5))

    duration = {}
    for length in (4, 8, 16, 32, 64):
        command = eft.sine_sweep(8900.0, 0.0, 10.0, length, RATE)
        duration[length] = timed(lambda command=command: eft.simulate(s.rig, command))
    short = eft.sine_sweep(8900.0, 0.0, 10.0, 2.0, RATE)
    rigs = {}
    for many in (16, 32, 64, 128, 256):
        work = [s.rig] * many
        rigs[many] = timed(lambda work=work: _native.simulate_batch(work, short, threads=1, fft=False))
    stories = {}
    for floors in (1, 2, 4, 8):
        rig = building(s.rig, floors)
        force = eft.Command(np.tile(short.values / 4, (floors, 1)), RATE)
        stories[floors] = timed(lambda rig=rig, force=force: eft.simulate(rig, force))
    return {"duration": duration, "rigs": rigs, "stories": stories}


def main():
    with tempfile.TemporaryDirectory() as folder:
        s = Subjects(folder)
        converged = s.eft_one(method="runge-kutta", largest_step=1 / 262_144)
        results = {"machine": f"{platform.machine()}, {os.cpu_count()} cores", "version": eft.__version__}
        print("one test and batches, in turns ...", flush=True)
        results |= compare(s, converged)
        results["peak"] = max(s.peak() for _ in range(5))
        print("many tests on two cores ...", flush=True)
        results["many"] = ten_thousand(s, TESTS)
        results["side by side"] = side_by_side(s)
        print("accuracy and growth ...", flush=True)
        results["accuracy"] = accuracy(s, converged)
        results["growth"] = growth(s)
    target = Path(sys.argv[1])
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
