"""The adaptive and the protected controller from Python have the bits of `simulate`."""

import copy
import pickle

import numpy as np
import pytest

import eft

RATE = 4096.0
SWEEP = eft.sine_sweep(8900.0, 0.0, 10.0, 6.0, RATE)
DIGITAL = eft.Rig.zhao2005().replace({"controller.realization": "digital"})
NOISY = {"sensors.velocity.noise": 5e-4, "sensors.force.noise": 80.0, "sensors.spool.noise": 5e-4}
ADAPTIVE = {
    "compensation.feedforward": True,
    "compensation.adaptive": True,
    "servovalve.flow_gain_scale": 1.06,
    **NOISY,
}
CASES = {
    "adaptive": ADAPTIVE,
    "looking ahead": {**ADAPTIVE, "compensation.look_ahead": True},
    "guard alone": {"compensation.guard": True, "compensation.level": 1.05},
    "supply": {
        "compensation.supply_correction": True,
        "supply.schedule.times": [0.0, 6.0],
        "supply.schedule.pressures": [1.9e7, 1.6e7],
    },
    "protection": {
        "protection.enabled": True,
        "protection.displacement_trip": 0.02,
        "protection.start_time": 0.5,
        "protection.ramp_time": 0.3,
        "compensation.feedforward": True,
    },
    "all": {
        **ADAPTIVE,
        "compensation.look_ahead": True,
        "compensation.supply_correction": True,
        "protection.enabled": True,
        "protection.force_trip": 8700.0,
        "protection.start_time": 0.5,
    },
}


@pytest.mark.parametrize("dtype", ["f32", "f64"])
@pytest.mark.parametrize("case", CASES)
def test_the_controller_gives_the_simulated_ones_bits(case, dtype):
    rig = DIGITAL.replace(CASES[case])
    run = eft.simulate(rig, SWEEP, dtype)
    controller = eft.Controller(rig, dtype)
    commands = controller.process(
        run.command,
        run.measured_velocity,
        run.measured_force,
        run.measured_spool,
        run.measured_supply_pressure,
        displacement=run.measured_displacement,
    )
    np.testing.assert_array_equal(commands, run.valve_command)
    assert controller.flow_gain_estimate == run.flow_gain_estimate[-1]
    assert controller.response_delay_estimate == run.response_delay_estimate[-1]
    assert controller.valve_gain_estimate == run.valve_gain_estimate[-1]
    assert (controller.valve_gain_estimate == 1.0) != rig["compensation.adaptive"]
    assert controller.level == run.level[-1]
    beyond = eft.Status.SPOOL_STOP | eft.Status.STROKE_EXCEEDED
    assert eft.Status(controller.status) == run.flags & ~beyond
    assert eft.Cause(controller.cause) is run.cause
    if case == "protection":
        assert run.flags & eft.Status.TRIPPED
        assert controller.permitted_command == 0.0


@pytest.mark.parametrize("dtype", ["f32", "f64"])
@pytest.mark.parametrize("case", ["adaptive", "looking ahead", "guard alone", "supply"])
def test_the_compensator_gives_the_simulated_ones_bits(case, dtype):
    rig = DIGITAL.replace(CASES[case])
    run = eft.simulate(rig, SWEEP, dtype)
    signal = eft.Compensator(rig, dtype).process(
        run.measured_velocity,
        run.measured_force,
        run.measured_spool,
        run.command,
        run.measured_supply_pressure,
        # The valve command at the time when the other signals were sampled.
        valve_command=np.concatenate([[0.0], run.valve_command[:-1]]),
    )
    np.testing.assert_array_equal(signal, run.compensation)


@pytest.mark.parametrize("dtype", ["f32", "f64"])
@pytest.mark.parametrize("scheme", ["nonlinear", "linear"])
def test_a_stream_finds_the_simulated_ones_curve(scheme, dtype):
    curve = {"compensation.curve_correction": True, "compensation.mode": scheme}
    rig = DIGITAL.replace({**ADAPTIVE, **curve})
    run = eft.simulate(rig, SWEEP, dtype)
    signals = (run.measured_velocity, run.measured_force, run.measured_spool)
    controller, compensator = eft.Controller(rig, dtype), eft.Compensator(rig, dtype)
    controller.process(run.command, *signals)
    valve_command = np.concatenate([[0.0], run.valve_command[:-1]])
    compensator.process(*signals, run.command, valve_command=valve_command)
    table = np.array(rig["servovalve.flow_table.flows"])
    assert not np.allclose(run.found_flows, table, rtol=0.01)
    np.testing.assert_array_equal(controller.found_flows, run.found_flows)
    np.testing.assert_array_equal(compensator.found_flows, run.found_flows)
    for kind in (eft.Controller, eft.Compensator):
        np.testing.assert_array_equal(kind(DIGITAL, dtype).found_flows, table)


def test_a_loop_closed_in_python_is_the_simulation():
    rig = DIGITAL.replace({key: value for key, value in ADAPTIVE.items() if key not in NOISY})
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 3.0, RATE)
    run = eft.simulate(rig, command)
    plant, controller = eft.Plant(rig), eft.Controller(rig)
    force = np.empty(len(command))
    for i, wanted in enumerate(command.values):
        now = plant.state
        force[i] = now.force
        plant.step(controller.step(wanted, now.velocity, now.force, now.spool))
    # The plant is stepped by another method of the same order: both are within 1e-4 of the converged answer.
    np.testing.assert_allclose(force, run.force, atol=2e-4 * np.abs(run.force).max())
    assert controller.flow_gain_estimate == pytest.approx(run.flow_gain_estimate[-1], rel=1e-4)


def test_the_analog_loop_takes_its_valve_command_as_a_measurement():
    compensator = eft.Compensator(eft.Rig.zhao2005().replace(ADAPTIVE))
    with pytest.raises(ValueError, match=r"^valve_command = None: must be given: `compensation.adaptive`"):
        compensator.step(0.1, 0.0, 0.1, 0.0)
    assert np.isfinite(compensator.step(0.1, 0.0, 0.1, 0.0, valve_command=1.0))
    before = compensator.hold()
    # Only the estimators use it: they stop, and the compensation continues.
    assert compensator.step(0.2, 0.0, 0.1, 0.0, valve_command=np.nan) > before
    assert not eft.Status(compensator.status) & eft.Status.INVALID_MEASUREMENT
    for _ in range(64):
        compensator.step(0.2, 0.0, 0.1, 0.0, valve_command=np.nan)
    assert eft.Status(compensator.status) & eft.Status.ADAPTATION_FROZEN


def test_signals_that_a_rig_uses_must_be_given():
    supply = DIGITAL.replace({"compensation.supply_correction": True})
    with pytest.raises(ValueError, match=r"^supply_pressure = None: must be given"):
        eft.Controller(supply).step(0.0, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"^supply_pressure = None: must be given"):
        eft.Compensator(supply).process([0.0], [0.0], [0.0])
    ahead = DIGITAL.replace({"compensation.feedforward": True, "compensation.look_ahead": True})
    with pytest.raises(ValueError, match=r"^next_command = None: must be given: `compensation.look_ahead`"):
        eft.Controller(ahead).step(0.0, 0.0, 0.0, 0.0)
    limited = DIGITAL.replace({"protection.enabled": True, "protection.displacement_trip": 0.1})
    with pytest.raises(ValueError, match=r"^displacement = None: must be given"):
        eft.Controller(limited).step(0.0, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"^command = None: must be given: `compensation.guard` is on"):
        eft.Compensator(DIGITAL.replace({"compensation.guard": True})).process([0.0], [0.0], [0.0])
    for key in ("compensation.guard", "compensation.feedforward", "protection.enabled"):
        with pytest.raises(ValueError, match=rf"^command = None: must be given: `{key}` is on"):
            eft.Compensator(DIGITAL.replace({key: True})).step(0.0, 0.0, 0.0)
    # If nothing uses it, it may be omitted.
    assert eft.Compensator(DIGITAL).step(0.1, 0.0, 0.0) == eft.Compensator(DIGITAL).step(0.1, 0.0, 0.0, 1e3)


def test_a_measured_supply_scales_the_flow_by_its_root():
    rig = DIGITAL.replace({"compensation.supply_correction": True, "compensation.mode": "nonlinear"})
    v, share = 0.05, 0.81
    signals = []
    for pressure in (1.9e7, share * 1.9e7):
        compensator = eft.Compensator(rig)
        compensator.prime(v, 0.0, 0.1, supply_pressure=pressure)
        signals.append(compensator.step(v, 0.0, 0.1, supply_pressure=pressure))
    # Within the table's first segment the opening is proportional to the demanded flow.
    assert signals[1] / signals[0] == pytest.approx(1 / np.sqrt(share), rel=1e-12)
    plain = eft.Compensator(DIGITAL)
    assert plain.step(v, 0.0, 0.1, supply_pressure=1.0) == eft.Compensator(DIGITAL).step(v, 0.0, 0.1)


@pytest.mark.parametrize("case", CASES)
def test_hold_prime_and_reset(case):
    rig = DIGITAL.replace(CASES[case] | {"protection.enabled": False})
    v, f, x, r, p = 0.2, 8e3, 0.3, 9e3, 1.8e7
    controller = eft.Controller(rig)
    controller.prime(r, v, f, x, p)
    held = controller.hold()
    assert eft.Status(controller.status) == eft.Status.HELD
    assert held != 0.0
    assert controller.step(r, v, f, x, p, next_command=r) == held
    compensator = eft.Compensator(rig)
    compensator.prime(v, f, x, r, p)
    held = compensator.hold()
    assert compensator.step(v, f, x, r, p, valve_command=0.0, next_command=r) == held
    fresh = eft.Controller(rig)
    controller.reset()
    for i in range(50):
        sample = (1e3 * np.sin(0.1 * i), 0.1 * np.sin(0.1 * i), 0.0, 0.1, p)
        assert controller.step(*sample, next_command=50.0) == fresh.step(*sample, next_command=50.0)


def test_prime_keeps_the_calibration():
    rig = DIGITAL.replace(ADAPTIVE | {"servovalve.flow_gain_scale": 1.05, "protection.enabled": False})
    controller, plant = eft.Controller(rig), eft.Plant(rig)
    for i in range(round(2 * RATE)):
        now, wanted = plant.state, 5e3 * np.sin(10.0 * i / RATE)
        signals = (wanted, now.velocity, now.force, now.spool)
        plant.step(controller.step(*signals, next_command=wanted))
    learned = controller.flow_gain_estimate
    assert learned == pytest.approx(1.05, abs=0.01)
    controller.prime(*signals)
    controller.step(*signals, next_command=wanted)
    assert controller.flow_gain_estimate == pytest.approx(learned, abs=1e-4)


def test_a_controller_at_rest_can_be_sent_elsewhere():
    for kind in (eft.Compensator, eft.Controller):
        original = kind(DIGITAL.replace(ADAPTIVE), "f32", sample_rate=2048.0)
        for other in (pickle.loads(pickle.dumps(original)), copy.deepcopy(original)):
            assert type(other) is kind
            extra = {} if kind is eft.Controller else {"valve_command": 0.2}
            twin = kind(DIGITAL.replace(ADAPTIVE), "f32", sample_rate=2048.0)
            assert other.step(1.0, 0.1, 0.2, 0.1, **extra) == twin.step(1.0, 0.1, 0.2, 0.1, **extra)
        with pytest.raises(ValueError, match=r"^state = in the middle of a test: must be at rest"):
            pickle.dumps(other)
