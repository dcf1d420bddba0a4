"""The same seed gives the same bits for any number of threads and processes."""

import hashlib
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import eft

NOISE = {
    "sensors.force.noise": 30.0,
    "sensors.velocity.noise": 1e-3,
    "sensors.spool.noise": 1e-3,
    "sensors.force.dropout": 0.01,
    "sensors.velocity.bandwidth": 300.0,
}
BUILDING = {
    "structure.kind": "shear_building",
    "structure.stories.masses": [7e3, 6e3],
    "structure.stories.dampings": [5e3, 4e3],
    "structure.stories.stiffnesses": [2.6e6, 2.2e6],
}


def digest(job):
    changes, seed, dtype = job
    rig = eft.Rig.zhao2005().replace({**NOISE, **changes, "sensors.seed": seed})
    command = eft.sine_sweep(3000.0, 0.5, 6.0, 2.0, 2048.0)
    if "structure.kind" in changes:
        command = eft.Command(np.stack([command.values, command.values]), 2048.0)
    run = eft.simulate(rig, command, dtype)
    traces = (
        run.force,
        run.velocity,
        run.measured_force,
        run.measured_velocity,
        run.valve_command,
        run.status,
    )
    return hashlib.sha256(b"".join(trace.tobytes() for trace in traces)).hexdigest()


JOBS = [
    (changes, seed, dtype)
    for changes in ({}, {"compensation.adaptive": True}, {"actuator.friction": 100.0}, BUILDING)
    for seed in (1, 2)
    for dtype in ("f64", "f32")
    if not ("structure.kind" in changes and dtype == "f32")
]


@pytest.fixture(scope="module")
def alone():
    return [digest(job) for job in JOBS]


def test_the_seed_is_what_matters(alone):
    assert len(set(alone)) == len(JOBS)
    assert [digest(job) for job in JOBS] == alone


def test_threads_change_no_bit(alone):
    with ThreadPoolExecutor(8) as pool:
        # Twice as many at once, in another order.
        answers = list(pool.map(digest, JOBS[::-1] * 2))
    assert answers == alone[::-1] * 2


def test_processes_change_no_bit(alone):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert list(pool.map(digest, JOBS)) == alone
