"""The verdict on a test, its reasons and its remedies."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg

import eft
from buildings import building, matrices
from eft import _native
from eft.cli import main

RIG = eft.Rig.zhao2005()
SWEEP = eft.sine_sweep(8900.0, 0.0, 10.0, 16.0, 4096.0)


def said(run, word):
    """The reasons that contain a word."""
    return [reason for reason in run.verdict.reasons if word in reason]


def test_the_paper_s_test_counts():
    verdict = eft.simulate(RIG, SWEEP).verdict
    assert verdict.ok and "The force misses the command by" in verdict.summary


@pytest.mark.parametrize(("gain", "grade"), [(1.0, "caution"), (1.1, "no")])
def test_a_thin_gain_margin_is_no_go_and_the_designed_loop_helps(gain, grade):
    # The linear model gives the paper's digital loop a gain margin of 1.17.
    digital = RIG.replace({"controller.realization": "digital"})
    rig = digital.replace({"controller.proportional_gain": gain * RIG["controller.proportional_gain"]})
    run = eft.simulate(rig, eft.sine_sweep(2200.0, 0.5, 10.0, 4.0, 4096.0))
    assert run.verdict.grade == grade and said(run, "gain margin")
    assert run.verdict.changes["controller.force_loop"] == "robust"


def test_a_thin_dead_time_margin_is_told():
    # One more sample of delay makes the paper's digital loop unstable. The designed loop tolerates 3 ms.
    digital = RIG.replace({"controller.realization": "digital"})
    short = eft.sine_sweep(2200.0, 0.5, 10.0, 4.0, 4096.0)
    assert said(eft.simulate(digital, short), "0.24 ms more of dead time, advised at least 1 ms")
    strict = digital.replace({"verdict.no.dead_time": 3e-4})
    assert not eft.simulate(strict, short).verdict.ok
    assert not said(eft.simulate(digital.replace({"controller.force_loop": "robust"}), short), "dead time")


def test_an_unstable_loop_is_a_no_however_short_the_test():
    command = eft.sine_sweep(2000.0, 3.0, 8.0, 1.0, 4096.0)
    run = eft.simulate(RIG.replace({"compensation.level": 1.05}), command)
    assert not run.verdict.ok and run.metrics().nrmse < 0.1
    assert said(run, "The loop is unstable at 4096 Hz: it grows at 0.0")
    assert run.verdict.changes["compensation.adaptive"] is True


def test_a_soft_attachment_is_judged_with_the_lead_for_the_delay_that_is_found():
    soft = RIG.replace(
        {
            "controller.force_loop": "robust",
            "controller.realization": "digital",
            "compensation.adaptive": True,
            "actuator.attachment_stiffness": 3.7e7,
            "truth.sensors.velocity.delay": 6,
        }
    )
    sweep = eft.sine_sweep(2200.0, 0.0, 10.0, 16.0, 4096.0)
    run = eft.simulate(soft, sweep)
    # The configured loop is stable. The lead network for the delay of the velocity excites the oil column.
    assert _native.margins_within(soft, 4096.0, 1.0, -1.0, 1.0, "steeper")[0] < 0.0
    assert run.metrics()["nrmse"] > 1.0
    check = eft.check_feasibility(soft, sweep)
    assert check.verdict == "no" and "even after self-calibration" in " ".join(check.reasons)
    # The same delay of a velocity at the structure's side excites nothing.
    beside = soft.replace({"sensors.motion_at": "structure"})
    assert not [reason for reason in eft.simulate(beside, sweep).verdict.reasons if "unstable" in reason]


def test_the_lead_that_will_be_found_contains_the_delay_of_a_derivative_and_no_configured_one():
    learns = eft.Rig.zhao2005().replace(
        {
            "controller.force_loop": "robust",
            "controller.realization": "digital",
            "compensation.adaptive": True,
            "actuator.attachment_stiffness": 5e7,
        }
    )
    sweep = eft.sine_sweep(2200.0, 0.0, 10.0, 16.0, 4096.0)
    late = learns.replace({"controller.velocity_source": "derivative", "truth.sensors.displacement.delay": 8})
    assert eft.simulate(late, sweep).metrics()["nrmse"] > 1.0
    assert eft.check_feasibility(late, sweep).verdict == "no"
    # A response delay may contain the sensor's delay.
    configured = learns.replace({"sensors.velocity.delay": 6, "actuator.attachment_stiffness": 6e7})
    delay = eft.linear.delay_budget(configured).path
    configured = configured.replace({"compensation.response_delay": delay})
    run = eft.simulate(configured, sweep)
    assert run.metrics()["nrmse"] < 0.1
    assert not [reason for reason in run.verdict.reasons if "even after self-calibration" in reason]


def test_what_the_rig_does_not_have_is_the_cause_and_no_setting_helps():
    verdict = eft.simulate(RIG, eft.sine_sweep(40_000.0, 0.0, 10.0, 16.0, 4096.0)).verdict
    assert any(reason.startswith("Displacement exceeds") for reason in verdict.reasons)
    # Velocity, flow and power exceed their limits together.
    assert sum(word in reason for reason in verdict.reasons for word in ("Velocity", "Flow", "power")) == 1
    assert not verdict.ok and verdict.remedies == ()


def test_noise_is_named_where_it_makes_the_error():
    noisy = RIG.replace({"sensors.velocity.noise": 0.02})
    sweep = eft.sine_sweep(1000.0, 0.5, 5.0, 4.0, 2048.0)
    assert said(eft.simulate(noisy, sweep), "Noise of the sensors makes most of the error")
    loud = eft.sine_sweep(1000.0, 0.5, 5.0, 4.0, 2048.0)
    assert not said(eft.simulate(RIG.replace({"compensation.mode": "off"}), loud), "Noise")


def test_an_unknown_deviation_is_named():
    rig = RIG.replace({"truth.servovalve.flow_gain_scale": 0.9})
    assert said(eft.simulate(rig, SWEEP), "servovalve.flow_gain_scale = 0.9")


def test_a_force_loop_that_cannot_be_designed_gets_lower_gains():
    slow = RIG.replace({"controller.sample_rate": 250.0, "controller.proportional_gain": 0.9})
    with pytest.raises(ValueError, match="oil column"):
        eft.design_force_loop(slow)
    command = eft.sine_sweep(500.0, 0.5, 5.0, 2.0, 250.0)
    run = eft.simulate(slow, command)
    assert said(run, "gain margin") and run.verdict.changes["controller.proportional_gain"] < 0.9
    assert not said(eft.simulate(slow.replace(run.verdict.changes), command), "gain margin")


@pytest.mark.parametrize(("system", "unit"), [("si", "mm"), ("us", "in")])
def test_reasons_are_in_the_units_in_use(system, unit):
    run = eft.simulate(RIG, eft.sine_sweep(40_000.0, 0.0, 10.0, 4.0, 1024.0))
    with eft.use_units(system):
        [told] = said(run, "Displacement exceeds")
    assert told.endswith(f" {unit}.")


def test_a_study_and_its_runs_have_one_verdict():
    settings = {
        "truth.servovalve.flow_gain_scale": [0.9, 1.0, 1.05],
        "controller.realization": ["analog", "digital"],
        "controller.proportional_gain": [0.4, 0.88],
    }
    sweep = eft.sine_sweep(2000.0, 0.5, 8.0, 4.0, 2048.0)
    study = eft.study(RIG, sweep, settings, progress=False)
    runs = [eft.simulate(study.rig(index), sweep) for index in range(len(study))]
    assert study["verdict"].tolist() == [run.verdict.grade for run in runs]
    unstable = [not eft.linearize(run.rig, sampled=True, sample_rate=2048.0).stable for run in runs]
    assert any(unstable) and not all(unstable)
    assert {study["verdict"][index] for index in np.flatnonzero(unstable)} == {"no"}


def test_a_valve_at_its_stops_makes_no_test():
    run = eft.simulate(RIG, eft.sine_sweep(60_000.0, 0.0, 10.0, 16.0, 4096.0))
    assert not run.verdict.ok and (said(run, "valve's capacity") or said(run, "stroke"))


SHORT = eft.sine_sweep(8900.0, 0.5, 6.0, 6.0, 1024.0)


def with_valve(share):
    """The paper's rig with a smaller valve, which the controller knows."""
    flows = [share * flow for flow in RIG["servovalve.flow_table.flows"]]
    return RIG.replace({"servovalve.flow_table.flows": flows})


def test_a_valve_too_small_is_named_with_the_flow_that_it_needs():
    run = eft.simulate(with_valve(0.3), SHORT)
    [told] = said(run, "valve's capacity")
    assert "too small" in told
    needed = float(re.search(r"([\d.]+) times its flow", told).group(1))
    assert needed > 1.0 and not run.verdict.ok
    [opening] = [one for one in _native.demands(with_valve(0.3 * needed), SHORT) if "spool" in one["name"]]
    assert opening["required"] == pytest.approx(1.0, rel=0.01)
    assert not said(eft.simulate(with_valve(0.3 * needed), SHORT), "valve's capacity")


def test_a_valve_large_enough_is_not_called_too_small():
    run = eft.simulate(RIG.replace({"controller.proportional_gain": 10.0}), SHORT)
    [told] = said(run, "valve's capacity")
    assert "too small" not in told and "controller" in told


def test_a_pump_too_small_is_named_with_the_flow_that_it_needs():
    run = eft.simulate(RIG.replace(eft.data_sheets.supply("19 MPa", "5 gpm", "1 gal", "10 MPa")), SHORT)
    [told] = said(run, "the pump is too small")
    needed = float(re.search(r"([\d.]+) L/min on average", told).group(1))
    assert not run.verdict.ok and not said(run, "valve")
    supply = eft.data_sheets.supply("19 MPa", 1.001 * needed / 60_000.0, "1 gal", "10 MPa")
    helped = eft.simulate(RIG.replace(supply), SHORT)
    assert not said(helped, "the pump is too small") and not said(helped, "Mean flow of the pump exceeds")


def test_a_force_error_of_69_per_cent_at_the_stops_is_a_no_and_ends_with_one(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rig = with_valve(0.0725)
    run = eft.simulate(rig, SHORT)
    assert run.metrics().nrmse == pytest.approx(0.69, abs=0.01) and run.flags & eft.Status.SPOOL_STOP
    assert run.verdict.grade == "no" and said(run, "The force misses the command by 6")
    Path("rig.toml").write_text(rig.to_toml(), encoding="utf-8")
    asked = ["--rig", "rig.toml", "--sweep", "8900", "0.5", "6", "6", "--sample-rate", "1024"]
    for name in ("check", "run"):
        assert main([name, *asked]) == 1
        assert "valve is too small" in capsys.readouterr().out


def test_self_calibration_is_the_remedy_for_an_unknown_flow_gain():
    rig = RIG.replace({"truth.servovalve.flow_gain_scale": 1.04, "truth.structure.damping": 1500.0})
    run = eft.simulate(rig, SWEEP)
    assert not run.verdict.ok
    helped = eft.simulate(rig.replace(run.verdict.changes), SWEEP)
    assert helped.verdict.ok and helped.metrics().nrmse < 0.05


def test_a_falling_supply_is_named():
    low = {"supply.schedule.times": [0.0, 1.0, 2.0], "supply.schedule.pressures": [1.9e7, 1.9e7, 1.5e7]}
    run = eft.simulate(RIG.replace({f"truth.{key}": value for key, value in low.items()}), SWEEP)
    assert said(run, "supply pressure falls to 79 %") or said(run, "supply pressure falls to 79%")
    assert run.verdict.changes["compensation.supply_correction"] is True


def test_a_command_made_for_another_mass_is_a_caution():
    motion = eft.Record(np.sin(np.arange(400) / 20.0), dt=0.01)
    for mass, warned in ((RIG["structure.mass"], False), (0.5 * RIG["structure.mass"], True)):
        run = eft.simulate(RIG, eft.effective_force(motion, mass=mass, sample_rate=1024.0))
        assert bool(said(run, f"{mass:.6g} kg")) == warned
        assert run.verdict.grade != "go" or not warned
    assert not said(eft.simulate(RIG, SWEEP), "kg")


def test_limits_are_keys():
    strict = {"verdict.no.force_error": 0.01, "verdict.caution.force_error": 0.005}
    assert eft.simulate(RIG, SWEEP).verdict.ok
    assert not eft.simulate(RIG.replace(strict), SWEEP).verdict.ok
    with pytest.raises(ValueError, match="unknown key"):
        RIG.replace({"verdict.no.force": 1.0})


def test_the_largest_scale_counts_and_a_larger_one_does_not():
    command = eft.sine_sweep(8900.0, 0.5, 4.0, 4.0, 4096.0)
    found = eft.largest_scale(RIG, command, tolerance=0.02)
    assert found.limited_by and 0.1 < found.scale < 20.0

    def counts(scale):
        return eft.simulate(RIG, eft.Command(scale * command.values, 4096.0)).verdict.ok

    assert counts(found.scale) and not counts(1.021 * found.scale)
    with pytest.raises(ValueError, match="tolerance = 0"):
        eft.largest_scale(RIG, command, tolerance=0.0)
    with pytest.raises(ValueError, match="mass, sample_rate"):
        eft.largest_scale(RIG, command, mass=7000.0)


def test_a_force_that_is_too_small_has_a_larger_scale():
    rig = RIG.replace({"truth.sensors.force.noise": 20.0})
    command = eft.sine_sweep(100.0, 0.5, 10.0, 4.0, 1024.0)

    def verdict(scale):
        return eft.simulate(rig, eft.Command(scale * command.values, 1024.0)).verdict

    assert not verdict(1.0).ok and not verdict(0.5).ok and verdict(4.0).ok
    found = eft.largest_scale(rig, command, tolerance=0.1)
    assert found.scale >= 4.0 and verdict(found.scale).ok and not verdict(1.101 * found.scale).ok
    never = rig.replace({"verdict.no.force_error": 1e-6})
    assert eft.largest_scale(never, command) == eft.LargestScale(
        0.0, eft.simulate(never, command).verdict.reasons
    )


def test_the_largest_scale_of_a_record_takes_its_mass():
    times = np.arange(0.0, 4.0, 0.01)
    record = eft.Record(np.sin(2 * np.pi * times), 0.01, "sine")
    light = eft.largest_scale(RIG, record, mass=1000.0, tolerance=0.2)
    heavy = eft.largest_scale(RIG, record, mass=2000.0, tolerance=0.2)
    assert light.scale == pytest.approx(2.0 * heavy.scale, rel=0.25)


def test_the_largest_scale_of_a_record_on_a_building_takes_its_floors():
    stories = {"masses": [7000.0, 6000.0], "dampings": [4e3, 4e3], "stiffnesses": [7e5, 6e5]}
    building = RIG.replace({"structure.kind": "shear_building", "structure.stories": stories})
    record = eft.Record(np.sin(2 * np.pi * np.arange(0.0, 4.0, 0.01)), 0.01, "sine")
    given = eft.effective_force(record, stories["masses"], building["controller.sample_rate"])
    found = eft.largest_scale(building, record, tolerance=0.2)
    assert found == eft.largest_scale(building, given, tolerance=0.2) and found.scale > 0.0


def test_check_tries_the_remedies_and_finds_the_largest_scale(tmp_path, capsys):
    rig = RIG.replace({"truth.servovalve.flow_gain_scale": 1.04, "truth.structure.damping": 1500.0})
    path = tmp_path / "rig.toml"
    path.write_text(rig.to_toml(), encoding="utf-8")
    asked = ["check", "--rig", str(path), "--sweep", "8900", "0.5", "4", "4", "--json"]
    code = main([*asked, "--try-remedies", "--largest"])
    answer = json.loads(capsys.readouterr().out)
    assert code == (1 if answer["verdict"] == "no" else 0)
    sweep = eft.sine_sweep(8900.0, 0.5, 4.0, 4.0, 4096.0)
    verdict, before = eft.simulate(rig, sweep).verdict, eft.check_feasibility(rig, sweep)
    assert answer["verdict"] == verdict.grade
    assert {*answer["reasons"]} == {*verdict.reasons, *before.reasons}
    assert answer["remedies"]["compensation.adaptive"] is True
    assert answer["with_remedies"]["grade"] in ("go", "caution")
    # The loop is unstable for any factor.
    assert answer["largest_scale"] == 0.0 and answer["limited_by"]


GUARDED = {
    "controller.force_loop": "robust",
    "compensation.level": 0.9,
    "protection.enabled": True,
    "protection.force_trip": 20e3,
    "protection.displacement_trip": 0.1,
}
STIFF = {"structure.kind": "linear", "structure.stiffness": 7040 * (2 * np.pi * 5.0) ** 2}


def of_protection(changes, rate):
    """The remarks on the protection: the same before a test and after it, and never the reason of a no."""
    command = eft.sine_sweep(2000.0, 0.5, 3.0, 2.0, rate)
    rig = RIG.replace(GUARDED | changes)
    check, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
    told = [one for one in check.reasons if "1.75 times" in one]
    assert told == said(run, "1.75 times")
    without = eft.check_feasibility(rig.replace({"protection.enabled": False}), command)
    assert check.verdict == ("caution" if told and without.verdict == "go" else without.verdict)
    # No change of a level is advised without the engineer.
    assert run.verdict.ok and not [one for one in run.verdict.remedies if one.why in told]
    return told


def test_a_low_level_of_the_force_is_told():
    # An eighth of the capacity of 156.0 kN is 19.50 kN.
    (told,) = of_protection({"protection.force_trip": 12e3}, 4096.0)
    assert told.startswith(
        "The level protection.force_trip = 12 kN is 7.7 % of the actuator's capacity, "
        "advised at least 12.5 % (19.5 kN)"
    )
    least = RIG["actuator.piston_area"] * RIG["supply.pressure"] / 8.0
    assert of_protection({"protection.force_trip": least}, 4096.0) == []


def test_a_sample_rate_that_is_low_for_the_specimen_and_the_protection_is_told():
    (told,) = of_protection(STIFF, 1024.0)
    assert told.startswith(
        "The sample rate 1024 Hz is 205 times the natural frequency of 5 Hz, "
        "advised at least 250 times (1250 Hz)"
    )
    assert of_protection(STIFF, 1280.0) == []


def test_each_floor_whose_sample_rate_is_low_for_the_protection_is_told_in_one_remark():
    rig = building(3, **GUARDED)
    mass, _, stiffness = matrices(3)
    squares, shapes = linalg.eigh(stiffness, mass)
    # A force on a floor moves each mode by the square of its shape there.
    shares = shapes**2 / (shapes**2).sum(axis=1, keepdims=True)
    own = np.sqrt(shares @ squares) / (2 * np.pi)

    def told(rate):
        one = eft.sine_sweep(200.0, 0.5, 3.0, 2.0, rate)
        command = eft.Command(np.stack([one.values] * 3), rate)
        check, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
        remarks = [reason for reason in check.reasons if "1.75 times" in reason]
        assert remarks == said(run, "1.75 times")
        return remarks, [said(run.actuator(i), "1.75 times") for i in range(3)]

    # The ground floor and the middle one are about as fast, the top is slower.
    assert own[2] < own[0] < own[1] and 250.0 * own[2] < 960.0 < 250.0 * own[0]
    (remark,), each = told(960.0)
    assert remark.startswith(
        f"The sample rate 960 Hz is {960 / own[0]:.0f} times the natural frequency of {own[0]:.3g} Hz "
        f"of floor 1 and {960 / own[1]:.0f} times that of {own[1]:.3g} Hz of floor 2, advised at "
        f"least 250 times ({250 * own[1]:.0f} Hz)"
    )
    assert ["floor 1" in " ".join(of) for of in each] == [True, False, False]
    assert ["floor 2" in " ".join(of) for of in each] == [False, True, False] and each[2] == []
    assert told(250.0 * own[1]) == ([], [[], [], []])


@pytest.mark.parametrize(
    ("side", "play", "told"),
    [
        ("piston", 1.9e-5, None),
        ("piston", 2e-5, "0.02 mm and the motion measured at the piston it did in 23 of 128"),
        ("piston", 3e-4, "0.2 mm and the motion measured at the piston it did in 109 of 128"),
        ("structure", 9e-5, None),
        ("structure", 1e-4, "0.1 mm and the motion measured at the structure it did in 5 of 128"),
    ],
)
def test_a_play_with_which_sound_sensors_are_blamed_is_told(side, play, told):
    rig = RIG.replace(GUARDED | {"actuator.attachment_play": play, "sensors.motion_at": side})
    command = eft.sine_sweep(2000.0, 0.5, 3.0, 2.0, 4096.0)
    found = [one for one in eft.check_feasibility(rig, command).reasons if "sound sensor" in one]
    assert found == said(eft.simulate(rig, command), "sound sensor")
    assert [told in one for one in found] == ([] if told is None else [True])
    without = rig.replace({"protection.plausibility": False})
    assert not [one for one in eft.check_feasibility(without, command).reasons if "sound sensor" in one]


@pytest.mark.parametrize("off", ["protection.enabled", "protection.plausibility"])
def test_without_the_watch_neither_is_told(off):
    assert of_protection(STIFF | {"protection.force_trip": 12e3, off: False}, 1024.0) == []
    assert len(of_protection(STIFF | {"protection.force_trip": 12e3}, 1024.0)) == 2
