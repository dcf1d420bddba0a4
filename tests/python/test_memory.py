"""The memory of a test and of a study, before they take it: a refusal, a warning, and the tests counted."""

import os
import warnings
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

import eft
from eft import _native
from eft._memory import StudyMemory
from eft._table import TRACES
from eft.cli import main

RIG = eft.Rig.zhao2005()
SHORT = eft.sine_sweep(1000.0, 0.5, 4.0, 0.5, 1024.0)
GIB = 1024**2
"""These tests count in MiB, so that no command needs the memory that they speak of."""
LEVELS = {"compensation.level": list(np.linspace(0.9, 1.0, 12))}


def long(gibibytes):
    """A command whose test takes so much memory, at 200 B a sample."""
    return eft.Command(np.ones(int(gibibytes * GIB / 200)), 4096.0)


class OnOtherMachines(Executor):
    """An executor that does not say how many workers it has."""

    def submit(self, function, /, *arguments, **named):
        raise RuntimeError("submitted")


@pytest.fixture
def machine(monkeypatch):
    """Give this machine some cores and GiB of memory."""
    monkeypatch.setattr("eft._memory._GIB", GIB)

    def of(cores, gibibytes):
        pages = {"SC_PHYS_PAGES": int(gibibytes * GIB / 4096), "SC_PAGE_SIZE": 4096}
        monkeypatch.setattr(os, "sysconf", lambda name: pages.get(name, -1))
        monkeypatch.setattr(os, "cpu_count", lambda: cores)

    return of


class EndedError(Exception):
    """The end of a call that has passed its check."""


@pytest.fixture
def unrun(monkeypatch):
    """End each call where its test would run."""

    def end(*_, **__):
        raise EndedError

    monkeypatch.setattr(_native, "simulate", end)
    monkeypatch.setattr("eft._study._driver.Plan", end)


def test_a_test_of_more_than_2_gib_warns_and_says_how_to_need_less(machine, unrun):
    machine(2, 8.0)
    said = r"^command: \d+ samples need about 2\.5 GiB of memory; shorten it .* fewer traces: `eft\.study`"
    with pytest.warns(eft.MemoryUseWarning, match=said) as told, pytest.raises(EndedError):
        eft.simulate(RIG, long(2.5))
    assert told[0].filename == __file__ and issubclass(eft.MemoryUseWarning, UserWarning)
    with pytest.raises(EndedError):
        eft.simulate(RIG, long(1.9))  # a warning would be an error
    with pytest.raises(
        ValueError, match=r"need 8\.1 GiB of memory, must be at most the 8\.0 GiB of this machine"
    ):
        eft.simulate(RIG, long(8.1))


def test_a_study_counts_the_tests_that_run_at_once(machine, unrun):
    machine(4, 16.0)
    one = long(0.5)
    # Eight tests side by side take the memory of two, on each core.
    said = r"in 8 tests at a time need about 4\.0 GiB .*; shorten the command or sample less often$"
    with pytest.warns(eft.MemoryUseWarning, match=said), pytest.raises(EndedError):
        eft.study(RIG, one, LEVELS)
    with pytest.raises(EndedError):
        eft.study(RIG, one, {"compensation.level": [0.9, 0.95, 1.0]})
    with pytest.warns(eft.MemoryUseWarning, match="in 12 tests at a time"), pytest.raises(EndedError):
        eft.study(RIG, one, LEVELS, executor=ThreadPoolExecutor(10))
    with pytest.warns(eft.MemoryUseWarning, match="in 6 tests at a time"), pytest.raises(EndedError):
        eft.study(RIG, one, LEVELS, executor=ProcessPoolExecutor(3))
    # Workers on other machines: only what one of them runs.
    with pytest.raises(EndedError):
        eft.study(RIG, one, LEVELS, executor=OnOtherMachines())
    # With an external structure one after another.
    with pytest.raises(EndedError):
        eft.study(RIG, one, LEVELS, structure=lambda _: None)
    machine(4, 3.0)
    with pytest.raises(
        ValueError, match=r"in 8 tests at a time need 4\.0 GiB .* the 3\.0 GiB of this machine"
    ):
        eft.study(RIG, one, LEVELS)


def test_a_study_counts_the_traces_that_it_keeps(machine, unrun, tmp_path):
    machine(1, 64.0)
    one = long(0.1)
    many = {"compensation.level": list(np.linspace(0.5, 1.0, 400))}
    # A trace has 8 of the 200 B that a sample takes, the status 4.
    needed = 0.1 * (2 + 400 * (8 * _native.recorded_traces(RIG) + 4) / 200)
    told = rf"in 2 tests at a time and the traces of 400 need about {needed:.1f} GiB"
    said = rf"{told} .* or name a folder as `output`$"
    with pytest.warns(eft.MemoryUseWarning, match=said), pytest.raises(EndedError):
        eft.study(RIG, one, many, traces=True)
    said = r"and the traces of 100 need .* leave out `traces` or take a smaller `chunk`$"
    with pytest.warns(eft.MemoryUseWarning, match=said), pytest.raises(EndedError):
        eft.study(RIG, one, many, traces=True, output=tmp_path / "folder", chunk=100)
    with pytest.raises(EndedError):
        eft.study(RIG, one, many, traces=True, output=tmp_path / "folder", chunk=10)
    with pytest.raises(EndedError):
        eft.study(RIG, one, many)


def test_the_traces_of_a_test_are_those_that_are_counted():
    for changes in (
        {},
        {"sensors.force.noise": 10.0},
        {"actuator.friction": 30.0},
        {"compensation.adaptive": True},
        {"controller.velocity_source": "accelerometer", "sensors.force.noise": 10.0},
    ):
        rig = RIG.replace(changes)
        outcome = _native.simulate(rig, SHORT, "f64", None)
        arrays = {
            id(outcome[name])
            for name in TRACES
            if isinstance(outcome.get(name), np.ndarray) and any(outcome[name].strides)
        }
        assert _native.recorded_traces(rig) == len(arrays), changes


def test_the_memory_that_a_study_takes_is_within_its_estimate(peak_memory):
    samples, tests = 60_000, 16
    command = eft.Command(1000.0 * np.sin(np.arange(samples) / 100), 4096.0)
    many = {"compensation.level": list(np.linspace(0.9, 1.0, tests))}
    eft.study(RIG, SHORT, many, progress=False)
    for traces in (False, True):
        memory = StudyMemory.of(tests, samples, 32, traces=traces, folder=False, workers=None)
        with peak_memory(1024 * memory.needed(RIG) + 8):
            eft.study(RIG, command, many, traces=traces, progress=False)


def test_a_command_asks_and_does_not_warn(machine, unrun):
    machine(2, 64.0)
    sweep = ["run", "--sweep", "1", "0.5", "1", "4", "--sample-rate", "4096"]
    assert main(sweep) == 2  # without --memory
    with warnings.catch_warnings(), pytest.raises(EndedError):
        warnings.simplefilter("error")
        main([*sweep, "--memory", "4"])
