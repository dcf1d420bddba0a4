"""Shear buildings with an actuator on every floor: effective forces, protection, plant, energy."""

import pickle

import numpy as np
import pytest
from scipy import signal
from scipy.linalg import expm

import eft
from buildings import RATE, building, command_of, matrices, record


@pytest.mark.parametrize("stories", [1, 3, 5])
def test_effective_forces_are_ground_motion_in_the_moving_frame(stories):
    """The structure is moved by its base, in absolute coordinates, by SciPy; the rig pushes it at rest."""
    ground = record()
    rig = building(stories)
    command = command_of(rig, ground)
    assert command.values.shape == (stories, len(command))
    ideal = eft.ideal_response(rig, command)
    assert ideal.displacement.shape == ideal.velocity.shape == command.values.shape

    # State: absolute displacements and velocities of the floors, then the base's, moved by its acceleration.
    m, c, k = matrices(stories)
    system = np.zeros((2 * stories + 2,) * 2)
    floors, rates, base = slice(0, stories), slice(stories, 2 * stories), 2 * stories
    system[floors, rates] = np.eye(stories)
    system[rates, floors], system[rates, rates] = -np.linalg.solve(m, k), -np.linalg.solve(m, c)
    system[rates, base] = -system[rates, floors].sum(axis=1)
    system[rates, base + 1] = -system[rates, rates].sum(axis=1)
    system[base, base + 1] = 1.0
    drive = np.eye(2 * stories + 2)[:, -1:]
    # Exact for an acceleration that is straight between the points.
    shaking = np.interp(command.time, ground.time, ground.acceleration)
    everything = signal.StateSpace(system, drive, np.eye(2 * stories + 2), np.zeros_like(drive))
    _, answer, _ = signal.lsim(everything, shaking, command.time)
    relative = (answer[:, floors] - answer[:, [base]]).T
    assert np.abs(relative).max() > 2e-3
    np.testing.assert_allclose(ideal.displacement, relative, atol=1e-7 * np.abs(relative).max())
    velocities = (answer[:, rates] - answer[:, [base + 1]]).T
    np.testing.assert_allclose(ideal.velocity, velocities, atol=1e-7 * np.abs(velocities).max())


def test_compensated_actuators_move_the_building_as_the_ground_would():
    rig = building(3, **{"compensation.feedforward": True, "controller.sample_rate": RATE})
    command = command_of(rig, record())
    ideal = eft.ideal_response(rig, command)

    def error(run):
        return np.linalg.norm(run.displacement - ideal.displacement) / np.linalg.norm(ideal.displacement)

    with_it = error(eft.simulate(rig, command))
    without = error(eft.simulate(rig.replace({"compensation.mode": "off"}), command))
    assert with_it < 0.15
    assert without > 0.5


def test_commands_of_several_actuators():
    values = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, -6.0]])
    command = eft.Command(values, 10.0)
    np.testing.assert_array_equal(command.values, values)
    assert not command.values.flags.writeable
    assert (len(command), command.duration, command.time.shape) == (3, 0.3, (3,))
    assert pickle.loads(pickle.dumps(command)) == command
    assert command != eft.Command(values[0], 10.0)
    assert "2 actuators" in repr(command) and "peak 6.000000 N" in repr(command)
    one = eft.effective_force(record(), mass=[2.0], sample_rate=100.0)
    assert one.values.shape[0] == 1
    np.testing.assert_array_equal(
        one.values[0], eft.effective_force(record(), mass=2.0, sample_rate=100.0).values
    )


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: eft.Command(np.zeros((2, 2, 2)), 1.0), "values = an array of 3 dimensions"),
        (lambda: eft.Command(np.zeros((0, 5)), 1.0), "values = no actuators"),
        (lambda: eft.Command([[1.0, np.nan]], 1.0), "nan|NaN"),
        (lambda: eft.effective_force(record(), mass=[1.0, -1.0], sample_rate=1.0), "mass = -1"),
        (lambda: eft.effective_force(record(), mass=[[1.0]], sample_rate=1.0), "mass = an array of 2"),
        (
            lambda: eft.simulate(building(2), eft.sine_sweep(1.0, 0.0, 1.0, 1.0, RATE)),
            "command = one actuator: must have one row for each of 2 stories",
        ),
        (
            lambda: eft.simulate(building(2), eft.Command(np.zeros((3, 9)), RATE)),
            "commands = 3: must be one for each of 2 stories",
        ),
        (
            lambda: eft.simulate(eft.Rig.zhao2005(), eft.Command(np.zeros((2, 9)), RATE)),
            "command = 2 actuators: must be of one actuator",
        ),
        (lambda: eft.identification.free_vibration(building(2), 0.01), "structure.kind"),
    ],
)
def test_what_does_not_fit_is_named(call, says):
    with pytest.raises(ValueError, match=says):
        call()


def test_a_trip_on_one_floor_trips_all_floors():
    """The roof exceeds its level. All floors must trip, because the others would pull a single one along."""
    ramp = 0.4
    rig = building(
        3,
        **{
            "protection.enabled": True,
            "protection.displacement_trip": 4e-3,
            "protection.displacement_warning": 3e-3,
            "protection.ramp_time": ramp,
        },
    )
    # Only the roof is pushed, so it exceeds its level first.
    time = np.arange(round(4 * RATE)) / RATE
    values = np.zeros((3, time.size))
    values[:2] = 300.0 * np.sin(2 * np.pi * 1.0 * time)
    values[2] = 3000.0 * np.clip(time / 3.0, 0.0, 1.0) * np.sin(2 * np.pi * 1.0 * time)
    run = eft.simulate(rig, eft.Command(values, RATE))
    tripped = (run.status & eft.Status.TRIPPED) != 0
    first = tripped.argmax(axis=1)
    assert tripped.any(axis=1).all(), "all floors trip"
    over = np.abs(run.measured_displacement) > 4e-3
    cause = over.argmax(axis=1)[over.any(axis=1)].min()
    assert first.min() == cause
    assert first.max() == cause + 1, "the others follow at the next sample"
    assert not over[:2].any(), "no other floor had a reason of its own"
    alone = eft.simulate(rig.replace({"protection.enabled": False}), eft.Command(values, RATE))
    np.testing.assert_array_equal(run.force[:, :cause], alone.force[:, :cause])
    # The command is zero after the ramp. The remaining force is the error of compensation and loop, and
    # the damping of a tripped channel: 5 % of the velocity and the brake's 20 %, uncompensated, act as
    # c_add = A²/(C_l + loop).
    after = time > time[first.max()] + ramp + 0.1
    yields = 1.3e-11 + 5.6e-5 * 0.8059 * 0.1 * 1.64e-2 * 8.212e-3
    damping = (0.05 + 0.2) * 8.212e-3**2 / yields * np.abs(run.velocity[:, after]).max()
    assert np.abs(run.force[:, after]).max() < 0.01 * np.abs(values[2]).max() + damping
    assert np.abs(run.force[:, after]).max() > 0.5 * damping
    assert np.abs(alone.force[2, after]).max() > 0.5 * np.abs(values[2]).max()
    assert not run.flags & eft.Status.SHUT_DOWN


def test_the_plant_of_a_building_is_stepped_with_one_command_an_actuator():
    rig = building(2, **{"controller.realization": "digital"})
    time = np.arange(2048) / RATE
    tones = [[3e3], [2e3]] * np.sin(2 * np.pi * 1.5 * time)
    run = eft.simulate(rig, eft.Command(tones, RATE))
    plant = eft.Plant(rig, RATE)
    for i in range(time.size):
        state = plant.state
        np.testing.assert_array_equal(state.force, run.force[:, i])
        np.testing.assert_array_equal(state.velocity, run.velocity[:, i])
        plant.step(run.valve_command[:, i])
    assert state.status.tolist() == [0, 0]
    plant.reset()
    assert plant.state.time == 0.0 and not plant.state.force.any()
    with pytest.raises(ValueError, match="valve_command = 3 values: must be one for each of 2 stories"):
        plant.step([0.0, 0.0, 0.0])


def test_an_external_structure_takes_all_actuators():
    rig = building(2)
    m, c, k = matrices(2)
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(m, k), -np.linalg.solve(m, c)]])
    state, factors = np.zeros(4), []

    def structure(force, dt):
        if not factors:
            # Exact for forces held over the sample.
            whole = np.block([[system, np.vstack([np.zeros((2, 2)), np.linalg.inv(m)])], [np.zeros((2, 6))]])
            factors.append(expm(whole * dt))
        state[:] = (factors[0] @ np.concatenate([state, force]))[:4]
        return state[:2], state[2:]

    own, theirs = eft.Plant(rig, RATE), eft.Plant(rig, RATE, structure)
    worst = largest = 0.0
    for i in range(int(1.5 * RATE)):
        commands = [0.08 * np.sin(7.0 * i / RATE), 0.05 * np.sin(11.0 * i / RATE)]
        truth, found = own.step(commands), theirs.step(commands)
        worst = max(worst, np.abs(truth.force - found.force).max())
        largest = max(largest, np.abs(truth.force).max())
    assert worst < 2e-2 * largest


def test_energy_of_a_building_adds_up():
    rig = building(3, **{"servovalve.leakage.constant": 4e-5, "actuator.friction": 200.0})
    command = command_of(rig, record(seconds=3.0))
    coarse, fine = (eft.energy_balance(rig, command, largest_step=step) for step in (2**-11, 2**-13))
    assert abs(coarse.gap) < 1e-8
    assert abs(fine.gap) < abs(coarse.gap) / 4
    assert fine.friction > 0.0 and fine.damping > 0.0
