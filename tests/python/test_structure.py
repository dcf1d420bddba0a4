"""External structures in whole tests: their results and their failures."""

import math
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

import eft

RATE = 2048.0
RIG = eft.Rig.zhao2005().replace({"structure.kind": "linear"})
SWEEP = eft.sine_sweep(8900.0, 0.0, 8.0, 2.0, RATE)


class Linear:
    """The rig's own structure, or that of each floor alone, under a force interpolated from its means."""

    def __init__(self, rig, stories=1):
        mass, damping, stiffness = (rig[f"structure.{name}"] for name in ("mass", "damping", "stiffness"))
        self.system = np.array([[0.0, 1.0], [-stiffness / mass, -damping / mass]])
        self.mass, self.state, self.last = mass, np.zeros((2, stories)), np.zeros(stories)

    def __call__(self, force, dt):
        mean = np.atleast_1d(force)
        # From the start of the sample to its end, by the state's series.
        slope = (mean - self.last) / dt
        drive = np.array([np.zeros_like(mean), (mean - 0.5 * slope * dt) / self.mass])
        rise = np.array([np.zeros_like(mean), slope / self.mass])
        self.last = mean
        term, total = self.system @ self.state + drive, self.state.copy()
        second = self.system @ term + rise
        total = total + term * dt + second * dt**2 / 2.0
        factor = dt**2 / 2.0
        for n in range(3, 9):
            second, factor = self.system @ second, factor * dt / n
            total = total + second * factor
        self.state = total
        x, v = total
        return (float(x[0]), float(v[0])) if np.ndim(force) == 0 else (x, v)


class FailsAt:
    """A structure that moves correctly until a time, and then calls another function."""

    def __init__(self, rig, time, then):
        self.inner, self.left, self.then = Linear(rig), time, then

    def __call__(self, force, dt):
        self.left -= dt
        return self.then() if self.left < 0.0 else self.inner(force, dt)


def failing(error):
    def fail():
        raise error

    return fail


@pytest.mark.parametrize("realization", ["analog", "digital"])
@pytest.mark.parametrize("dtype", ["f64", "f32"])
def test_the_own_structure_as_an_external_one_gives_the_same_test(realization, dtype):
    rig = RIG.replace({"controller.realization": realization})
    own = eft.simulate(rig, SWEEP, dtype, method="runge-kutta")
    found = eft.simulate(rig, SWEEP, dtype, structure=Linear(rig))
    for name in ("force", "displacement", "velocity", "spool", "valve_command"):
        wanted = getattr(own, name)
        np.testing.assert_allclose(getattr(found, name), wanted, atol=4e-3 * np.abs(wanted).max())
    assert found.verdict.grade == own.verdict.grade and not found.stopped
    assert np.isnan(found.metrics().displacement_error) and np.isfinite(own.metrics().displacement_error)


def test_twice_the_rate_leaves_a_quarter_of_the_error():
    errors = []
    for rate in (1024.0, 2048.0):
        command = eft.Command.sine(5000.0, 2.0, 2.0, rate)
        own = eft.simulate(RIG, command, converged=True)
        found = eft.simulate(
            RIG, command, structure=Linear(RIG), method="runge-kutta", largest_step=1 / 16384
        )
        errors.append(np.abs(found.displacement - own.displacement).max())
    assert errors[1] < errors[0] / 3.0


def test_a_building_has_arrays():
    stories = {"masses": [7040.0] * 3, "dampings": [4330.0] * 3, "stiffnesses": [693.8e3] * 3}
    rig = RIG.replace({"structure.kind": "shear_building", "structure.stories": stories})
    force = 500.0 * np.sin(2.0 * np.pi * 3.0 * np.arange(2048) / RATE)
    command = eft.Command([force, 2.0 * force, 3.0 * force], RATE)
    run = eft.simulate(rig, command, structure=Linear(RIG, 3))
    alone = eft.simulate(RIG, eft.Command(2.0 * force, RATE), structure=Linear(RIG))
    assert run.force.shape == (3, 2048)
    np.testing.assert_allclose(run.force[1], alone.force, atol=1e-6 * np.abs(alone.force).max())


@pytest.mark.parametrize(
    ("then", "says"),
    [
        (failing(eft.StructureError("the column broke")), "the column broke"),
        (lambda: (math.nan, 0.0), "displacement = NaN"),
        (lambda: (0.0, math.inf), "velocity = inf"),
    ],
)
def test_a_structure_that_cannot_go_on_ends_the_test(then, says, tmp_path):
    run = eft.simulate(RIG, SWEEP, structure=FailsAt(RIG, 1.5, then))
    assert len(run) == 3073
    assert run.stopped.startswith(says)
    assert run.flags & eft.Status.TRIPPED and run.cause is eft.Cause.REQUEST
    assert not run.verdict.ok and says in run.verdict.text
    assert np.isfinite(run.force).all() and np.abs(run.force).max() > 1e3
    back = eft.TestRun.load(run.save(tmp_path / "run.eft"))
    assert (back.stopped, back.verdict) == (run.stopped, run.verdict)


def test_a_structure_that_fails_at_once_leaves_one_sample():
    run = eft.simulate(RIG, SWEEP, structure=FailsAt(RIG, 0.0, failing(eft.StructureError("no model"))))
    assert len(run) == 1 and run.stopped == "no model" and not run.verdict.ok


@pytest.mark.parametrize("error", [ValueError("a slip"), KeyboardInterrupt()])
def test_another_exception_is_not_the_structures(error):
    with pytest.raises(type(error)):
        eft.simulate(RIG, SWEEP, structure=FailsAt(RIG, 0.5, failing(error)))


def test_a_structure_that_is_no_function_is_refused():
    with pytest.raises(ValueError, match=r"^structure = an object of type int: must be callable as"):
        eft.simulate(RIG, SWEEP, structure=3)


@pytest.mark.parametrize("answer", [None, 1.0, (1.0,), [0.0, 0.0], ("a", "b"), (0.0, 0.0, 0.0)])
def test_an_answer_that_is_none_is_refused(answer):
    says = r"^structure = an object of type \w+: must return \(displacement, velocity\), two numbers, in m"
    with pytest.raises(ValueError, match=says):
        eft.simulate(RIG, SWEEP, structure=lambda force, dt: answer)
    with pytest.raises(ValueError, match=says):
        eft.Plant(RIG, 1024.0, lambda force, dt: answer).step(0.1)


def weak(rig):
    """A structure for studies that fails if the rig is stiff."""
    stiff = rig["structure.stiffness"] > 7e5
    return FailsAt(rig, 0.5 if stiff else 99.0, failing(eft.StructureError("too stiff")))


def test_a_study_makes_a_structure_for_each_test():
    stiffness = {"structure.stiffness": [6e5, 8e5]}
    found = eft.study(RIG, SWEEP, stiffness, structure=weak, traces=True, progress=False)
    rows = [found.row(index) for index in range(2)]
    assert [row["status"] for row in rows] == ["completed", "tripped"]
    assert "too stiff" in str(rows[1])
    alone = eft.simulate(RIG.replace({"structure.stiffness": 6e5}), SWEEP, structure=weak(RIG))
    assert len(found.run(0)) == len(alone) == len(SWEEP)
    assert rows[0]["nrmse"] == pytest.approx(found.run(0).metrics().nrmse)


def test_a_structure_that_fails_at_once_has_a_row_that_says_so():
    (row,) = eft.study(
        RIG,
        SWEEP,
        [{"structure.mass": 7040.0}],
        structure=lambda rig: FailsAt(rig, 0.0, failing(eft.StructureError("no model"))),
        progress=False,
    )
    assert (row["status"], row["error"], row["samples"], row["nrmse"]) == ("tripped", "no model", 1, None)


def slipping(rig):
    """A maker for studies with a mistake that only some rigs meet."""
    if rig["structure.stiffness"] > 7e5:
        raise KeyError("storey")
    return Linear(rig)


def test_a_mistake_in_one_structure_does_not_affect_the_other_tests():
    stiffness = {"structure.stiffness": [8e5, 6e5]}
    found = [eft.study(RIG, SWEEP, stiffness, structure=slipping, progress=False)]
    with ThreadPoolExecutor(1) as pool:
        found.append(eft.study(RIG, SWEEP, stiffness, structure=slipping, executor=pool, progress=False))
    here, there = map(list, found)
    assert here == there
    assert [row["status"] for row in here] == ["failed", "completed"]
    assert here[0]["error"] == "KeyError: 'storey'"


def test_a_study_refuses_a_maker_that_is_no_function():
    with pytest.raises(ValueError, match=r"^structure = 3: must be callable as structure\(rig\)"):
        eft.study(RIG, SWEEP, {"structure.stiffness": [6e5]}, structure=3)


def test_a_process_pool_refuses_a_maker_that_it_cannot_import():
    says = r"^structure = <function .*lambda.*>: must be a function of a module, which the processes can"
    with ProcessPoolExecutor(1) as pool, pytest.raises(ValueError, match=says):
        eft.study(RIG, SWEEP, {"structure.stiffness": [6e5]}, structure=lambda rig: weak(rig), executor=pool)
