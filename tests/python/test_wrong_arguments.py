"""Arguments of a wrong kind: every function says the same of them."""

import inspect
import re
from dataclasses import is_dataclass

import numpy as np
import pytest

import eft
from eft import firmware, identification, linear, opensees

RIG = eft.Rig.zhao2005()
SWEEP = eft.sine_sweep(2000.0, 0.5, 5.0, 1.0, 1024.0)
RUN = eft.simulate(RIG, SWEEP)
WATCHED = RIG.replace({"controller.realization": "digital"})
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


@pytest.mark.parametrize("true", [True, np.bool_(True), np.array(True), "1"])
@pytest.mark.parametrize(
    ("name", "kind", "call"),
    [
        ("tolerance", "real", lambda true: eft.largest_scale(RIG, SWEEP, tolerance=true)),
        ("every", "real", lambda true: next(eft.watch(WATCHED, SWEEP, every=true))),
        ("repeats", "whole", lambda true: eft.iterate(RIG, SWEEP, repeats=true)),
        ("relaxation", "real", lambda true: eft.iterate(RIG, SWEEP, relaxation=true)),
        ("least_coherence", "real", lambda true: eft.iterate(RIG, SWEEP, least_coherence=true)),
        ("target", "real", lambda true: eft.iterate(RIG, SWEEP, target=true)),
        ("band", "real", lambda true: eft.iterate(RIG, SWEEP, band=(true, 5.0))),
        ("band", "real", lambda true: eft.compare(RUN, RUN, band=(true, 5.0))),
        ("segment", "real", lambda true: RUN.coherence(true)),
        ("actuator", "whole", lambda true: RUN.actuator(true)),
        ("longest", "real", lambda true: opensees.Site(RIG, longest=true)),
        ("sample_rate", "real", lambda true: eft.rths.delay(SIGNAL, SIGNAL, true)),
        ("lags", "whole", lambda true: eft.rths.delay(SIGNAL, SIGNAL, 1024.0, lags=true)),
        ("seed", "whole", lambda true: eft.rths.TransferSystem().perturbed(true)),
        ("count", "whole", lambda true: eft.benchmark.drawn_cases(true)),
        ("seed", "whole", lambda true: eft.benchmark.drawn_cases(1, true)),
    ],
)
def test_a_truth_value_or_a_text_is_no_number_in_python_either(true, name, kind, call):
    with pytest.raises(TypeError, match=rf"^{name} = .*: must be a {kind} number$"):
        call(true)


@pytest.mark.parametrize("wrong", [-1, 2**64])
@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("seed", lambda wrong: eft.Command.noise(1.0, (1.0, 2.0), 1.0, 1024.0, seed=wrong)),
        ("degree", lambda wrong: eft.Record([0.0, 1.0, 0.0], 0.01).baseline_corrected(wrong)),
        ("channel", lambda wrong: eft.read_record("motion.v2", channel=wrong)),
    ],
)
def test_a_whole_number_out_of_range_is_refused_with_its_range(wrong, name, call):
    # The interpreter prints the note with the name below the message.
    said = rf"^{wrong}: must be a whole number between 0 and 18446744073709551615\nwhile processing '{name}'$"
    with pytest.raises(ValueError, match=said):
        call(wrong)


def test_a_seed_beyond_64_bits_is_refused():
    with pytest.raises(
        ValueError, match=r"^sensors\.seed = 9223372036854775808: must fit 64 bits with its sign$"
    ):
        RIG.replace({"sensors.seed": 2**63})


@pytest.mark.parametrize("segment", [-1.0, 1e-3, 0.667, 0.8, 5.0, 1e300, float("nan")])
def test_a_segment_that_does_not_fit_is_refused_in_seconds(segment):
    allowed = r"must be at least 0\.00195312 and at most two thirds of the test, 0\.666 s$"
    with pytest.raises(ValueError, match=rf"^segment = {re.escape(f'{segment:g}')} s: {allowed}"):
        RUN.coherence(segment)
    # The limits that the message names are allowed.
    assert RUN.coherence(0.666).coherence.max() <= 1.0
    assert RUN.coherence(0.00195312).frequency.size <= 2


def test_numbers_of_numpy_are_numbers():
    assert eft.largest_scale(RIG, SWEEP, tolerance=np.float32(1.0)).scale > 0.0
    assert RUN.actuator(np.int64(0)) is RUN
    with pytest.raises(ValueError, match=r"^target = nan: must be at least 0$"):
        eft.iterate(RIG, SWEEP, target=float("nan"))


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
