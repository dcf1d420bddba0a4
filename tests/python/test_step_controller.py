"""A controller in Python in place of the rig's own, with the rig's sensors and converter."""

import numpy as np
import pytest

import eft

RATE = 4096.0
NOISY = {
    "sensors.force.noise": 20.0,
    "sensors.velocity.noise": 1e-3,
    "truth.dac.delay": 1,
    "sensors.force.bits": 16,
}
RIG = eft.Rig.zhao2005().replace(
    {"controller.realization": "digital", "sensors.force.range": 156e3, "compensation.look_ahead": True}
    | NOISY
)
SWEEP = eft.sine_sweep(8900.0, 0.0, 10.0, 2.0, RATE)


class Answers:
    """A controller with a constant output."""

    def __init__(self, answer):
        self.answer = answer

    def step(self, command, velocity, force, spool, **_):
        return self.answer


@pytest.mark.parametrize("changes", [{}, {"compensation.feedforward": True}, {"actuator.friction": 300.0}])
def test_the_core_as_an_external_controller_gives_the_simulated_test(changes):
    rig = RIG.replace(changes)
    own = eft.simulate(rig, SWEEP, "f32")
    outside = eft.simulate(rig, SWEEP, controller=eft.Controller(rig, "f32", sample_rate=RATE))
    for name in ("force", "displacement", "spool", "valve_command", "measured_force"):
        np.testing.assert_array_equal(getattr(outside, name), getattr(own, name))
    assert outside.dtype == "f32" and outside.metrics()["nrmse"] == own.metrics()["nrmse"]


def test_a_controller_has_what_the_sensors_report_and_the_next_command():
    seen = []

    class Looks:
        def step(self, command, velocity, force, spool, *, displacement, next_command, **others):
            seen.append((command, velocity, force, spool, displacement, next_command))
            assert set(others) == {"supply_pressure", "acceleration"}
            return 1e-5 * (command - force)

    run = eft.simulate(RIG, SWEEP, controller=Looks())
    reported = np.array(seen).T
    told = [
        run.command,
        run.measured_velocity,
        run.measured_force,
        run.measured_spool,
        run.measured_displacement,
    ]
    np.testing.assert_array_equal(reported[:5], np.float32(told))
    np.testing.assert_array_equal(reported[5, :-1], reported[0, 1:])


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (float("nan"), r"^controller\.step = NaN: must return a finite number of single precision, in V$"),
        (1e300, r"^controller\.step = 1e300: must return a finite number of single precision, in V$"),
        ([1.0, 2.0], r"^controller\.step = an object of type list: must return one number, in V$"),
        (np.zeros(3), r"^controller\.step = an object of type ndarray: must return one number, in V$"),
        ("1.0", r"^controller\.step = an object of type str: must return one number, in V$"),
        (None, r"^controller\.step = an object of type NoneType: must return one number, in V$"),
    ],
)
def test_an_answer_that_is_no_voltage_is_refused(answer, says):
    with pytest.raises(ValueError, match=says):
        eft.simulate(RIG, SWEEP, controller=Answers(answer))


class Few:
    def step(self, command, force):
        return 0.0


class Unnamed:
    def step(self, command, velocity, force, spool):
        return 0.0


@pytest.mark.parametrize(
    ("controller", "says"),
    [
        (lambda *_, **__: 0.0, r"^controller = an object of type function: must be an object with a method"),
        (0.3, r"^controller = an object of type float: must be an object with a method step"),
        (Answers, r"^controller = the class Answers: must be an object with a method step"),
        (Few(), r"^controller\.step = \(command, force\): must accept command, velocity, force, spool in"),
        (Unnamed(), r"^controller\.step = \(command, velocity, force, spool\): must .* by name supply"),
        # Its first value is the velocity.
        (eft.Compensator(RIG), r"^controller\.step = \(velocity, force, spool, .*: must accept command"),
    ],
)
def test_what_is_no_controller_is_refused_before_the_test(controller, says):
    with pytest.raises(ValueError, match=says):
        eft.simulate(RIG, SWEEP, controller=controller)


def test_a_building_has_no_external_controller():
    stories = {"masses": [7040.0, 6000.0], "dampings": [5200.0, 4800.0], "stiffnesses": [2.6e6, 2.3e6]}
    building = RIG.replace({"structure.kind": "shear_building", "structure.stories": stories})
    for values in (SWEEP.values, np.vstack([SWEEP.values] * 2)):
        with pytest.raises(ValueError, match=r'^structure\.kind = "shear_building": must be of one actuator'):
            eft.simulate(building, eft.Command(values, RATE), controller=Answers(0.0))


def test_an_exception_of_the_controller_ends_the_call():
    class Fails:
        def step(self, *_, **__):
            raise ZeroDivisionError("no gain")

    with pytest.raises(ZeroDivisionError, match="no gain"):
        eft.simulate(RIG, SWEEP, controller=Fails())
    with pytest.raises(ValueError, match=r"^watch = True"):
        eft.simulate(RIG, SWEEP, controller=Fails(), watch=True)


def test_its_verdict_says_nothing_of_the_rigs_own_controller(tmp_path):
    unstable = RIG.replace({"compensation.level": 1.2, "sensors.force.noise": 400.0})
    run = eft.simulate(unstable, SWEEP, controller=Answers(0.0))
    assert not run.verdict.ok and not run.verdict.remedies
    assert not any("unstable" in reason or "Noise" in reason for reason in run.verdict.reasons)
    back = eft.TestRun.load(run.save(tmp_path / "run.eft"))
    assert back.verdict == run.verdict
