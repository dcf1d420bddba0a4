"""Many different tests, metrics without Fourier transforms: time and memory of a separate process.

python ten_thousand.py TESTS THREADS
"""

import itertools
import json
import sys
import time
from pathlib import Path

import eft
from eft import _native

CHUNK = 2048

if __name__ == "__main__":
    tests, threads = (int(argument) for argument in sys.argv[1:])
    base = eft.Rig.zhao2005()
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0)
    modes = itertools.cycle(["nonlinear", "linear", "nonlinear"])
    changes = (
        {
            "compensation.mode": mode,
            "servovalve.flow_gain_scale": 0.9 + 0.2 * n / tests,
            "structure.damping": 4330.0 * (0.8 + 0.4 * (n * 7 % tests) / tests),
        }
        for n, mode in zip(range(tests), modes, strict=False)
    )
    taken, errors = 0.0, []
    while chunk := [base.replace(change) for change in itertools.islice(changes, CHUNK)]:
        start = time.perf_counter()
        results = _native.simulate_batch(chunk, command, threads=threads, fft=False)
        taken += time.perf_counter() - start
        errors += [result.metrics["nrmse"] for result in results]
    # The resource module would count the parent's memory as well, up to where this program began.
    lines = Path("/proc/self/status").read_text().splitlines()
    memory = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024
    print(
        json.dumps(
            {"tests": len(errors), "seconds": taken, "memory": memory, "nrmse": [min(errors), max(errors)]}
        )
    )
