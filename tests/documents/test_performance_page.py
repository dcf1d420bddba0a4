"""The performance page is made from the measurements, and the peers compute the same test as the package."""

import ctypes
import importlib.util
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

import eft

ROOT = Path(__file__).parents[2]
PEERS = ROOT / "benches" / "peers"


def module(name):
    spec = importlib.util.spec_from_file_location(f"bench_{name}", PEERS / f"{name}.py")
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def test_the_page_is_made_from_the_results():
    results = json.loads((ROOT / "benches" / "results.json").read_text())
    assert (ROOT / "docs" / "evidence" / "performance.md").read_text() == module("page").text(results)


@pytest.mark.parametrize("mode", ["off", "linear", "nonlinear"])
def test_the_peer_in_c_runs_the_same_test(mode, tmp_path):
    plant = module("plant")
    library = tmp_path / "peer.so"
    command = ["cc", "-O2", "-shared", "-fPIC", "-o", str(library), str(PEERS / "peer.c"), "-lm"]
    subprocess.run(command, check=True)
    c = ctypes.CDLL(str(library)).eft_test
    values = plant.sweep(duration=8.0)
    traces = np.zeros((8, values.size))
    rig = plant.rig(mode=["off", "linear", "nonlinear"].index(mode))
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    c.argtypes = [ctypes.POINTER(plant.Rig), pointer, size, ctypes.c_double, ctypes.c_int, pointer]
    c(rig, values.ctypes.data, values.size, 4096.0, 8, traces.ctypes.data)
    run = eft.simulate(
        eft.Rig.zhao2005().replace({"compensation.mode": mode}),
        eft.Command(values, 4096.0),
        method="runge-kutta",
        largest_step=1 / 32_768,
    )
    assert np.abs(traces[0] - run.force).max() < 1e-6 * np.abs(run.force).max()
    assert np.abs(traces[3] - run.spool).max() < 1e-6
