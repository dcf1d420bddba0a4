"""The core from Python: it has the bits of the simulation."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import eft

RIG = eft.Rig.zhao2005()
SWEEP = eft.sine_sweep(8900.0, 0.0, 10.0, 4.0, 4096.0)


def compensation_by_the_paper(velocity, force, spool, rig=RIG):
    """Fig. 5 and Eq. (8), written from the paper with NumPy, for the nonlinear scheme."""
    area, pressure = rig["actuator.piston_area"], rig["supply.pressure"]
    flows, openings = rig["servovalve.flow_table.flows"], rig["servovalve.flow_table.openings"]
    radicand = np.maximum(1 - np.sign(spool) * force / (area * pressure), 0.05)
    required = np.interp(area * velocity / np.sqrt(radicand), flows, openings) * rig["compensation.level"]
    required = np.clip(required, -1, 1)
    delay, alpha = rig["compensation.response_delay"], rig["compensation.lead_alpha"]
    lead, period = delay / (1 - alpha), 1 / rig["controller.sample_rate"]
    # Tustin: s → 2/T·(z − 1)/(z + 1).
    b0, b1 = 1 + 2 * lead / period, 1 - 2 * lead / period
    a0, a1 = 1 + 2 * alpha * lead / period, 1 - 2 * alpha * lead / period
    gain = 1 / (rig["controller.proportional_gain"] * rig["compensation.valve_gain"])
    output = np.empty_like(required)
    last_in = last_out = 0.0
    for i, x in enumerate(required):
        last_out = (b0 * x + b1 * last_in - a1 * last_out) / a0
        last_in = x
        output[i] = gain * last_out
    return output


def signals(count=2000):
    t = np.arange(count) / 4096.0
    return 0.4 * np.sin(9.0 * t), 20e3 * np.cos(7.0 * t), 0.5 * np.sin(9.0 * t + 0.3) + 1e-3


@pytest.mark.parametrize(("dtype", "tolerance"), [("f64", 1e-12), ("f32", 1e-5)])
def test_the_compensation_is_the_papers(dtype, tolerance):
    measured = signals()
    expected = compensation_by_the_paper(*measured)
    found = eft.Compensator(RIG, dtype).process(*measured)
    np.testing.assert_allclose(found, expected, atol=tolerance * np.abs(expected).max())


def test_one_sample_at_a_time_or_all_at_once_is_the_same():
    command = 5e3 * np.ones(300)
    velocity, force, spool = signals(300)
    for make, order in ((eft.Compensator, (1, 2, 3)), (eft.Controller, (0, 1, 2, 3))):
        columns = [(command, velocity, force, spool)[i] for i in order]
        one, all_ = make(RIG), make(RIG)
        stepped = [one.step(*sample) for sample in zip(*columns, strict=True)]
        np.testing.assert_array_equal(stepped, all_.process(*columns))


@pytest.mark.parametrize("feedforward", [False, True])
@pytest.mark.parametrize("dtype", ["f32", "f64"])
def test_the_controller_reproduces_the_simulated_one_bit_for_bit(dtype, feedforward):
    rig = RIG.replace(
        {
            "controller.realization": "digital",
            "limits.valve_command": 5.0,
            "compensation.feedforward": feedforward,
            "sensors.velocity.noise": 1e-3,
        }
    )
    run = eft.simulate(rig, SWEEP, dtype)
    controller = eft.Controller(rig, dtype, sample_rate=SWEEP.sample_rate)
    commands = controller.process(run.command, run.measured_velocity, run.measured_force, run.measured_spool)
    np.testing.assert_array_equal(commands, run.valve_command)
    compensator = eft.Compensator(rig, dtype)
    signal = compensator.process(
        run.measured_velocity, run.measured_force, run.measured_spool, run.command if feedforward else None
    )
    np.testing.assert_array_equal(signal, run.compensation)


def test_the_controller_knows_nothing_of_the_true_valve():
    true = {"servovalve.flow_gain_scale": 1.3, "servovalve.pilot_flow_gain": 2e-5, "structure.mass": 1e4}
    for make, extra in ((eft.Compensator, ()), (eft.Controller, (np.ones(2000),))):
        nominal, other = make(RIG), make(RIG.replace(true))
        np.testing.assert_array_equal(nominal.process(*extra, *signals()), other.process(*extra, *signals()))


def test_a_bad_sample_is_held_and_flagged_and_the_next_good_one_recovers():
    compensator, undisturbed = eft.Compensator(RIG), eft.Compensator(RIG)
    good = (0.1, 1e3, 0.2)
    for bad in (math.nan, math.inf, -math.inf):
        before = compensator.step(*good)
        assert before == undisturbed.step(*good)
        assert compensator.status == 0
        for place in range(3):
            sample = list(good)
            sample[place] = bad
            assert compensator.step(*sample) == before
            assert eft.Status(compensator.status) == eft.Status.INVALID_MEASUREMENT
    assert compensator.step(*good) == undisturbed.step(*good)
    controller = eft.Controller(RIG)
    before = controller.step(1e3, *good)
    assert controller.step(math.nan, *good) == before
    assert eft.Status(controller.status) == eft.Status.INVALID_COMMAND


def test_hold_prime_and_reset():
    velocity, force, spool = 0.2, 8e3, 0.3
    compensator = eft.Compensator(RIG)
    for _ in range(5000):
        settled = compensator.step(velocity, force, spool)
    assert compensator.hold() == settled
    assert eft.Status(compensator.status) == eft.Status.HELD
    primed = eft.Compensator(RIG)
    primed.prime(velocity, force, spool)
    assert primed.step(velocity, force, spool) == pytest.approx(settled, rel=1e-12)
    compensator.reset()
    assert compensator.status == 0
    fresh = eft.Compensator(RIG).process(*signals())
    np.testing.assert_array_equal(compensator.process(*signals()), fresh)
    for feedforward in (False, True):
        controller = eft.Controller(RIG.replace({"compensation.feedforward": feedforward}))
        controller.prime(9e3, velocity, force, spool)
        first = controller.hold()
        assert controller.step(9e3, velocity, force, spool) == first


def test_the_sample_rate_is_the_rigs_unless_given():
    measured = signals()
    faster = RIG.replace({"controller.sample_rate": 10000.0})
    np.testing.assert_array_equal(
        eft.Compensator(RIG, sample_rate=10000.0).process(*measured),
        eft.Compensator(faster).process(*measured),
    )
    with pytest.raises(ValueError, match=r"sample_rate = 0"):
        eft.Compensator(RIG, sample_rate=0.0)


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match=r'^dtype = "double": must be "f32" or "f64"$'):
        eft.Controller(RIG, "double")
    with pytest.raises(ValueError, match=r"^force = 2 samples: must have as many samples as velocity, 3$"):
        eft.Compensator(RIG).process([0.0] * 3, [0.0] * 2, [0.0] * 3)
    assert eft.Compensator(RIG).process([], [], []).shape == (0,)
    with pytest.raises(ValueError, match=r"^command = None: must be given"):
        eft.Compensator(RIG.replace({"compensation.feedforward": True})).process([0.0], [0.0], [0.0])


NUMBERS = st.floats(allow_nan=True, allow_infinity=True)


@given(st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS), max_size=20), st.sampled_from(["f32", "f64"]))
def test_whatever_is_measured_the_command_is_finite_and_limited(samples, dtype):
    controller = eft.Controller(RIG.replace({"limits.valve_command": 10.0}), dtype)
    for sample in samples:
        assert abs(controller.step(*sample)) <= 10.0


def test_a_computation_delay_is_behind_the_compensator_and_refused_by_the_controller():
    rig = RIG.replace({"controller.realization": "digital", "compensation.computation_delay": 3})
    run = eft.simulate(rig, SWEEP)
    signal = eft.Compensator(rig).process(run.velocity, run.force, run.spool)
    np.testing.assert_array_equal(signal[:-3], run.compensation[3:])
    with pytest.raises(
        ValueError, match=r"compensation\.computation_delay = 3: must be 0 for eft\.Controller"
    ):
        eft.Controller(rig)


@pytest.mark.parametrize("dtype", ["f64", "f32"])
def test_samples_that_stand_still_or_come_at_the_wrong_time_trip(dtype: str) -> None:
    rig = eft.Rig.zhao2005().replace({"protection.enabled": True})
    rest, rate = np.zeros(60), rig["controller.sample_rate"]
    for kind in (eft.Controller, eft.Compensator):
        sound = kind(rig, dtype)
        names = ("command", "velocity", "force", "spool")
        sound.process(**dict.fromkeys(names, rest), alive=np.arange(60) % 16, period=np.full(60, 1 / rate))
        assert (sound.cause, sound.status & eft.Status.MISSED_TICK) == (eft.Cause.NONE, 0)
        for sample, cause in (
            ({"alive": 3.0}, eft.Cause.SAMPLES_OLD),
            ({"period": 2 / rate}, eft.Cause.SAMPLE_PERIOD),
        ):
            controller = kind(rig, dtype)
            for _ in range(60):
                controller.step(**dict.fromkeys(names, 0.0), **sample)
            assert controller.cause == cause
            assert controller.status & eft.Status.MISSED_TICK


def test_without_the_valve_command_no_spool_is_doubted():
    """A protection of an analog loop must not take an unknown valve command as 0 V."""
    levels = {"protection.enabled": True, "protection.force_trip": 20e3, "limits.valve_command": 10.0}
    rig = RIG.replace({"controller.realization": "analog", **levels})
    run = eft.simulate(rig, eft.sine_sweep(3000.0, 1.5, 1.5, 2.0, 4096.0))
    compensator = eft.Compensator(rig)
    readings = run.measured_velocity, run.measured_force, run.measured_spool, run.command
    for *sample, command, displacement in zip(*readings, run.measured_displacement, strict=True):
        compensator.step(*sample, command=command, displacement=displacement)
    assert np.abs(run.measured_spool).max() > 0.05
    assert compensator.cause == eft.Cause.NONE


@pytest.mark.parametrize("kind", [eft.Controller, eft.Compensator])
def test_its_line_tells_rig_scheme_precision_and_sample_rate(kind):
    rig = eft.Rig.zhao2005()
    after = "zhao2005: nonlinear compensation, f64 at 4096 Hz>"
    assert repr(kind(rig)) == f"<eft.{kind.__name__} of {after}"
    learns = kind(rig.replace({"compensation.adaptive": True}), "f32", sample_rate=4096.0)
    assert repr(learns).endswith("self-calibrating nonlinear compensation, f32 at 4096 Hz>")
    unnamed = eft.Rig.from_dict({key: value for key, value in rig.to_dict().items() if key != "name"})
    assert repr(kind(unnamed)).startswith(f"<eft.{kind.__name__} of a rig without a name: ")
