"""The errors that the feasibility check predicts, compared with simulated tests."""

import numpy as np
import pytest
from scipy import signal

import eft

RIG = eft.Rig.zhao2005()
NOISY = np.random.default_rng(5).standard_normal(3000)
RECORD = eft.Record(signal.lfilter([0.2], [1, -0.8], NOISY), 0.01, "noise")
LATE = {"controller.velocity_source": "derivative", "truth.sensors.displacement.delay": 4}
LEARNS = {
    "structure.kind": "linear",
    "controller.force_loop": "robust",
    "compensation.adaptive": True,
    "compensation.feedforward": True,
    "compensation.look_ahead": True,
}
STORIES = {
    "structure.kind": "shear_building",
    "structure.stories.masses": [7040.0, 6000.0],
    "structure.stories.dampings": [5200.0, 4800.0],
    "structure.stories.stiffnesses": [2.6e6, 2.3e6],
}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"compensation.mode": "off"},
        {"compensation.level": 0.9, "controller.force_loop": "robust"},
        LATE,
        STORIES | LATE,
    ],
)
def test_predicted_errors_are_those_of_a_small_test(changes):
    rig = RIG.replace(changes)
    masses = rig["structure.stories.masses"] if "structure.kind" in changes else 7040.0
    record = eft.Record(RECORD.acceleration, RECORD.dt, "noise").band_passed(0.5, 8.0)
    command = eft.effective_force(record.scaled(acceleration=0.05 / record.pga), masses, 4096.0)
    found = eft.check_feasibility(rig, command)
    metrics = eft.simulate(rig, command).metrics()
    assert found.force_error == pytest.approx(np.max(metrics.nrmse), rel=0.1)
    assert found.displacement_error == pytest.approx(np.max(metrics.displacement_error), rel=0.1)


def test_a_predicted_error_beyond_its_limit_is_a_reason_with_its_cause():
    command = eft.sine_sweep(2000.0, 0.0, 10.0, 16.0, 4096.0)
    late = RIG.replace({"controller.velocity_source": "derivative"})
    found = eft.check_feasibility(late, command)
    assert found.verdict == "no" and "the lead network compensates for 5 ms" in " ".join(found.reasons)
    told = late.replace({"compensation.velocity_delay": eft.linear.delay_budget(late).sensor})
    better = eft.check_feasibility(told, command)
    assert better.displacement_error < 0.2 * found.displacement_error
    assert "compensates for" not in " ".join(better.reasons)
    # An unstable loop has no error.
    answer = eft.check_feasibility(RIG.replace({"compensation.level": 1.1}), command)
    assert answer.force_error is None and answer.displacement_error is None
    silent = eft.Command(np.zeros(4096), 4096.0)
    assert eft.check_feasibility(RIG, silent).force_error is None


@pytest.mark.parametrize("delay", [0.005, 0.004, 0.003])
def test_with_a_guard_the_predicted_errors_are_those_of_a_loop_in_which_it_does_not_act(delay):
    rig = RIG.replace({"compensation.guard": True, "compensation.response_delay": delay})
    command = eft.sine_sweep(2000.0, 0.0, 10.0, 16.0, 4096.0)
    found, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
    assert found.force_error == pytest.approx(run.metrics().nrmse, rel=0.1)
    assert found.verdict == run.verdict.grade and found.left_out == ("compensation.guard",)


@pytest.mark.parametrize("source", ["sensor", "derivative", "observer"])
@pytest.mark.parametrize("loop", ["pd", "robust"])
def test_with_self_calibration_the_predicted_errors_are_those_after_it(source, loop):
    rig = RIG.replace(
        {
            "controller.velocity_source": source,
            "controller.observer_mass": 7040.0,
            "controller.force_loop": loop,
            "compensation.adaptive": True,
            "truth.sensors.displacement.delay": 4,
            "truth.sensors.velocity.delay": 4,
            "truth.servovalve.flow_gain_scale": 0.96,
        }
    )
    command = eft.sine_sweep(2200.0, 0.0, 10.0, 16.0, 4096.0)
    found = eft.check_feasibility(rig, command)
    metrics = eft.simulate(rig, command).metrics()
    assert found.force_error == pytest.approx(metrics.nrmse, abs=0.02)
    assert found.displacement_error == pytest.approx(metrics.displacement_error, abs=0.025)


@pytest.mark.parametrize(
    "changes",
    [
        # It divides by its own gain, and so compensates for 1.6 % too much.
        {"compensation.mode": "linear"},
        # The nonlinear scheme does not use it.
        {"compensation.flow_gain": 0.014},
    ],
)
def test_predicted_errors_are_those_of_the_valves_own_slope(changes):
    rig = RIG.replace({"structure.kind": "linear"} | changes)
    command = eft.sine_sweep(50.0, 0.0, 10.0, 16.0, 4096.0)
    found, metrics = eft.check_feasibility(rig, command), eft.simulate(rig, command).metrics()
    assert found.force_error == pytest.approx(metrics.nrmse, rel=0.04)
    assert found.displacement_error == pytest.approx(metrics.displacement_error, rel=0.01)


@pytest.mark.parametrize(("key", "value"), [("servovalve.overlap", 0.01), ("actuator.friction", 2000.0)])
def test_the_check_names_what_its_errors_do_not_contain(key, value):
    command = eft.sine_sweep(2200.0, 0.0, 10.0, 16.0, 4096.0)
    rig = RIG.replace({key: value})
    found = eft.check_feasibility(rig, command)
    assert found.left_out == (key,)
    wrong = rig.replace({f"truth.{key}": 2.0 * value})
    assert eft.check_feasibility(wrong, command).left_out == (key,)
    assert eft.check_feasibility(RIG, command).left_out == ()
    assert eft.simulate(rig, command).metrics().displacement_error > 1.5 * found.displacement_error


def test_an_underlap_is_named_where_it_matters_and_changes_little_where_not():
    command = eft.sine_sweep(2000.0, 0.3, 10.0, 8.0, 4096.0)
    rig = RIG.replace(LEARNS)
    without = eft.simulate(rig, command).metrics().nrmse
    for lap, matters in ((1e-5, False), (1e-4, True)):
        lapped = rig.replace({"servovalve.overlap": -lap})
        error = eft.simulate(lapped, command).metrics().nrmse
        named = "servovalve.overlap" in eft.check_feasibility(lapped, command).left_out
        assert named == matters
        assert error > 1.2 * without if matters else error == pytest.approx(without, rel=0.03)


@pytest.mark.parametrize("amplitude", [2200.0, 8900.0])
@pytest.mark.parametrize("adaptive", [False, True])
@pytest.mark.parametrize(
    ("key", "value"),
    [("servovalve.overlap", 5e-4), ("servovalve.overlap", -1e-3), ("actuator.friction", 800.0)],
)
def test_predicted_errors_contain_lap_and_friction_that_nobody_told(key, value, adaptive, amplitude):
    command = eft.sine_sweep(amplitude, 0.0, 10.0, 16.0, 4096.0)
    changes = {"controller.force_loop": "robust", "structure.kind": "linear"}
    plain = RIG.replace(changes | {"compensation.adaptive": adaptive})
    rig = plain.replace({f"truth.{key}": value})
    found, metrics = eft.check_feasibility(rig, command), eft.simulate(rig, command).metrics()
    assert found.force_error == pytest.approx(metrics.nrmse, rel=0.3)
    if key == "servovalve.overlap":
        assert 0.6 < found.displacement_error / metrics.displacement_error < 2.5
        assert found.displacement_error > eft.check_feasibility(plain, command).displacement_error
    # The opening is 2.2 % at 2.2 kN.
    assert found.left_out == (() if key == "servovalve.overlap" and amplitude == 8900.0 else (key,))


def test_a_self_calibrating_rig_without_compensation_has_its_predicted_error():
    command = eft.sine_sweep(2200.0, 0.0, 10.0, 16.0, 4096.0)
    rig = RIG.replace({"compensation.level": 0.0, "compensation.adaptive": True})
    found = eft.check_feasibility(rig, command)
    assert found.displacement_error == pytest.approx(
        eft.simulate(rig, command).metrics().displacement_error, rel=0.05
    )


@pytest.mark.parametrize(
    ("key", "factor"),
    [
        ("actuator.leakage", 10.0),
        ("actuator.leakage", 3.0),
        ("actuator.compressibility", 0.8),
        ("actuator.compressibility", 1.2),
        ("servovalve.spool_stroke", 1.1),
        ("servovalve.spool_sensitivity", 1.06),
        ("servovalve.pilot_time_constant", 1.4),
        ("servovalve.flow_gain_scale", 1.1),
    ],
)
def test_a_learning_controller_has_the_predicted_error_on_another_plant(key, factor):
    rig = RIG.replace(LEARNS)
    wrong = rig.replace({f"truth.{key}": factor * rig[key]})
    command = eft.sine_sweep(2000.0, 0.3, 10.0, 16.0, 4096.0)
    found, metrics = eft.check_feasibility(wrong, command), eft.simulate(wrong, command).metrics()
    assert 1 / 1.5 < found.force_error / metrics.nrmse < 1.5 or key in found.left_out


def test_what_is_true_and_what_is_known_of_the_oil_are_predicted_apart():
    rig = RIG.replace(LEARNS)
    command = eft.sine_sweep(2000.0, 0.3, 10.0, 16.0, 4096.0)
    key = "actuator.compressibility"
    told, true = (rig.replace({name: 1.2 * rig[key]}) for name in (key, f"truth.{key}"))
    errors = [eft.check_feasibility(one, command).force_error for one in (told, true)]
    assert errors[1] > 1.2 * errors[0]


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"limits.force_range": 1500.0}, "limits.force_range"),
        ({"sensors.force.range": 1500.0}, "sensors.force.range"),
        ({"sensors.velocity.range": 0.05}, "sensors.velocity.range"),
        ({"limits.velocity_range": 0.05}, "limits.velocity_range"),
        (
            {"controller.velocity_source": "derivative", "sensors.displacement.range": 1e-3},
            "sensors.displacement.range",
        ),
        ({"limits.valve_command": 0.3}, "limits.valve_command"),
        ({"dac.range": 0.3}, "dac.range"),
    ],
)
def test_a_range_that_the_command_exceeds_is_a_reason(changes, named):
    rig = RIG.replace(LEARNS)
    command = eft.sine_sweep(2000.0, 0.3, 10.0, 8.0, 4096.0)
    limited = rig.replace(changes)
    found = eft.check_feasibility(limited, command)
    assert found.verdict == "no" and any(named in reason for reason in found.reasons), found.reasons
    assert eft.simulate(limited, command).metrics().nrmse > 0.1
    # A range that the signal does not reach costs nothing.
    key = next(key for key in changes if key.endswith(named.split(".")[-1]))
    wide = rig.replace(changes | {key: 100.0 * changes[key]})
    assert not any(named in reason for reason in eft.check_feasibility(wide, command).reasons)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"actuator.attachment_play": 1e-5}, "actuator.attachment_play"),
        ({"truth.actuator.attachment_play": 5e-5}, "actuator.attachment_play"),
        ({"protection.enabled": True, "protection.start_time": 10.0}, "protection.start_time"),
        ({"supply.droop": 3e10, "supply.accumulator": 1e-10}, "supply.droop"),
    ],
)
def test_effects_that_no_linear_model_has_are_named_where_they_matter(changes, key):
    rig = RIG.replace(LEARNS)
    command = eft.sine_sweep(2000.0, 0.3, 10.0, 30.0, 4096.0)
    ruled = rig.replace(changes)
    found = eft.check_feasibility(ruled, command)
    assert found.left_out == (key,)
    assert eft.simulate(ruled, command).metrics().nrmse > 1.5 * found.force_error
    last = next(reversed(changes)) if key != "supply.droop" else key
    little = rig.replace(changes | {last: 1e-4 * changes[last]})
    assert eft.check_feasibility(little, command).left_out == ()


@pytest.mark.parametrize(
    ("changes", "rate"),
    [
        ({}, 4096.0),
        (
            {"truth.servovalve.flow_gain_scale": 0.9, "truth.structure.stories.masses": [7000.0, 4000.0]},
            4096.0,
        ),
        ({"controller.velocity_source": "derivative"}, 700.0),
    ],
)
def test_a_building_that_learns_has_the_predicted_errors(changes, rate):
    stories = {"masses": [6000.0, 4000.0], "stiffnesses": [2e6, 1.5e6], "dampings": [5e3, 4e3]}
    rig = RIG.replace(
        {"structure.kind": "shear_building", "compensation.adaptive": True, "controller.force_loop": "robust"}
        | {"controller.sample_rate": rate}
        | {f"structure.stories.{key}": values for key, values in stories.items()}
        | changes
    )
    record = eft.Record(RECORD.acceleration, RECORD.dt, "noise").band_passed(0.5, 8.0)
    command = eft.effective_force(record.scaled(acceleration=0.3 / record.pga), stories["masses"], rate)
    found, metrics = eft.check_feasibility(rig, command), eft.simulate(rig, command).metrics()
    assert found.force_error == pytest.approx(np.max(metrics.nrmse), rel=0.1)
    assert found.displacement_error == pytest.approx(np.max(metrics.displacement_error), rel=0.25)


@pytest.mark.parametrize("loop", ["paper", "robust", "feedforward"])
@pytest.mark.parametrize("highest", [10.0, 25.0, 45.0])
def test_the_part_of_a_command_above_20_hz_is_predicted_as_well(loop, highest):
    changes = {
        "paper": {},
        "robust": {"controller.force_loop": "robust"},
        "feedforward": LEARNS,
    }
    slow = eft.Command.noise(500.0, (0.5, 4.0), 16.0, 4096.0)
    fast = eft.Command.noise(400.0, (4.0, highest), 16.0, 4096.0, seed=2)
    window = np.minimum(1.0, np.minimum(slow.time, 16.0 - slow.time))
    command = eft.Command(window * (slow.values + fast.values), 4096.0)
    rig = RIG.replace(changes[loop])
    found, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
    metrics = run.metrics()
    assert found.force_error == pytest.approx(metrics.nrmse, rel=0.2, abs=0.01)
    assert found.left_out == ()
    named = any("(rms) above 30 Hz, where" in reason for reason in found.reasons)
    assert named == (metrics.oscillation > 0.05)
    assert (found.verdict == "go") == (run.verdict.grade == "go")


@pytest.mark.parametrize("loop", ["pd", "robust"])
def test_a_structure_without_a_spring_has_predicted_errors(loop):
    free = {"structure.kind": "linear", "structure.stiffness": 0.0, "structure.damping": 8000.0}
    noise = {"sensors.force.noise": 18.0, "sensors.velocity.noise": 5e-4}
    rig = RIG.replace(free | noise | {"controller.force_loop": loop, "compensation.level": 0.95})
    command = eft.sine_sweep(2000.0, 0.5, 10.0, 16.0, 4096.0)
    found, metrics = eft.check_feasibility(rig, command), eft.simulate(rig, command).metrics()
    assert found.force_error == pytest.approx(metrics.nrmse, rel=0.1)
    assert found.displacement_error == pytest.approx(metrics.displacement_error, rel=0.25, abs=0.005)


def test_the_force_error_contains_the_command_that_no_actuator_follows():
    white = np.random.default_rng(5).standard_normal(16 * 4096)
    values = signal.lfilter(*signal.butter(1, 20.0, fs=4096.0), white)
    rig = RIG.replace(LEARNS | {"compensation.adaptive": False})
    command = eft.Command(2000.0 * values / np.abs(values).max(), 4096.0)
    found, metrics = eft.check_feasibility(rig, command), eft.simulate(rig, command).metrics()
    assert found.left_out == ("command above 100 Hz",)
    assert found.force_error == pytest.approx(metrics.nrmse, rel=0.05)


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize(
    "changes", [{}, {"compensation.look_ahead": False}, {"compensation.adaptive": False}]
)
def test_a_told_latency_of_the_load_cell_delays_the_command(told, changes):
    latency = 4 / 4096
    rig = RIG.replace(
        LEARNS
        | {"truth.sensors.force.delay": 4, "controller.force_delay": latency if told else 0.0}
        | changes
    )
    command = eft.sine_sweep(3000.0, 0.5, 12.0, 12.0, 4096.0)
    found, metrics = eft.check_feasibility(rig, command), eft.simulate(rig, command).metrics()
    assert found.left_out == ()
    assert found.force_error == pytest.approx(metrics.nrmse, rel=0.35)
