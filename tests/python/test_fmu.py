"""Rig and controller as FMUs in FMPy: the loop of both has the bits of `eft.simulate`."""

import importlib.util
import io
import random
import re
import sys
import zipfile

import numpy as np
import pytest

import eft
from eft import _fmu_library
from eft.cli import main

if importlib.util.find_spec("fmpy") is None:
    pytest.skip("fmpy is not installed", allow_module_level=True)

import lark
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from fmus import Instance

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

RATE = 4096.0
PERIOD = 1.0 / RATE
DIGITAL = eft.Rig.zhao2005().replace({"controller.realization": "digital"})
MEASURED = ("velocity", "force", "spool", "displacement", "acceleration", "supply_pressure")
OUTPUTS = {
    "rig": ("force", "displacement", "spool", "load_pressure"),
    "controller": ("valve_command", "flow_gain_estimate"),
}


@pytest.fixture(scope="module", params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def fmi(request):
    return request.param


@pytest.fixture
def load(tmp_path):
    """Instances of FMUs of a rig, freed at the end."""
    instances = []

    def one(rig, part, fmi):
        file = tmp_path / f"{len(instances)}.fmu"
        file.write_bytes(eft.firmware.export(rig, "fmu", part=part, fmi=fmi))
        instances.append(Instance(file, tmp_path / str(len(instances))))
        return instances[-1]

    yield one
    for instance in instances:
        instance.unit.freeInstance()


def loop(rig, controller, command, first=0):
    """Run both under a command, the controller first in each step; returns traces by name."""
    rows = []
    sensors = [f"measured_{name}" for name in MEASURED]
    for tick, value in enumerate(command, first):
        controller.set(command=value, **dict(zip(MEASURED, rig.get_all(sensors), strict=True)))
        controller.step(tick, PERIOD)
        rows.append([*rig.get_all(OUTPUTS["rig"]), *controller.get_all(OUTPUTS["controller"])])
        rig.set(valve_command=rows[-1][4], tripped=controller.get("tripped"))
        rig.step(tick, PERIOD)
    return dict(zip(OUTPUTS["rig"] + OUTPUTS["controller"], np.array(rows).T, strict=True))


STORIES = {"masses": [7040.0, 6000.0], "dampings": [4000.0, 3000.0], "stiffnesses": [1.4e6, 1.0e6]}
BUILDING = DIGITAL.replace({"structure.kind": "shear_building", "structure.stories": STORIES})


@pytest.fixture(scope="module")
def each_form_once():
    """The validator parses names of variables that differ in their words only once."""
    parse, legal = lark.Lark.parse, set()

    def parse_once(parser, name):
        form = re.sub(r"(?<![A-Za-z_0-9'])(?!der\()[A-Za-z_][A-Za-z_0-9]*", "a", name)
        if form not in legal:
            parse(parser, name)
            legal.add(form)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lark.Lark, "parse", parse_once)
        yield


@pytest.mark.usefixtures("each_form_once")
@pytest.mark.parametrize("rig", [DIGITAL, BUILDING], ids=["one actuator", "two actuators"])
@pytest.mark.parametrize("part", ["rig", "controller"])
def test_a_validator_finds_nothing(rig, part, fmi, tmp_path):
    rig = rig.replace({"name": 'a <"rig"> & more'})
    (tmp_path / "one.fmu").write_bytes(eft.firmware.export(rig, "fmu", part=part, fmi=fmi))
    assert validate_fmu(str(tmp_path / "one.fmu")) == []


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"compensation.adaptive": True, "truth.servovalve.flow_gain_scale": 0.8},
        {"protection.enabled": True, "protection.displacement_trip": 2e-3, "actuator.bypass_flow": 1e-3},
        {"sensors.force.noise": 20.0, "sensors.velocity.delay": 2, "dac.delay": 1},
    ],
    ids=["plain", "adaptive", "protected", "noisy"],
)
def test_the_loop_of_both_has_the_bits_of_a_test(changes, fmi, load):
    rig = DIGITAL.replace(changes)
    command = eft.sine_sweep(8900.0, 0.5, 8.0, duration=0.25, sample_rate=RATE)
    halves = load(rig, "rig", fmi), load(rig, "controller", fmi)
    for half in halves:
        half.start()
    run = eft.simulate(rig, command)
    assert bool(run.flags & eft.Status.TRIPPED) == ("protection.enabled" in changes)
    traces = loop(*halves, command.values)
    if "dac.delay" in changes:
        del traces["valve_command"]  # a run has it behind the converter
    for name, trace in traces.items():
        np.testing.assert_array_equal(trace, getattr(run, name), err_msg=name)
    assert not any(half.messages for half in halves)


def test_the_loop_of_a_building_has_the_bits_of_a_test(fmi, load):
    """Each actuator has its own inputs and outputs; when the upper one trips, the lower one does."""
    limits = {"protection.enabled": True, "protection.displacement_trip": 2e-3}
    rig = BUILDING.replace({**limits, "actuator.bypass_flow": 1e-3, "sensors.force.noise": 5.0})
    commands = [eft.sine_sweep(size, 0.5, 8.0, duration=0.25, sample_rate=RATE).values for size in (3e3, 6e3)]
    run = eft.simulate(rig, eft.Command(commands, RATE))
    stand, controller = load(rig, "rig", fmi), load(rig, "controller", fmi)
    for half in (stand, controller):
        half.start()
    force = np.empty_like(run.force)
    for tick in range(force.shape[1]):
        for floor in (1, 2):
            sensed = stand.get_all([f"force[{floor}]", *(f"measured_{name}[{floor}]" for name in MEASURED)])
            force[floor - 1, tick] = sensed[0]
            measured = dict(zip((f"{name}[{floor}]" for name in MEASURED), sensed[1:], strict=True))
            controller.set(**{f"command[{floor}]": commands[floor - 1][tick]}, **measured)
        controller.step(tick, PERIOD)
        for floor in (1, 2):
            stand.set(**{f"valve_command[{floor}]": controller.get(f"valve_command[{floor}]")})
        stand.set(tripped=controller.get("tripped"))
        stand.step(tick, PERIOD)
    assert run.flags & eft.Status.TRIPPED and controller.get("tripped")
    np.testing.assert_array_equal(force, run.force)


def test_single_precision_has_the_bits_of_firmware(fmi, load):
    rig = DIGITAL.replace({"compensation.adaptive": True})
    command = eft.sine_sweep(8900.0, 0.5, 8.0, duration=0.25, sample_rate=RATE)
    halves = load(rig, "rig", fmi), load(rig, "controller", fmi)
    halves[0].start()
    halves[1].start(single_precision=True)
    run = eft.simulate(rig, command, dtype="f32")
    np.testing.assert_array_equal(loop(*halves, command.values)["force"], run.force)


def test_parameters_change_the_rig(fmi, load):
    one = load(DIGITAL, "rig", fmi)
    changes = {"structure.mass": 9000.0, "servovalve.flow_gain_scale": 0.9}
    one.start(**{key.replace(".", "__"): value for key, value in changes.items()})
    plant = load(DIGITAL.replace(changes), "rig", fmi)
    plant.start()
    for tick in range(200):
        for half in (one, plant):
            half.set(valve_command=0.5)
            half.step(tick, PERIOD)
    assert one.get("force") == plant.get("force") != 0.0


def test_states_replay_the_same_bits(fmi, load):
    """A hundred random sequences on two instances side by side."""
    rig = DIGITAL.replace({"compensation.adaptive": True, "sensors.force.noise": 5.0})
    pairs = [(load(rig, "rig", fmi), load(rig, "controller", fmi)) for _ in range(2)]
    for half in (*pairs[0], *pairs[1]):
        half.start()
    command = eft.sine_sweep(8900.0, 0.5, 8.0, duration=1.0, sample_rate=RATE).values
    truth = loop(*pairs[0], command[:420])["force"]
    loop(*pairs[1], command[:7])
    chance = random.Random(18)
    kept = {id(pair): [(7, store(pair))] for pair in pairs[1:]} | {id(pairs[0]): [(420, store(pairs[0]))]}
    for _ in range(100):
        pair = chance.choice(pairs)
        tick, state = chance.choice(kept[id(pair)])
        if chance.random() < 0.5:
            # Through bytes into the other two instances.
            written = [half.unit.serializeFMUState(one) for half, one in zip(pair, state, strict=True)]
            pair = pairs[pair is pairs[0]]
            state = [half.unit.deserializeFMUState(one) for half, one in zip(pair, written, strict=True)]
            kept[id(pair)].append((tick, state))
        for half, one in zip(pair, state, strict=True):
            half.unit.setFMUState(one)
        if tick == 420:
            for half in pair:
                half.unit.reset()
                half.start()
            tick = 0
        end = min(tick + chance.randrange(1, 30), 420)
        force = loop(*pair, command[tick:end], tick)["force"]
        np.testing.assert_array_equal(force, truth[tick:end])
        states = kept[id(pair)]
        states.append((end, store(pair)))
        while len(states) > 6:
            for half, one in zip(pair, states.pop(chance.randrange(len(states)))[1], strict=True):
                half.unit.freeFMUState(one)


def store(pair):
    return [half.unit.getFMUState() for half in pair]


def refused(instance, call, sentence):
    with pytest.raises(FMICallException) as error:
        call()
    assert error.value.status == 3
    assert instance.said().startswith(sentence)


def test_what_is_wrong_is_an_error_with_a_sentence(fmi, load):
    one = load(DIGITAL, "rig", fmi)
    for value in (float("nan"), -1.0, 1e300):
        refused(one, lambda value=value: one.set(structure__mass=value), "structure.mass = ")
    assert one.said() == "structure.mass = 1e300: must be a number between 0.001 and 1e12 kg"
    refused(one, lambda: one.set(dac__delay=-1), "dac.delay = -1: must be a whole number between 0 and 1000")
    real = one.unit.setReal if fmi == 2 else one.unit.setFloat64
    refused(
        one, lambda: real([one.variables["dac.delay"].valueReference], [1.0]), "dac.delay = Real: must be"
    )
    refused(one, lambda: real([10**6], [1.0]), "value reference = 1000000: must be below")
    refused(one, lambda: one.set(force=1.0), "force = 1: must not be set")
    refused(one, lambda: one.step(0, PERIOD), "DoStep = Instantiated: must be called in the state Stepping")
    one.start()
    refused(one, lambda: one.set(structure__mass=1.0), "structure.mass = 1: must be set before the init")
    refused(one, lambda: one.step(3, PERIOD), "currentCommunicationPoint = 7.32421875e-4: must be")
    refused(one, lambda: one.step(0, 0.3 * PERIOD), "communicationStepSize = ")
    one.set(valve_command=float("nan"))
    refused(one, lambda: one.step(0, PERIOD), "valve_command = NaN: must be finite, in V")
    one.set(valve_command=0.1)
    one.step(0, PERIOD)
    assert one.get("time") == PERIOD


def test_parameters_that_do_not_fit_each_other_end_the_initialization(fmi, load):
    limits = {"protection.enabled": True, "protection.displacement_warning": 1e-3}
    one = load(DIGITAL.replace({**limits, "protection.displacement_trip": 2e-3}), "controller", fmi)
    one.set(protection__displacement_warning=5e-3)
    one.enter()
    refused(one, one.unit.exitInitializationMode, "displacement_warning = 0.005: must lie in [0, 0.002]")
    one.set(protection__displacement_trip=9e-3)
    one.unit.exitInitializationMode()
    one.step(0, PERIOD)


def test_what_no_fmu_can_be_is_refused(tmp_path, capsys):
    late = DIGITAL.replace({"compensation.computation_delay": 2})
    with pytest.raises(ValueError, match=r"compensation\.computation_delay = 2: must be 0 for an FMU"):
        eft.firmware.export(late, "fmu", part="controller")
    with pytest.raises(ValueError, match='part = "both": must be "rig" or "controller"'):
        eft.firmware.export(DIGITAL, "fmu", part="both")
    with pytest.raises(ValueError, match="fmi = 4: must be 2 or 3"):
        eft.firmware.export(DIGITAL, "fmu", fmi=4)
    (tmp_path / "rig.toml").write_text(DIGITAL.to_toml())
    command = ["export", str(tmp_path / "rig.toml"), "--target", "fmu"]
    assert main([*command, "-o", str(tmp_path / "a.fmu")]) == 2
    assert "--part rig or --part controller" in capsys.readouterr().err
    assert main([*command, "--fmi", "3"]) == 0
    written = [f"{tmp_path / f'rig-{part}.fmu'} written" for part in ("rig", "controller")]
    assert capsys.readouterr().out.split("\n")[:2] == written
    expected = eft.firmware.export(DIGITAL, "fmu", part="controller", fmi=3)
    assert (tmp_path / "rig-controller.fmu").read_bytes() == expected


def test_an_fmu_holds_the_libraries_of_a_release(monkeypatch, tmp_path):
    monkeypatch.setattr(_fmu_library, "FOLDER", tmp_path)
    (tmp_path / "eft_fmu-x86_64-windows.dll").write_bytes(b"for Windows")
    for fmi, folder in ((2, "win64"), (3, "x86_64-windows")):
        with zipfile.ZipFile(io.BytesIO(eft.firmware.export(DIGITAL, "fmu", fmi=fmi))) as fmu:
            assert fmu.read(f"binaries/{folder}/eft_rig.dll") == b"for Windows"
            assert len(fmu.namelist()) == 4
    monkeypatch.setattr(sys, "platform", "win32")
    (tmp_path / "eft_fmu-x86_64-windows.dll").unlink()
    with pytest.raises(ValueError, match=r"must be made on Linux .* this is win32 on"):
        eft.firmware.export(DIGITAL, "fmu")
