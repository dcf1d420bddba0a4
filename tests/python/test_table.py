"""The tables of traces and metrics are in Rust; Python and its type declarations agree with them."""

import dataclasses
import os
import pickle
from pathlib import Path

import numpy as np
import pytest

import eft
from eft import _native, _table
from eft._table import METRICS, TRACES

STUB = Path(_table.__file__).with_suffix(".pyi")
HEAD = '''"""Written by tests/python/test_table.py; EFT_WRITE_STUBS=1 writes it anew."""

from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

_Array: TypeAlias = NDArray[np.float64]

class Trace(NamedTuple):
    unit: str
    doc: str
    otherwise: str

class Metric(NamedTuple):
    unit: str
    doc: str
    costly: bool

class UnrecordedTraceError(AttributeError, ValueError): ...

TRACES: dict[str, Trace]
METRICS: dict[str, Metric]
OPTIONAL: tuple[str, ...]
'''


def names(label, all_of_them):
    lines = "".join(f'    "{name}",\n' for name in all_of_them)
    return f"{label}: TypeAlias = Literal[\n{lines}]\n"


def attributes(typed):
    return "".join(f"    @property\n    def {name}(self) -> {type_}: ...\n" for name, type_ in typed)


def stub():
    traces = [
        (name, "_Array | None" if one.otherwise == "absent" else "_Array") for name, one in TRACES.items()
    ]
    return "".join(
        [
            HEAD,
            names("TraceName", TRACES),
            names("MetricName", METRICS),
            "\nclass Channels:\n    version: str\n    _values: Mapping[str, Any]\n",
            "    _unrecorded: frozenset[str]\n",
            attributes(traces),
            "\nclass Metrics(Mapping[MetricName, Any]):\n",
            "    def __init__(self, values: Mapping[str, Any]) -> None: ...\n",
            "    def __getitem__(self, name: MetricName) -> Any: ...\n",
            "    def __iter__(self) -> Iterator[MetricName]: ...\n",
            "    def __len__(self) -> int: ...\n",
            attributes((name, "Any") for name in METRICS),
        ]
    )


def test_the_declarations_are_those_of_the_tables():
    if os.environ.get("EFT_WRITE_STUBS"):
        STUB.write_text(stub(), encoding="utf-8")
    assert STUB.read_text(encoding="utf-8") == stub()


@pytest.fixture(scope="module")
def run():
    return eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2200.0, 0.0, 10.0, 2.0, 1024.0))


def test_every_trace_is_an_attribute(run):
    for name, trace in TRACES.items():
        assert trace.doc and name in dir(run)
        values = getattr(run, name)
        assert values is None if trace.otherwise == "absent" else values.shape == run.command.shape
    assert run.measured_force is run.force
    np.testing.assert_array_equal(run.test_ratio, 0.0)
    with pytest.raises(AttributeError):
        _ = run.forse
    with pytest.raises((AttributeError, dataclasses.FrozenInstanceError)):
        run.force = np.zeros(3)


def test_the_test_ratio_of_a_window_stands_over_its_ticks():
    rig = eft.Rig.zhao2005().replace({"compensation.adaptive": True, "servovalve.flow_gain_scale": 0.95})
    run = eft.simulate(rig, eft.sine_sweep(4000.0, 0.5, 4.0, 4.0, 4096.0))
    replayed = eft.replay(rig, run)
    # The calibration of window k is in use in window k + 2.
    held = run.test_ratio.reshape(-1, 16)
    assert (held == held[:, :1]).all()
    np.testing.assert_allclose(held[2:, 0], replayed.test_ratio[:-2], rtol=0.2, atol=1e-3)
    assert 0.0 < run.test_ratio[-1] < 1.0


def test_metrics_are_items_and_attributes_that_stay(run):
    metrics = run.metrics()
    assert list(metrics) == list(METRICS)
    assert {"nrmse", "peak_error", "delay", "max_spool", "displacement_error"} <= set(metrics)
    assert all(getattr(metrics, name) == value for name, value in metrics.items())
    assert pickle.loads(pickle.dumps(metrics)) == metrics == dict(metrics)
    quick = run.metrics(fft=False)
    assert list(quick) == [name for name, metric in METRICS.items() if not metric.costly]
    assert np.isnan(quick.delay) and quick["nrmse"] == metrics["nrmse"]
    with pytest.raises(AttributeError, match="cannot be changed"):
        metrics.nrmse = 0.0
    with pytest.raises(TypeError):
        metrics["nrmse"] = 0.0
    with pytest.raises(KeyError):
        metrics["nrsme"]


def test_displacement_drift_and_supply_are_judged():
    rig = eft.Rig.zhao2005().replace({"supply.droop": 2e8, "supply.accumulator": 7e-10})
    command = eft.sine_sweep(4000.0, 0.0, 4.0, 4.0, 1024.0)
    run = eft.simulate(rig, command)
    metrics = run.metrics()
    ideal = eft.ideal_response(rig, command).displacement
    expected = np.sqrt(((run.displacement - ideal) ** 2).sum() / (ideal**2).sum())
    assert metrics["displacement_error"] == pytest.approx(expected, rel=1e-12)
    assert metrics["drift"] == np.abs(run.displacement).max()
    assert metrics["min_supply_pressure"] == run.supply_pressure.min() < 1.9e7


def test_stories_drift_against_each_other():
    stories = {"masses": [7e3, 7e3], "dampings": [4e3, 4e3], "stiffnesses": [7e5, 7e5]}
    rig = eft.Rig.zhao2005().replace({"structure.kind": "shear_building", "structure.stories": stories})
    sweep = eft.sine_sweep(2000.0, 0.5, 3.0, 2.0, 1024.0).values
    command = eft.Command(np.array([sweep, 0.5 * sweep]), 1024.0)
    run = eft.simulate(rig, command)
    metrics = run.metrics()
    lower, upper = run.displacement
    np.testing.assert_array_equal(metrics["drift"], [np.abs(lower).max(), np.abs(upper - lower).max()])
    ideal = eft.ideal_response(rig, command).displacement
    expected = np.sqrt(((run.displacement - ideal) ** 2).sum(axis=1) / (ideal**2).sum(axis=1))
    np.testing.assert_allclose(metrics["displacement_error"], expected, rtol=1e-12)


def test_the_energy_is_part_of_the_run(tmp_path):
    rig = eft.Rig.zhao2005().replace({"actuator.friction": 30.0})
    command = eft.sine_sweep(2200.0, 0.5, 4.0, 2.0, 1024.0)
    run = eft.simulate(rig, command)
    assert run.energy == eft.energy_balance(rig, command)
    assert run.energy.friction > 0.0 and abs(run.energy.gap) < 1e-3
    assert eft.TestRun.load(run.save(tmp_path / "run.eft")).energy == run.energy
    plain = eft.simulate(eft.Rig.zhao2005(), command)
    assert plain.energy.friction == 0.0 and abs(plain.energy.gap) < 1e-4
    assert eft.TestRun.load(plain.save(tmp_path / "plain.eft")).energy == plain.energy


def test_there_is_a_word_for_every_kind_of_trace():
    recorded = {one.otherwise for one in TRACES.values()}
    assert recorded <= {"recorded", "constant", "nominal", "absent", *TRACES}
    assert {name for name, *_ in _native.trace_table()} == set(TRACES)
