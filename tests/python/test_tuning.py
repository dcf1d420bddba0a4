"""Advice on the gains, several tests in one table, and the choice of a valve."""

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import eft
from eft._valve_choice import with_valve
from eft.cli import main

RIG = eft.Rig.zhao2005()
DIGITAL = RIG.replace({"controller.realization": "digital"})
CATALOGUE = """
[[valve]]
name = "small"
rated_flow = "2 gpm"
rated_drop = "1000 psi"
phase_90_frequency = "60 Hz"
[[valve]]
name = "large"
rated_flow = "90 gpm"
rated_drop = "1000 psi"
phase_90_frequency = "60 Hz"
"""


@pytest.mark.parametrize("rig", [RIG, DIGITAL, RIG.replace({"controller.force_loop": "robust"})])
def test_the_margin_is_the_verdict_s(rig):
    advice = eft.tune_force_loop(rig)
    margins = eft.linear.stability_margins(rig, sampled=True)
    assert advice.margin == pytest.approx(margins.loop_gain, rel=1e-6)
    assert advice.advised_margin > 5.0


def test_the_margin_between_the_lines_is_that_of_the_model():
    advice = eft.tune_force_loop(DIGITAL)
    for gain, derivative in [(0.5, 2e-4), (0.4, 5e-4), (0.7, 1e-3)]:
        rig = DIGITAL.replace(
            {"controller.proportional_gain": gain, "controller.derivative_gain": derivative}
        )
        exact = eft.linear.stability_margins(rig, sampled=True).loop_gain
        assert advice.margin_at(gain, derivative) == pytest.approx(exact, rel=0.05)


def test_the_truth_is_not_looked_at_and_the_picture_shows_both_gains():
    advice = eft.tune_force_loop(DIGITAL.replace({"truth.actuator.compressibility": 3e-13}))
    assert advice.margin == pytest.approx(eft.tune_force_loop(DIGITAL).margin)
    ax = advice.plot(ax=Figure().subplots())
    points = {tuple(np.round(line.get_xydata()[0], 6)) for line in ax.get_lines()}
    assert (0.8059, 0.2) in points
    advised = [advice.coefficients[f"controller.{gain}_gain"] for gain in ("proportional", "derivative")]
    assert (advised[0], round(1e3 * advised[1], 6)) in points


def test_design_draws_the_margin(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("rig.toml").write_text(DIGITAL.to_toml(), encoding="utf-8")
    assert main(["design", "rig.toml", "-o", "gains.svg"]) == 0
    assert Path("gains.svg").stat().st_size > 5000
    assert main(["design", "rig.toml", "-o", "gains.doc"]) == 2


def adaptive(tmp_path):
    rig = RIG.replace({"controller.force_loop": "robust", "compensation.adaptive": True})
    (tmp_path / "rig.toml").write_text(rig.to_toml(), encoding="utf-8")
    (tmp_path / "catalogue.toml").write_text(CATALOGUE, encoding="utf-8")
    return rig


def test_a_tried_valve_has_its_own_curve_and_a_controller_blind_to_the_truth():
    command = eft.sine_sweep(3000.0, 0.5, 5.0, 2.0, 1024.0)
    valves = {"one": {"rated_flow": "90 gpm", "rated_drop": "1000 psi", "phase_90_frequency": "60 Hz"}}

    def row(changes):
        return eft.compare_valves(RIG.replace(changes), {"sweep": command}, valves).rows[0]

    openings, flows = RIG["servovalve.flow_table.openings"], RIG["servovalve.flow_table.flows"]
    of_the_old = {"openings": openings, "flows": [0.5 * flow for flow in flows]}
    known = row({})
    assert row({"servovalve.true_flow_table": of_the_old}) == known
    assert row({"truth.servovalve.flow_table": of_the_old}) == known
    assert row({"truth.servovalve.pilot_time_constant": 5e-3}) == known
    assert row({"truth.servovalve.flow_gain_scale": 0.9}).force_error > known.force_error
    late = with_valve(RIG.replace({"truth.dac.delay": 3, "truth.sensors.velocity.delay": 5}), valves["one"])
    delay = "compensation.response_delay"
    assert late[delay] == with_valve(RIG, valves["one"])[delay] and late["truth.dac.delay"] == 3
    learned = eft.simulate(RIG.replace({"compensation.adaptive": True}), command).calibration
    assert learned is not None
    assert row({"compensation.adaptive": True, "calibration": dict(learned)}).valve == "one"


def test_a_tried_valve_keeps_nothing_of_the_old_one_but_the_error_of_its_flow():
    sheet = {"rated_flow": "90 gpm", "rated_drop": "1000 psi", "phase_90_frequency": "60 Hz"}
    worn = {
        "servovalve.null_bias": 0.02,
        "servovalve.overlap": 1e-3,
        "servovalve.leakage.constant": 1e-5,
        "servovalve.leakage.proportional": 1e-13,
        "servovalve.torque_motor_frequency": 200.0,
        "servovalve.torque_motor_damping": 0.5,
        "servovalve.pilot_flow_limit": 1e-3,
    }
    assert with_valve(RIG.replace(worn), sheet) == with_valve(RIG, sheet)
    scaled = with_valve(RIG.replace({"servovalve.flow_gain_scale": 0.9}), sheet)
    assert scaled["servovalve.flow_gain_scale"] == 0.9


def test_the_valve_that_does_is_found(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rig = adaptive(tmp_path)
    sweep = ["--sweep", "8900", "0.5", "3", "4"]
    assert (
        main(["check", "--rig", "rig.toml", "--valves", "catalogue.toml", *sweep, "--json", "--largest"]) == 0
    )
    answer = json.loads(capsys.readouterr().out)
    assert answer["suitable"] == ["large"]
    small, large = answer["rows"]
    assert small["grade"] == "no" and small["limited_by"] and large["grade"] != "no"
    assert small["largest_scale"] < 1.0 < large["largest_scale"]
    command = eft.sine_sweep(8900.0, 0.5, 3.0, 4.0, 4096.0)
    sheet = eft.read_valves("catalogue.toml")["large"]
    assert isinstance(sheet, eft.ValveSheet) and sheet["rated_flow"] == sheet.rated_flow
    assert sheet.overlap is None and "overlap" not in sheet and len(sheet) == len(dict(sheet))
    found = eft.compare_valves(rig, {"sweep": command}, "catalogue.toml")
    assert found.suitable == ("large",) and found.rows[1].force_error == pytest.approx(large["force_error"])
    assert list(found.to_pandas()["valve"]) == ["small", "large"]


def test_no_valve_is_exit_code_1(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    adaptive(tmp_path)
    asked = ["check", "--rig", "rig.toml", "--valves", "catalogue.toml", "--sweep", "200000", "0.5", "3", "4"]
    assert main(asked) == 1


def test_several_records_make_one_table(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    adaptive(tmp_path)
    time = np.arange(0.0, 4.0, 0.01)
    np.savetxt(
        "a.csv",
        np.c_[time, np.sin(9 * time)],
        delimiter=",",
        header="time (s),acceleration (m/s2)",
        comments="",
    )
    asked = ["check", "--rig", "rig.toml", "a.csv", "elcentro", "--scale", "0.3", "--json"]
    assert main(asked) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [row["valve"] for row in rows] == ["as configured"] * 2
    assert len({row["command"] for row in rows}) == 2


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "valve"),
        ("[[valve]]\nrated_flow = 1.0\n", "name"),
        (CATALOGUE.replace('"small"', '"large"'), "twice"),
        (CATALOGUE.replace("rated_drop", "drop"), "drop"),
        (CATALOGUE.replace('"2 gpm"', '"2 psi"'), "rated_flow"),
    ],
)
def test_a_wrong_catalogue_is_named(text, says, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("c.toml").write_text(text, encoding="utf-8")
    assert main(["check", "--valves", "c.toml", "--sweep", "1000", "1", "2", "1"]) == 2
    said = capsys.readouterr().err
    assert "c.toml" in said and says in said
