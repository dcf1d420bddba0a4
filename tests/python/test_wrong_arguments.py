"""Arguments of a wrong kind: every function says the same of them."""

import inspect
from dataclasses import is_dataclass

import numpy as np
import pytest

import eft
from eft import firmware, identification, linear, opensees

RIG = eft.Rig.zhao2005()
SWEEP = eft.sine_sweep(2000.0, 0.5, 5.0, 1.0, 1024.0)
SIGNAL = np.sin(np.arange(1024) / 50.0)


def takers():
    """Every public function or class whose first argument is a rig; fields of results are no arguments."""
    found = {}
    for module in (eft, firmware, identification, linear, opensees):
        for one in map(module.__dict__.get, module.__all__):
            made = isinstance(one, type) and (is_dataclass(one) or issubclass(one, Exception))
            if callable(one) and not made:
                parameters = list(inspect.signature(one).parameters.values())
                if parameters and parameters[0].name == "rig":
                    found[one] = parameters[1:]
    return found


@pytest.mark.parametrize("taker", takers(), ids=lambda one: one.__name__)
def test_a_mapping_in_place_of_a_rig_is_refused_with_the_way_to_make_one(taker):
    needed = [one.name for one in takers()[taker] if one.default is one.empty]
    known = {"command": SWEEP, "record": SWEEP, "sample_rate": 1024.0, "target": "c"}
    arguments = {name: known.get(name, SIGNAL) for name in needed}
    said = r"^rig = an object of type dict: must be an eft\.Rig; eft\.Rig\.from_dict makes one from a mapping"
    with pytest.raises(TypeError, match=said):
        taker(RIG.to_dict(), **arguments)


def test_the_functions_that_take_a_rig_are_found():
    names = {one.__name__ for one in takers()}
    assert {"simulate", "study", "largest_scale", "Controller", "export", "identify"} <= names


@pytest.mark.parametrize("true", [True, np.bool_(True), np.array(True)])
@pytest.mark.parametrize(
    "call",
    [
        lambda true: eft.Controller(RIG).step(0.0, true, 0.0, 0.0),
        lambda true: eft.Controller(RIG).step(0.0, 0.0, 0.0, 0.0, next_command=true),
        lambda true: eft.Controller(RIG).prime(0.0, true, 0.0, 0.0),
        lambda true: eft.Compensator(RIG).step(true, 0.0, 0.0),
        lambda true: eft.Plant(RIG).step(true),
        lambda true: eft.Record([0.0, 1.0, 0.0], 0.01).baseline_corrected(true),
        lambda true: eft.Command.noise(1.0, (1.0, 2.0), 1.0, 1024.0, seed=true),
        lambda true: linear.observer_gains(RIG, true),
        lambda true: firmware.export(RIG, "fmu", fmi=true),
    ],
)
def test_a_truth_value_is_no_number(call, true):
    with pytest.raises(TypeError, match=r"^must be (real|whole) number, not a truth value of type "):
        call(true)


@pytest.mark.parametrize("wrong", ["measured.csv", RIG.to_dict(), SIGNAL])
def test_what_is_no_test_cannot_be_iterated(wrong):
    said = (
        r"^rig_or_measured = an object of type \w+: must be an eft\.Rig, a TestRun or eft\.traces\.Traces; "
    )
    with pytest.raises(TypeError, match=said):
        eft.iterate(wrong, SWEEP)


def test_a_truth_value_is_no_answer():
    class Controller:
        def step(self, *_, **__):
            return True

    with pytest.raises(ValueError, match=r"^controller\.step = an object of type bool: must return one num"):
        eft.simulate(RIG, SWEEP, controller=Controller())
    with pytest.raises(ValueError, match=r"^structure = an object of type bool: must return"):
        eft.simulate(RIG, SWEEP, structure=lambda force, dt: (True, 0.0))
