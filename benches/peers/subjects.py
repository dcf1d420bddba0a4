"""The measured subjects: the package and each of its peers, on the paper's 8.9 kN sweep."""

import ctypes
import subprocess
import time
from pathlib import Path

import numpy as np
import peer_jax
import peer_numba
import peer_scipy
import plant

import eft
from eft import _native

HERE = Path(__file__).parent
RATE = 4096.0
DURATION = 32.0
TRACES = 8
STORIES = 3
NOISE = {"force": 20.0, "velocity": 1e-3, "displacement": 1e-5, "spool": 1e-3}
"""Standard deviation of each sensor, in its unit."""


def load_c(folder):
    """Compile the C peer for this machine, and the loop that finds the machine's limit."""
    library = Path(folder) / "peer.so"
    sources = [HERE / "peer.c", HERE / "peak.c"]
    subprocess.run(
        ["cc", "-O3", "-march=native", "-shared", "-fPIC", "-o", library, *sources, "-lm"], check=True
    )
    c = ctypes.CDLL(str(library))
    c.eft_test.argtypes = [
        ctypes.POINTER(plant.Rig),
        ctypes.c_void_p,
        ctypes.c_size_t,
        ctypes.c_double,
        ctypes.c_int,
        ctypes.c_void_p,
    ]
    c.eft_test.restype = None
    c.eft_peak.argtypes, c.eft_peak.restype = [ctypes.c_long], ctypes.c_double
    return c


def seconds(work):
    """The time that `work` takes, s."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def building(rig, floors):
    """A rig with a number of equal stories."""
    stories = {"masses": 7040.0, "dampings": 4330.0, "stiffnesses": 693.8e3}
    lists = {name: [value] * floors for name, value in stories.items()}
    return rig.replace({"structure.kind": "shear_building", "structure.stories": lists})


class Subjects:
    """The same test by all subjects. Each test stores its traces in new memory."""

    def __init__(self, folder):
        self.c = load_c(folder)
        self.rig = eft.Rig.zhao2005()
        self.adaptive = self.rig.replace(
            {"compensation.adaptive": True, "compensation.curve_correction": False}
        )
        self.noisy = self.adaptive.replace({f"sensors.{name}.noise": noise for name, noise in NOISE.items()})
        self.building = building(self.rig, STORIES)
        self.command = eft.sine_sweep(8900.0, 0.0, 10.0, DURATION, RATE)
        self.commands = eft.Command(np.tile(self.command.values / STORIES, (STORIES, 1)), RATE)
        self.values = plant.sweep()
        self.numbers = peer_numba.numbers()

    def eft_one(self, **choice):
        return eft.simulate(self.rig, self.command, **choice).force

    def eft_adaptive(self):
        return eft.simulate(self.adaptive, self.command).force

    def c_one(self, steps=1, **changes):
        traces = np.empty((TRACES, self.values.size))
        rig = plant.rig(**changes)
        self.c.eft_test(
            ctypes.byref(rig), self.values.ctypes.data, self.values.size, RATE, steps, traces.ctypes.data
        )
        return traces[0]

    def numba_one(self, steps=1):
        traces = np.empty((TRACES, self.values.size))
        peer_numba.run(self.numbers, self.values, RATE, steps, traces)
        return traces[0]

    def eft_batch(self, tests, threads, rig=None):
        rigs = [self.rig if rig is None else rig] * tests
        return _native.simulate_batch(rigs, self.command, threads=threads, fft=False)

    def eft_batch_of_buildings(self, tests, threads):
        return _native.simulate_batch([self.building] * tests, self.commands, threads=threads, fft=False)

    def eft_batch_with_traces(self, tests, threads):
        return _native.simulate_batch(
            [self.rig] * tests, self.command, threads=threads, fft=False, traces=True
        )

    def scipy(self, ticks):
        return peer_scipy.run(self.values[:ticks], RATE)

    def jax(self, rigs, ticks):
        return peer_jax.run([plant.VALUES] * rigs, self.values[:ticks], RATE)[0]

    def peak(self, rounds=2_000_000):
        """Additions and multiplications per second on one core, 10⁹: ten fused pairs of four per round."""
        return rounds * 10 * 2 * 4 / seconds(lambda: self.c.eft_peak(rounds)) / 1e9
