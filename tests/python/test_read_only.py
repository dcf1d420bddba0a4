"""The arrays of results are read-only, those of the user stay writable."""

import dataclasses
import pickle
from collections.abc import Mapping

import numpy as np
import pytest

import eft
from eft._table import TRACES
from eft.traces import Traces

RIG = eft.Rig.zhao2005()
SWEEP = eft.sine_sweep(2200.0, 0.5, 6.0, 2.0, 1024.0)
STORIES = {"masses": [7e3, 8e3], "dampings": [4e3, 4e3], "stiffnesses": [7e5, 7e5]}
BUILDING = RIG.replace({"structure.kind": "shear_building", "structure.stories": STORIES})


@pytest.fixture(scope="module", params=["plain", "adaptive with noise", "building"])
def run(request):
    if request.param == "building":
        motion = eft.Record(0.5 * np.sin(np.arange(100) / 5.0), 0.02, "a quake")
        return eft.simulate(BUILDING, eft.effective_force(motion, mass=[7e3, 8e3], sample_rate=512.0))
    changes = {"compensation.adaptive": True, "sensors.force.noise": 10.0} if request.param != "plain" else {}
    return eft.simulate(RIG.replace(changes), SWEEP)


def refuses(array):
    with pytest.raises(ValueError, match="read-only"):
        array[..., 0] = 1.0


def check_traces(run):
    for name in (*TRACES, "status", "time", "found_flows", "mass"):
        array = getattr(run, name)
        if isinstance(array, np.ndarray):
            refuses(array)


def test_the_traces_of_a_run_are_read_only(run, tmp_path):
    before = run.metrics()["nrmse"]
    check_traces(run)
    check_traces(run.actuator(0))
    check_traces(eft.TestRun.load(run.save(tmp_path / "run.eft")))
    back = pickle.loads(pickle.dumps(run))
    check_traces(back)
    np.testing.assert_array_equal(back.metrics()["nrmse"], before)
    assert (back.measured_force is back.force) == (run.measured_force is run.force)


def arrays(result):
    """Every array of a result."""
    if isinstance(result, np.ndarray):
        return [result]
    if isinstance(result, Mapping):
        parts = list(result.values())
    elif dataclasses.is_dataclass(result):
        parts = [getattr(result, field.name) for field in dataclasses.fields(result)]
    elif isinstance(result, eft.identification.Estimate):
        parts = list(result.details.values())
    else:
        parts = list(result) if isinstance(result, tuple) else []
    return [array for part in parts for array in arrays(part)]


FREQUENCY = np.linspace(1.0, 40.0, 30)
RESPONSE = 1.0 / (1.0 + 1j * FREQUENCY / 50.0 - (FREQUENCY / 80.0) ** 2)
RESULTS = {
    "replay": lambda: eft.replay(RIG, eft.simulate(RIG, SWEEP)),
    "fft_ratio": lambda: eft.simulate(RIG, SWEEP).fft_ratio(1.0, 5.0),
    "coherence": lambda: eft.simulate(RIG, SWEEP).coherence(1.0),
    "ideal_response": lambda: eft.ideal_response(RIG, SWEEP),
    "stability_map": lambda: eft.linear.stability_map(
        RIG,
        horizontal=("compensation.level", [0.8, 0.9]),
        vertical=("structure.damping", [4e3, 5e3]),
    ),
    "inverse_dynamics": lambda: eft.linear.inverse_dynamics(RIG, [1.0, 2.0]),
    "tuning": lambda: eft.tune_force_loop(RIG),
    "iteration": lambda: eft.iterate(RIG, SWEEP, repeats=1),
    "valve_test": lambda: eft.identification.valve_test(RIG),
    "flow_test": lambda: eft.identification.flow_test(RIG, 0.05),
    "delay": lambda: eft.identify_delay(SWEEP.values, eft.simulate(RIG, SWEEP).force, 1024.0),
    "valve": lambda: eft.identification.identify_valve(FREQUENCY, np.abs(RESPONSE), np.angle(RESPONSE)),
    "traces": lambda: Traces.from_run(eft.simulate(RIG, SWEEP)),
    "rths": lambda: eft.rths.simulate(eft.Record(np.sin(np.arange(100) / 5.0), 0.02, "a quake")),
}


@pytest.mark.parametrize("name", RESULTS)
def test_the_arrays_of_a_result_are_read_only(name):
    result = RESULTS[name]()
    found = arrays(result)
    assert found
    for array in found:
        refuses(array)


def test_a_copy_of_the_traces_is_writable():
    run = eft.simulate(RIG, SWEEP)
    frame, dataset = run.to_pandas(), run.to_xarray()
    frame.loc[0.0, "force"] = 1.0
    dataset["force"][0] = 1.0
    assert frame["force"].iloc[0] == dataset["force"][0] == 1.0 and run.force[0] == 0.0


def test_arrays_of_the_user_stay_writable():
    force = np.zeros(8)
    traces = Traces("mine", 100.0, {"force": force})
    refuses(traces["force"])
    refuses(pickle.loads(pickle.dumps(traces))["force"])
    force[0] = 1.0
    levels = np.array([0.8, 0.9])
    found = eft.linear.stability_map(RIG, ("compensation.level", levels), ("structure.damping", [4e3]))
    refuses(found.horizontal)
    levels[0] = 0.7
