"""Velocity for rigs that measure only displacement, with 16 bits and noise of 0.05 % of ±127 mm on it."""

import numpy as np
import pytest

import eft

RATE = 4096.0
SWEEP = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, RATE)
# The accelerometer: ±2 g.
RANGES = {"force": 156e3, "displacement": 0.127, "spool": 1.0, "velocity": 1.05, "acceleration": 19.6}
NOISE = {
    f"sensors.{sensor}.{key}": value
    for sensor, size in RANGES.items()
    for key, value in {"noise": 5e-4 * size, "range": size, "bits": 16}.items()
}
SOURCES = {
    "sensor": {},
    "derivative": {"controller.velocity_source": "derivative"},
    "observer": {
        "controller.velocity_source": "observer",
        "controller.observer_mass": 7040.0,
        "controller.observer_drift": 200.0,
    },
    "accelerometer": {"controller.velocity_source": "accelerometer"},
}
ADAPTIVE = {"compensation.feedforward": True, "compensation.adaptive": True}


def swept(source, changes=NOISE):
    rig = eft.Rig.zhao2005().replace({**ADAPTIVE, **changes, **SOURCES[source]})
    run = eft.simulate(rig, SWEEP)
    # The estimate against the true velocity, its known delay ago.
    late = round(eft.linear.delay_budget(rig).sensor * RATE)
    missed = run.measured_velocity[late:] - run.velocity[: len(run) - late]
    ratio = run.fft_ratio(0.5, 9.5).ratio
    return np.sqrt(np.mean(missed**2)), ratio.min(), ratio.max(), run


def test_the_observer_follows_through_noise_that_drowns_the_derivative():
    errors = {}
    for source in SOURCES:
        errors[source], lowest, highest, run = swept(source)
        if source != "derivative":
            assert lowest > 0.95
            assert highest < 1.05
    assert errors["sensor"] < errors["observer"] < 0.6 * errors["derivative"]
    # Below a few hertz it has the displacement's noise. Above, it integrates the accelerometer's noise.
    assert errors["accelerometer"] < 0.5 * errors["sensor"]
    assert run.metrics()["nrmse"] < 0.02


@pytest.mark.parametrize("source", ["derivative", "observer", "accelerometer"])
def test_without_noise_either_follows(source):
    # At 80 Hz the lead network leaves a small part of the derivative's delay, which is amplified forty times.
    error, lowest, highest, _ = swept(source, {"controller.velocity_corner": 400.0})
    assert error < 4e-3
    assert lowest > 0.95
    assert highest < 1.05


def test_the_observer_needs_no_model_of_the_structure():
    for changes in (
        {"structure.damping": 27955.0},
        {"structure.kind": "linear", "structure.stiffness": 693.8e3 / 2},
        {"structure.mass": 6400.0},
    ):
        _, lowest, highest, _ = swept("observer", NOISE | changes)
        assert lowest > 0.95, changes
        assert highest < 1.05, changes


def test_its_delay_enters_the_budget():
    derivative, observer = (
        eft.linear.delay_budget(eft.Rig.zhao2005().replace(SOURCES[source]))
        for source in ("derivative", "observer")
    )
    assert derivative.sensor == pytest.approx(2 / (2 * np.pi * 80), rel=0.05)
    assert observer.sensor < 0.1 * derivative.sensor
    assert derivative.path - observer.path == pytest.approx(derivative.sensor - observer.sensor)


@pytest.mark.parametrize("dtype", ["f32", "f64"])
@pytest.mark.parametrize("source", ["derivative", "observer", "accelerometer"])
def test_the_controller_gives_the_simulated_ones_bits(source, dtype):
    rig = eft.Rig.zhao2005().replace(
        {**ADAPTIVE, **NOISE, **SOURCES[source], "controller.realization": "digital"}
    )
    run = eft.simulate(rig, eft.sine_sweep(8900.0, 0.0, 10.0, 3.0, RATE), dtype)
    controller = eft.Controller(rig, dtype)
    signals = (run.measured_force, run.measured_spool)
    # The velocity of the input is not used.
    nothing = np.zeros(len(run))
    measured = {"displacement": run.measured_displacement, "acceleration": run.measured_acceleration}
    commands = controller.process(run.command, nothing, *signals, **measured)
    np.testing.assert_array_equal(commands, run.valve_command)
    with pytest.raises(
        ValueError, match=r"^displacement = None: must be given: `controller.velocity_source`"
    ):
        eft.Controller(rig).step(0.0, 0.0, 0.0, 0.0)
    if source == "accelerometer":
        with pytest.raises(
            ValueError, match=r"^acceleration = None: must be given: `controller.velocity_source`"
        ):
            eft.Controller(rig).step(0.0, 0.0, 0.0, 0.0, displacement=0.0)


def test_an_observer_needs_its_mass():
    with pytest.raises(ValueError, match="observer_mass"):
        eft.Rig.zhao2005().replace({"controller.velocity_source": "observer"})


@pytest.mark.parametrize("kind", [eft.Controller, eft.Compensator])
@pytest.mark.parametrize("source", ["derivative", "observer", "accelerometer"])
def test_primed_at_a_displacement_the_next_steps_have_no_bump(source, kind):
    rig = eft.Rig.zhao2005().replace({**SOURCES[source], "controller.realization": "digital"})
    given = {"displacement": 0.03, "acceleration": 0.0}
    signals = {"command": 20814.0, "force": 20814.0, "spool": 0.0}
    core = kind(rig)
    core.prime(**signals, **given)
    held = core.hold()
    stepped = [core.step(velocity=0.0, **signals, **given) for _ in range(100)]
    # One volt is a tenth of the opening; without the displacement it was 84 V.
    np.testing.assert_allclose(stepped, held, atol=1e-6)
    for left_out in ("displacement", "acceleration")[: 2 if source == "accelerometer" else 1]:
        rest = {name: value for name, value in given.items() if name != left_out}
        with pytest.raises(ValueError, match=rf"^{left_out} = None: must be given: `controller.velocity_s"):
            kind(rig).prime(**signals, **rest)
    for moving in (0.1, np.nan):
        with pytest.raises(ValueError, match=r"^velocity = (0\.1|NaN): must be 0: by `controller.velocity_s"):
            kind(rig).prime(velocity=moving, **signals, **given)


def test_a_lead_of_the_observer_stands_in_the_budget_with_its_sign():
    # Half the mass doubles the acceleration that follows from the force.
    light = {**SOURCES["observer"], "controller.observer_mass": 3500.0, "compensation.mode": "off"}
    rig = eft.Rig.zhao2005().replace(light)
    budget = eft.linear.delay_budget(rig)
    assert budget.sensor < -1e-3
    assert budget.path == pytest.approx(
        sum(getattr(budget, p) for p in ("valve", "hold", "computation", "sensor"))
    )
    run = eft.simulate(rig, SWEEP)
    measured = eft.identify_delay(run.velocity, run.measured_velocity, RATE)
    assert float(measured) < -1e-3
