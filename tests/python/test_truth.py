"""True values of the plant that differ from the controller's."""

import pickle
import tomllib

import numpy as np
import pytest

import eft
from eft.cli import main

RIG = eft.Rig.zhao2005()
HEAVY = RIG.replace({"truth.structure.mass": 9000.0})
COMMAND = eft.sine_sweep(amplitude=2200.0, f_start=0.5, f_end=5.0, duration=2.0, sample_rate=4096.0)


def same(one, other):
    """The traces of two runs are equal to the last bit."""
    return all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in ("force", "valve_command")
    )


def test_every_way_out_is_a_way_in(tmp_path):
    rig = HEAVY.replace({"truth": {"structure": {"mass": 9000.0}, "sensors": {"force": {"noise": 20.0}}}})
    assert (rig["structure.mass"], rig["truth.structure.mass"]) == (7040.0, 9000.0)
    assert rig.to_dict()["truth"] == {"structure": {"mass": 9000.0}, "sensors": {"force": {"noise": 20.0}}}
    path = tmp_path / "rig.toml"
    path.write_text(rig.to_toml(comments=True), encoding="utf-8")
    assert eft.Rig.from_toml(path) == rig
    assert eft.Rig.from_dict(rig.to_dict()) == rig == pickle.loads(pickle.dumps(rig))
    assert tomllib.loads(rig.to_toml()) == rig.to_dict()
    assert rig.replace({"truth.sensors": None}) == HEAVY
    assert rig.replace({"truth": None}) == RIG and RIG["truth"] is None


def test_the_plant_is_the_rig_with_its_truth():
    assert HEAVY.plant == RIG.replace({"structure.mass": 9000.0})
    assert RIG.plant == RIG == HEAVY.plant.replace({"structure.mass": 7040.0})


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            {"truth.structure.mas": 1.0},
            r"^unknown key `truth\.structure\.mas`; the nearest known key is `truth\.structure\.mass`$",
        ),
        ({"truth.structure.mass": "heavy"}, r'^truth\.structure\.mass = "heavy": must be a number between'),
        ({"truth.structure.mass": -1.0}, r"^truth\.structure\.mass = -1: must be a number between .* kg$"),
        (
            {"truth.compensation.level": 1.1},
            r"^truth\.compensation\.level = 1\.1: must be a key of the plant",
        ),
        ({"truth.protection": {"enabled": True}}, r"^truth\.protection\.enabled = true: must be a key of"),
        ({"truth": 3}, r"^truth = 3: must be a section$"),
    ],
)
def test_a_wrong_truth_is_named_with_what_is_allowed(changes, says):
    with pytest.raises(ValueError, match=says):
        RIG.replace(changes)
    with pytest.raises(KeyError, match=r"truth\.structure\.mass"):
        RIG["truth.structure.mas"]


def test_every_key_of_the_plant_is_listed_once_more():
    keys = [row["key"] for row in eft.rig_keys()]
    plant = ("actuator", "supply", "servovalve", "structure", "sensors", "dac")
    of_the_plant = [key for key in keys if key.split(".")[0] in plant]
    assert [key for key in keys if key.startswith("truth.")] == [f"truth.{key}" for key in of_the_plant]


@pytest.mark.parametrize("dtype", ["f32", "f64"])
def test_a_flow_gain_is_the_same_either_way(dtype):
    known = eft.simulate(RIG.replace({"servovalve.flow_gain_scale": 0.95}), COMMAND, dtype=dtype)
    hidden = eft.simulate(RIG.replace({"truth.servovalve.flow_gain_scale": 0.95}), COMMAND, dtype=dtype)
    assert same(known, hidden) and not same(known, eft.simulate(RIG, COMMAND, dtype=dtype))


def test_a_test_run_and_its_ideal_are_of_the_true_structure(tmp_path):
    run, known = (eft.simulate(rig, COMMAND) for rig in (HEAVY, HEAVY.plant))
    assert same(run, known) and run.metrics() == known.metrics()
    ideals = [eft.ideal_response(rig, COMMAND).displacement for rig in (HEAVY, HEAVY.plant, RIG)]
    assert np.array_equal(ideals[0], ideals[1]) and not np.array_equal(ideals[0], ideals[2])
    run.save(tmp_path / "run.npz")
    assert eft.TestRun.load(tmp_path / "run.npz").rig == HEAVY


def test_a_controller_is_blind_to_it():
    rig = RIG.replace(
        {"compensation.feedforward": True, "compensation.adaptive": True, "controller.realization": "digital"}
    )
    wrong = {"actuator.compressibility": 5e-13, "actuator.piston_area": 8e-3, "supply.pressure": 1.6e7}
    hidden = rig.replace({f"truth.{key}": value for key, value in wrong.items()})
    signals = np.sin(np.outer([3000.0, 0.2, 2500.0, 0.3], np.linspace(0.0, 20.0, 4000)))
    outputs = [eft.Controller(one).process(*signals) for one in (rig, hidden, rig.replace(wrong))]
    assert np.array_equal(outputs[0], outputs[1]) and not np.array_equal(outputs[0], outputs[2])
    for target in ("rust", "c"):
        assert eft.firmware.export(hidden, target) == eft.firmware.export(rig, target)


def test_an_identification_is_blind_to_it():
    run = eft.simulate(RIG, eft.sine_sweep(2200.0, 0.5, 5.0, 8.0, 1024.0))
    slow = RIG.replace({"truth.servovalve.pilot_time_constant": 2.8e-3})
    found = [
        eft.identification.fine_tune(rig, run.command, run.force, run.velocity, 1024.0) for rig in (RIG, slow)
    ]
    assert found[0] == found[1]


def test_linear_models_and_margins_judge_the_true_plant():
    key = "servovalve.pilot_time_constant"
    fast, slow = (RIG.replace({f"truth.{key}": factor * RIG[key]}) for factor in (0.8, 1.5))
    margins = [eft.linear.stability_margins(rig, sampled=True) for rig in (fast, fast.plant, RIG)]
    assert margins[0] == margins[1] != margins[2]
    assert eft.linearize(slow).poles().tolist() == eft.linearize(slow.plant).poles().tolist()
    assert eft.linearize(slow).poles().real.max() > 0.0 > eft.linearize(RIG).poles().real.max()
    area = RIG.replace({"truth.actuator.piston_area": 1.03 * RIG["actuator.piston_area"]})
    # For a larger piston the controller compensates too little, so the margin of the level increases.
    assert eft.stability_margin(area) > eft.stability_margin(RIG)


def test_maps_and_feasibility_take_it():
    masses = [5000.0, 9000.0]
    found = eft.linear.stability_map(
        RIG, ("truth.structure.mass", masses), ("compensation.level", [0.9, 1.0])
    )
    known = eft.linear.stability_map(RIG, ("structure.mass", masses), ("compensation.level", [0.9, 1.0]))
    assert np.array_equal(found.values, known.values)
    assert eft.check_feasibility(HEAVY, COMMAND) == eft.check_feasibility(HEAVY.plant, COMMAND)


def test_a_study_over_a_true_value_is_one_over_rigs():
    masses = [5000.0, 7040.0, 9000.0]
    hidden = eft.study(RIG, COMMAND, {"truth.structure.mass": masses})
    known = eft.study(RIG, COMMAND, {"structure.mass": masses})
    assert hidden["truth.structure.mass"].tolist() == masses
    assert np.array_equal(hidden["nrmse"], known["nrmse"]) and len(set(hidden["nrmse"])) == 3
    with pytest.raises(ValueError, match=r"`truth\.structure` is a section: name one of its keys"):
        eft.study(RIG, COMMAND, {"truth.structure": [1.0]})


def test_the_command_line_sets_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    options = ["--sweep", "2200", "0.5", "5", "2", "--set", "truth.structure.mass=9000", "-o", "run.eft"]
    assert main(["run", *options]) == 0
    assert same(eft.TestRun.load("run.eft"), eft.simulate(HEAVY, COMMAND))
    axes = ["--x", "truth.structure.mass", "7000", "9000", "2", "--y", "compensation.level", "0.9", "1", "2"]
    assert main(["map", *axes, "--json"]) == 0
    assert main(["run", "--sweep", "1", "1", "1", "1", "--set", "truth.limits.valve_command=1"]) == 2
    assert "truth.limits.valve_command = 1: must be a key of the plant" in capsys.readouterr().err


def test_the_found_flow_curve_does_not_change_the_true_one():
    flows = (0.95 * np.array(RIG["servovalve.flow_table.flows"])).tolist()
    rig = RIG.replace({"compensation.adaptive": True, "truth.servovalve.flow_table.flows": flows})
    corrected = eft.simulate(rig, COMMAND).corrected_rig()
    assert corrected["servovalve.true_flow_table.flows"] == flows
    assert corrected["truth"] is None
