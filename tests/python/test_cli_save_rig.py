"""`eft run --save-rig`: the rig with the flow curve that a test found, for the next one."""

import json

import numpy as np
import pytest

import eft
from eft.cli import main

SWEEP = ["--sweep", "8900", "0", "6", "8"]
ADAPTIVE = {"compensation.adaptive": True, "compensation.curve_correction": True}


def rig_file(folder, **changes):
    table = eft.Rig.zhao2005()["servovalve.flow_table"]
    flows = [(1.04 if x > 0 else 0.96) * q for x, q in zip(table["openings"], table["flows"], strict=True)]
    changes |= ADAPTIVE | {"servovalve.true_flow_table": table | {"flows": flows}}
    path = folder / "rig.toml"
    path.write_text(eft.Rig.zhao2005().replace(changes).to_toml())
    return ["--rig", str(path)], np.array(flows)


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_the_found_curve_is_the_next_test_s(tmp_path, capsys):
    options, true = rig_file(tmp_path)
    run = ["run", *options, *SWEEP]
    assert main([*run, "--save-rig", "next.toml"]) == 0
    assert "next.toml written" in capsys.readouterr().out
    first, corrected = eft.TestRun.load("run.eft"), eft.Rig.from_toml("next.toml")
    assert corrected == first.corrected_rig()
    openings = np.array(corrected["servovalve.flow_table.openings"])
    near = (np.abs(openings) > 0.05) & (np.abs(openings) < 0.4)
    found = np.array(corrected["servovalve.flow_table.flows"])
    np.testing.assert_allclose(found[near], true[near], rtol=0.01)
    np.testing.assert_array_equal(corrected["servovalve.true_flow_table.flows"], true)
    # With the saved curve the fixed scheme follows the command.
    errors = []
    for rig, code in ((options[1], 1), ("next.toml", 0)):
        assert main(["run", "--rig", rig, *SWEEP, "--set", "compensation.adaptive=false", "--json"]) == code
        answer = json.loads(capsys.readouterr().out)
        assert answer["saved_rig"] is None
        errors.append(answer["metrics"]["nrmse"])
    assert errors[1] < 0.5 * errors[0], errors


def test_a_bad_test_leaves_the_file_that_is_there(tmp_path, capsys):
    options, _ = rig_file(tmp_path, **{"protection.enabled": True, "protection.force_trip": 4000.0})
    (tmp_path / "next.toml").write_text("mine")
    assert main(["run", *options, *SWEEP, "--save-rig", "next.toml", "--json"]) == 1
    said = capsys.readouterr()
    assert "next.toml not written: the protection tripped" in said.err
    assert json.loads(said.out)["saved_rig"] is None
    assert (tmp_path / "next.toml").read_text() == "mine"
    assert (tmp_path / "run.eft").exists()


def test_an_interrupted_test_saves_no_rig(tmp_path, monkeypatch, capsys):
    options, _ = rig_file(tmp_path)
    simulate, calls = eft.simulate, []

    def interrupted(rig, command, dtype, progress=None):
        calls.append(len(command))
        if len(calls) == 1:
            progress(1024, len(command))
            raise KeyboardInterrupt
        return simulate(rig, command, dtype)

    monkeypatch.setattr(eft, "simulate", interrupted)
    assert main(["run", *options, *SWEEP, "--save-rig", "next.toml"]) == 130
    assert "next.toml not written: the test was interrupted" in capsys.readouterr().err
    assert not (tmp_path / "next.toml").exists()
