"""Shear buildings: an actuator on every floor, arrays with a leading axis; the principle of the method."""

import pickle

import numpy as np
import pytest
from scipy import signal
from scipy.linalg import expm

import eft
from eft import plots
from eft._verdict import judge

RATE = 2048.0
MASSES = [7040.0, 6000.0, 5200.0, 5000.0, 4000.0]
DAMPINGS = [5200.0, 5000.0, 4600.0, 4300.0, 4000.0]
STIFFNESSES = [2.6e6, 2.4e6, 2.2e6, 1.9e6, 1.6e6]


def building(stories, **changes):
    return eft.Rig.zhao2005().replace(
        {
            "structure.kind": "shear_building",
            "structure.stories.masses": MASSES[:stories],
            "structure.stories.dampings": DAMPINGS[:stories],
            "structure.stories.stiffnesses": STIFFNESSES[:stories],
            **changes,
        }
    )


def matrices(stories):
    """Mass, damping and stiffness matrices, assembled here story by story."""
    m, c, k = np.diag(MASSES[:stories]), np.zeros((stories,) * 2), np.zeros((stories,) * 2)
    for i in range(stories):
        for matrix, value in ((c, DAMPINGS[i]), (k, STIFFNESSES[i])):
            matrix[i, i] += value
            if i:
                matrix[i - 1, i - 1] += value
                matrix[i, i - 1] -= value
                matrix[i - 1, i] -= value
    return m, c, k


def record(dt=1 / 128, seconds=8.0):
    """A ground motion with everything from 0.3 to 8 Hz in it; its points are samples of the command."""
    rng = np.random.default_rng(5)
    time = np.arange(round(seconds / dt)) * dt
    envelope = np.sin(np.pi * time / seconds) ** 2
    tones = rng.uniform(0.3, 8.0, 40)
    motion = sum(np.cos(2 * np.pi * f * time + p) for f, p in zip(tones, rng.uniform(0, 6, 40), strict=True))
    return eft.Record(0.2 * envelope * motion, dt, "made up")


def command_of(rig, ground, scale=1.0):
    return eft.effective_force(ground, mass=rig["structure.stories.masses"], sample_rate=RATE, scale=scale)


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


@pytest.fixture(scope="module")
def run():
    rig = building(3, **{"sensors.velocity.noise": 1e-4})
    return eft.simulate(rig, command_of(rig, record(seconds=4.0)))


def test_every_array_has_a_row_for_each_actuator(run):
    for name in ("command", "force", "displacement", "measured_velocity", "supply_pressure", "status"):
        assert getattr(run, name).shape == (3, len(run)), name
    assert run.time.shape == (len(run),)
    time, force = run
    assert time is run.time and force is run.force
    assert not np.array_equal(
        run.measured_velocity[0] - run.velocity[0], run.measured_velocity[1] - run.velocity[1]
    )
    assert run.success and run.message.startswith("completed")


def test_metrics_and_ratios_are_those_of_each_actuator(run):
    metrics, ratio = run.metrics(), run.fft_ratio(1.0, 5.0)
    assert ratio.ratio.shape == (3, ratio.frequency.size)
    for i in range(3):
        one = run.actuator(i)
        assert one.command.shape == (len(run),)
        alone = one.metrics()
        assert metrics.keys() == alone.keys()
        for name, value in alone.items():
            assert metrics[name][i] == value, name
        expected = one.fft_ratio(1.0, 5.0)
        at = np.isin(expected.frequency, ratio.frequency)
        np.testing.assert_array_equal(ratio.ratio[i], expected.ratio[at])
    with pytest.raises(IndexError, match="actuator = 3: must be from 0 to 2"):
        run.actuator(3)
    # A run of one actuator has itself.
    single = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2e3, 0.0, 5.0, 1.0, RATE))
    assert single.actuator(0) is single


def test_a_building_s_run_goes_where_others_go(run, tmp_path):
    path = run.save(tmp_path / "building.eft")
    for back in (eft.TestRun.load(path), pickle.loads(pickle.dumps(run))):
        np.testing.assert_array_equal(back.force, run.force)
        np.testing.assert_array_equal(back.status, run.status)
        assert back.rig == run.rig
    frame = run.to_pandas()
    np.testing.assert_array_equal(frame["force"][2], run.force[1])
    assert frame.columns.names == ["signal", "actuator"]
    control = pytest.importorskip("control")
    response = run.to_control()
    assert isinstance(response, control.TimeResponseData)
    np.testing.assert_array_equal(response.outputs, run.force)
    np.testing.assert_array_equal(response.inputs, run.command)
    assert response.output_labels == ["force_1", "force_2", "force_3"]


def test_figures_and_reports_show_every_actuator(run, tmp_path):
    from eft import report

    ax = plots.force_history(run)
    labels = ax.get_legend_handles_labels()[1]
    assert labels == ["commands", "actuator 1", "actuator 2", "actuator 3"]
    assert len(ax.get_lines()) == 6
    assert len(plots.spool_history(run).get_lines()) >= 3
    ideal = eft.ideal_response(run.rig, eft.Command(run.command, RATE))
    shown = plots.displacement_history(run, ideal=ideal)
    assert shown.get_legend_handles_labels()[1] == ["ideal", "actuator 1", "actuator 2", "actuator 3"]
    np.testing.assert_array_equal(shown.get_lines()[2].get_ydata(), ideal.displacement[2] * 1e3)
    assert len(plots.force_ratio(run).get_lines()) >= 3
    text = report.write_report(run, tmp_path / "building.html").read_text(encoding="utf-8")
    assert "actuator 3" in text
    with pytest.raises(ValueError, match=r"structure\.kind"):
        plots.hysteresis(run.actuator(0))


def test_a_floor_that_is_not_pushed_has_no_error_and_the_others_theirs():
    rig = building(2)
    tone = eft.sine_sweep(2e3, 0.5, 5.0, 4.0, RATE).values
    run = eft.simulate(rig, eft.Command([0.0 * tone, tone], RATE))
    metrics = run.metrics()
    assert np.isnan(metrics["nrmse"][0]) and metrics["nrmse"][1] == run.actuator(1).metrics()["nrmse"]
    assert (metrics["max_spool"] > 0.0).all()
    for answer in (run.fft_ratio(1.0, 4.0).ratio, run.coherence(1.0).coherence):
        assert np.isnan(answer[0]).all() and np.isfinite(answer[1]).all()
    assert judge(run).usable
    still = eft.simulate(rig, eft.Command([0.0 * tone, 0.0 * tone], RATE))
    with pytest.raises(ValueError, match="zero at every sample of every actuator"):
        still.metrics()


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
        (lambda: eft.free_vibration(building(2), 0.01), "structure.kind"),
    ],
)
def test_what_does_not_fit_is_named(call, says):
    with pytest.raises(ValueError, match=says):
        call()


def test_a_trip_on_one_floor_lets_all_floors_down():
    """The roof moves too far; a floor let down alone would be pulled along by the others."""
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
    # Only the roof is pushed: it alone goes beyond its level at first.
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
    # The command is gone when the ramp is over; what is left is the error of compensation and loop.
    after = time > time[first.max()] + ramp + 0.1
    assert np.abs(run.force[:, after]).max() < 0.01 * np.abs(values[2]).max()
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


def test_a_structure_of_one_s_own_takes_all_actuators():
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


def closed_loop(rig, stories, level):
    """All loops in one matrix, from the paper's equations: (q, x_v, P_L, x, v, lead) a floor."""
    r = rig.to_dict()
    valve, actuator, control, comp = r["servovalve"], r["actuator"], r["controller"], r["compensation"]
    area, tau, k_v, alpha = (
        actuator["piston_area"],
        valve["pilot_time_constant"],
        comp["flow_gain"],
        comp["lead_alpha"],
    )
    t_ld = comp["response_delay"] / (1 - alpha)
    m, c, k = matrices(stories)
    rows = np.eye(6 * stories).reshape(stories, 6, -1)
    x, v, pressures = rows[:, 3], rows[:, 4], rows[:, 2]
    accelerations = np.linalg.solve(m, area * pressures - c @ v - k @ x)
    answer = []
    for i in range(stories):
        pilot, spool, pressure, _, velocity, lead = rows[i]
        pressure_rate = (k_v * spool - actuator["leakage"] * pressure - area * velocity) / actuator[
            "compressibility"
        ]
        lead_rate = (level * area / k_v * velocity - lead) / (alpha * t_ld)
        v_c = (lead + t_ld * lead_rate) / (control["proportional_gain"] * comp["valve_gain"])
        command = control["proportional_gain"] * (v_c - control["force_sensitivity"] * area * pressure)
        command = command - control["derivative_gain"] * control["force_sensitivity"] * area * pressure_rate
        inner = command - valve["spool_sensitivity"] * valve["spool_stroke"] * spool
        answer += [
            (valve["pilot_flow_gain"] * inner - pilot) / tau,
            pilot / (valve["spool_area"] * valve["spool_stroke"]),
            pressure_rate,
            velocity,
            accelerations[i],
            lead_rate,
        ]
    return np.array(answer)


@pytest.mark.parametrize("stories", [1, 2, 3])
def test_poles_and_margin_of_a_building_are_those_of_numpy(stories):
    rig = building(stories)
    expected = np.linalg.eigvals(closed_loop(rig, stories, 1.0))
    found = eft.linearize(rig).poles()
    assert found.size == expected.size
    for pole in expected:
        assert abs(found - pole).min() < 1e-6 * abs(pole)
    low, high = 0.9, 1.2
    while high - low > 1e-10:
        level = (low + high) / 2
        stable = np.linalg.eigvals(closed_loop(rig, stories, level)).real.max() < 0
        low, high = (level, high) if stable else (low, level)
    assert eft.stability_margin(rig) == pytest.approx(low, rel=1e-6)


def test_the_sampled_model_of_a_building_predicts_its_small_motions():
    # A table that is straight through the origin, so that small signals see one slope.
    slope = 0.0166
    table = {"openings": [-1.0, 0.0, 1.0], "flows": [-slope, 0.0, slope]}
    rig = building(
        2,
        **{
            "servovalve.flow_table": table,
            "compensation.level": 0.95,
            "structure.stories.dampings": [6e4, 5e4],
            "controller.sample_rate": RATE,
        },
    )
    frequency, seconds = 3.0, 14.0
    time = np.arange(round(seconds * RATE)) / RATE
    run = eft.simulate(rig, eft.Command([np.sin(2 * np.pi * frequency * time), 0.0 * time], RATE))
    model = eft.linearize(rig, sampled=True, flow_gain="mean")
    assert model.inputs == ["command_1", "command_2"]
    last = time >= seconds - 4.0  # whole periods, after all else has died away
    wave = np.exp(-2j * np.pi * frequency * time[last])
    command = (run.command[0][last] * wave).sum()
    for name, trace in (("force", run.force), ("velocity", run.velocity), ("spool", run.spool)):
        for floor in range(2):
            expected = model.response([frequency], f"{name}_{floor + 1}", "command_1")[0]
            found = (trace[floor][last] * wave).sum() / command
            assert abs(found - expected) < 0.01 * abs(expected), (name, floor)
    control = pytest.importorskip("control")
    system = model.to_control()
    assert isinstance(system, control.StateSpace)
    assert (system.ninputs, system.noutputs) == (2, len(model.outputs))


def test_a_building_is_checked_before_its_test():
    rig = building(3, **{"controller.sample_rate": RATE})
    answer = eft.check_feasibility(rig, command_of(rig, record(), scale=0.5))
    assert answer["verdict"] in ("go", "caution")
    assert answer["scheme"] in ("linear", "nonlinear")
    demands = {demand["name"]: demand for demand in answer["demands"]}
    ideal = eft.ideal_response(rig, command_of(rig, record(), scale=0.5))
    assert demands["displacement"]["required"] == pytest.approx(np.abs(ideal.displacement).max())
    assert answer["margin"] == pytest.approx(eft.stability_margin(rig, sampled=True, flow_gain="steeper"))
    too_much = eft.check_feasibility(rig, command_of(rig, record(), scale=20.0))
    assert too_much["verdict"] == "no"
