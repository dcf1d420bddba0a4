"""The plant sample by sample, and an external structure."""

import copy
import math
import pickle
import threading

import numpy as np
import pytest

import eft

RATE = 4096.0
RIG = eft.Rig.zhao2005().replace({"controller.realization": "digital", "structure.kind": "linear"})


def test_a_controller_written_in_python_gives_the_simulated_test():
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 2.0, RATE)
    run = eft.simulate(RIG, command)
    plant, controller = eft.Plant(RIG, RATE), eft.Controller(RIG.replace({"controller.sample_rate": RATE}))
    force = []
    for wanted in command.values:
        now = plant.state
        force.append(now.force)
        plant.step(controller.step(wanted, now.velocity, now.force, now.spool))
    # Two integration methods, each within 1e-4 of the peak of the converged answer.
    np.testing.assert_allclose(force, run.force, atol=1e-4 * np.abs(run.force).max())
    plant.reset()
    assert plant.state.time == 0.0
    assert plant.state.force == 0.0


def test_a_structure_in_python_takes_the_place_of_the_rigs():
    values = RIG.to_dict()["structure"]
    mass, damping, stiffness = values["mass"], values["damping"], values["stiffness"]
    state = np.zeros(2)

    def structure(force, dt):
        # Exact for a constant force, by the state's series.
        system = np.array([[0.0, 1.0], [-stiffness / mass, -damping / mass]])
        step, total = np.array([0.0, force / mass]) + system @ state, np.zeros(2)
        factor = dt
        for n in range(2, 8):
            total = total + step * factor
            step, factor = system @ step, factor * dt / n
        state[:] = state + total
        return state[0], state[1]

    own, theirs = eft.Plant(RIG, RATE), eft.Plant(RIG, RATE, structure)
    worst = largest = 0.0
    for i in range(int(2 * RATE)):
        command = 0.1 * math.sin(2 * math.pi * 1.6 * i / RATE)
        truth, found = own.step(command), theirs.step(command)
        worst, largest = max(worst, abs(truth.force - found.force)), max(largest, abs(truth.force))
    assert worst < 2e-2 * largest


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match=r"^valve_command = NaN"):
        eft.Plant(RIG).step(float("nan"))
    with pytest.raises(ValueError, match=r"^sample_rate = -1"):
        eft.Plant(RIG, -1.0)
    with pytest.raises(ValueError, match=r"^structure = an object of type int: must be callable"):
        eft.Plant(RIG, RATE, 3)
    with pytest.raises(ValueError, match=r"^displacement = "):
        eft.Plant(RIG, RATE, lambda force, dt: (math.inf, 0.0)).step(0.1)


def test_a_plant_says_why_it_is_not_pickled():
    for carry in (pickle.dumps, copy.copy, copy.deepcopy):
        with pytest.raises(TypeError, match=r"eft\.Plant cannot be pickled or copied: make another one"):
            carry(eft.Plant(RIG))


def test_a_state_is_pickled_and_copied_whole():
    stories = {"masses": [7e3, 6e3], "dampings": [5e3, 4e3], "stiffnesses": [2.6e6, 2.3e6]}
    building = RIG.replace({"structure.kind": "shear_building", "structure.stories": stories})
    names = [name for name in dir(eft.PlantState) if not name.startswith("_")]
    assert len(names) == 9
    for rig, command in ((RIG, 3.0), (building, [3.0, -2.0])):
        state = eft.Plant(rig, RATE).step(command)
        for back in (pickle.loads(pickle.dumps(state)), copy.copy(state), copy.deepcopy(state)):
            assert repr(back) == repr(state)
            for name in names:
                told, kept = getattr(state, name), getattr(back, name)
                assert type(told) is type(kept)
                np.testing.assert_array_equal(told, kept)


def test_an_object_in_the_middle_of_a_call_refuses_another_one():
    plant = eft.Plant(RIG, RATE, lambda force, dt: (plant.state.displacement, 0.0))
    with pytest.raises(
        RuntimeError, match=r"^eft\.Plant is in the middle of another call: make one for each"
    ):
        plant.step(0.1)
    plant.reset()
    assert plant.state.time == 0.0


@pytest.mark.parametrize("kind", [eft.Controller, eft.Compensator])
def test_a_second_thread_is_refused(kind):
    channel, zeros, refused, ended = kind(RIG, sample_rate=RATE), np.zeros(200_000), [], threading.Event()

    def look():
        while not refused and not ended.is_set():
            try:
                assert channel.status == 0
            except RuntimeError as error:
                refused.append(str(error))

    other = threading.Thread(target=look)
    other.start()
    for _ in range(50):
        channel.process(command=zeros, velocity=zeros, force=zeros, spool=zeros)
        if refused:
            break
    ended.set()
    other.join()
    assert refused == [
        f"eft.{kind.__name__} is in the middle of another call: make one for each thread, and in a structure "
        "use what its own step was given"
    ]


def test_its_line_tells_rig_structure_and_sample_rate():
    rig = eft.Rig.zhao2005()
    assert repr(eft.Plant(rig)) == "<eft.Plant of zhao2005: bilinear structure, f64 at 4096 Hz>"
    own = eft.Plant(rig, 2048.0, structure=lambda force, dt: (0.0, 0.0))
    assert "external structure, f64 at 2048 Hz" in repr(own)
