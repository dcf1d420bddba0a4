"""Linear models compared with matrices from the equations in this file, with NumPy's eigenvalues."""

import copy
import pickle

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are

import eft

RIG = eft.Rig.zhao2005()


def matrix(rig, level=None, response_delay=None, slope=None):
    """The closed loop from the paper's equations: pilot flow, spool, load pressure, x, dx/dt, lead state."""
    r = rig.to_dict()
    valve, actuator, control, structure = r["servovalve"], r["actuator"], r["controller"], r["structure"]
    comp = r["compensation"]
    level = comp["level"] if level is None else level
    t_d = comp["response_delay"] if response_delay is None else response_delay
    k_v = comp["flow_gain"] if slope is None else slope
    area, tau = actuator["piston_area"], valve["pilot_time_constant"]
    alpha = comp["lead_alpha"]
    t_ld = t_d / (1 - alpha)
    pilot, spool, pressure, x, v, lead = np.eye(6)
    pressure_rate = (k_v * spool - actuator["leakage"] * pressure - area * v) / actuator["compressibility"]
    required = level * area / k_v * v
    lead_rate = (required - lead) / (alpha * t_ld)
    # (T_ld·s + 1)/(α·T_ld·s + 1): the lead's output is its lag plus T_ld times the lag's rate.
    v_c = (lead + t_ld * lead_rate) / (control["proportional_gain"] * comp["valve_gain"])
    force = area * pressure
    command = (
        -control["proportional_gain"] * control["force_sensitivity"] * force
        - control["derivative_gain"] * control["force_sensitivity"] * area * pressure_rate
        + control["proportional_gain"] * v_c
    )
    inner = command - valve["spool_sensitivity"] * valve["spool_stroke"] * spool
    return np.array(
        [
            (valve["pilot_flow_gain"] * inner - pilot) / tau,
            pilot / (valve["spool_area"] * valve["spool_stroke"]),
            pressure_rate,
            v,
            (force - structure["damping"] * v - structure["stiffness"] * x) / structure["mass"],
            lead_rate,
        ]
    )


def by_size(poles):
    return poles[np.lexsort((poles.imag, abs(poles).round(6)))]


def margin(build):
    low, high = 1.0, 1.2
    while high - low > 1e-12:
        middle = (low + high) / 2
        low, high = (middle, high) if np.linalg.eigvals(build(middle)).real.max() < 0 else (low, middle)
    return low


RIGS = {
    "paper": {},
    "damped": {"structure.damping": 20e3},
    "stiff": {"structure.stiffness": 5e6, "structure.mass": 2000.0},
    "other valve": {"servovalve.pilot_time_constant": 1e-3, "compensation.response_delay": 6e-3},
    "level": {"compensation.level": 0.9, "compensation.mode": "linear"},
}


@pytest.mark.parametrize("change", RIGS.values(), ids=RIGS)
def test_poles_are_those_of_numpy(change):
    rig = RIG.replace(change)
    expected = by_size(np.linalg.eigvals(matrix(rig)))
    np.testing.assert_allclose(by_size(eft.linearize(rig).poles()), expected, rtol=1e-6)


@pytest.mark.parametrize("change", RIGS.values(), ids=RIGS)
def test_margin_is_that_of_numpy(change):
    rig = RIG.replace(change)
    assert eft.stability_margin(rig) == pytest.approx(margin(lambda level: matrix(rig, level)), rel=1e-6)


def test_table_slopes_give_their_own_margin():
    table = RIG["servovalve.flow_table"]
    steeper = table["flows"][11] / table["openings"][11]
    expected = margin(lambda level: matrix(RIG, level, slope=steeper))
    assert eft.stability_margin(RIG, flow_gain="steeper") == pytest.approx(expected, rel=1e-6)
    assert eft.stability_margin(RIG, flow_gain="steeper") != pytest.approx(
        eft.stability_margin(RIG), rel=1e-5
    )


def test_numbers_of_the_reference_model():
    assert eft.stability_margin(RIG) == pytest.approx(1.0374, abs=5e-5)
    poles = eft.linearize(RIG).poles()
    assert min(abs(poles - (-0.2884 + 9.910j))) < 1e-3
    assert min(abs(poles - (-21.39 + 406.6j))) < 0.1
    for delay, real in ((3e-3, -17.2), (0.0, -12.2)):
        poles = eft.linearize(RIG.replace({"compensation.response_delay": delay})).poles()
        fast = poles[(abs(poles.imag) > 300)]
        assert fast.real == pytest.approx(real, abs=0.05)


def test_modes_tell_frequency_and_damping():
    found = eft.linearize(RIG).modes()
    frequency, damping, pole = found
    assert isinstance(found, eft.linear.Modes) and found.damping is damping
    np.testing.assert_allclose(frequency, abs(pole) / (2 * np.pi))
    np.testing.assert_allclose(damping, -pole.real / abs(pole))
    assert frequency[0] == pytest.approx(1.578, abs=1e-3)
    assert damping[0] == pytest.approx(0.0291, abs=1e-4)


def test_plant_of_the_sampled_model_is_scipys_exponential():
    # In the digital realization the valve command is held, so the plant's own block is exp(A/f).
    rate = 2000.0
    rig = RIG.replace({"controller.realization": "digital", "compensation.mode": "off"})
    open_loop = rig.replace({"controller.proportional_gain": 1e-6, "controller.derivative_gain": 0.0})
    sampled = eft.linearize(open_loop, sample_rate=rate)
    exact = expm(plant_alone(open_loop) / rate)
    scale = np.diag([1e4, 1.0, 1e-6, 10.0, 1.0])  # comparable units
    unscale = np.linalg.inv(scale)
    np.testing.assert_allclose(scale @ sampled.A[:5, :5] @ unscale, scale @ exact @ unscale, atol=2e-5)
    assert sampled.sample_time == 1 / rate


def plant_alone(rig):
    r = rig.to_dict()
    r["compensation"]["level"] = 0.0
    r["controller"]["proportional_gain"] = 1e-6
    return matrix(eft.Rig.from_dict(r))[:5, :5]


def test_sampled_poles_come_to_the_continuous_ones_with_the_rate():
    continuous = eft.linearize(RIG).modes()[2][:2]
    errors = [
        abs(eft.linearize(RIG, sample_rate=rate).modes()[2][:2] - continuous).max() for rate in (1e3, 1e4)
    ]
    assert errors[1] < 0.15 * errors[0] < 0.15


def test_python_control_gets_the_same_system():
    control = pytest.importorskip("control")
    model = eft.linearize(RIG)
    system = model.to_control()
    assert isinstance(system, control.StateSpace)
    assert (system.input_labels, system.output_labels) == (model.inputs, model.outputs)
    for frequency in (0.5, 1.58, 10.0):
        expected = system(2j * np.pi * frequency)
        for row, output in enumerate(model.outputs):
            assert model.response([frequency], output)[0] == pytest.approx(expected[row, 0], rel=1e-9)
    assert eft.linearize(RIG, sampled=True).to_control().dt == 1 / 4096


def test_margins_bracket_the_rig():
    margins = eft.linear.stability_margins(RIG, sampled=True)
    assert margins.growth_rate < 0
    assert margins.level == eft.stability_margin(RIG, sampled=True)
    low, high = margins.response_delay
    assert low < 5e-3 < high < 0.1
    assert margins.loop_gain > 1
    assert margins.flow_gain[1] == pytest.approx(margins.level, rel=0.01)
    assert 0 < margins.dead_time < 0.02
    assert eft.linear.stability_margins(RIG.replace({"compensation.level": 1.2})).dead_time is None


def test_delay_budget_adds_up():
    rig = RIG.replace({"compensation.computation_delay": 1, "sensors.velocity.bandwidth": 200.0})
    budget = eft.linear.delay_budget(rig, sample_rate=1000.0)
    parts = sum(getattr(budget, part) for part in ("valve", "hold", "computation", "sensor"))
    assert budget.path == pytest.approx(parts)
    assert budget.total == pytest.approx(parts + budget.derivative)
    assert (budget.hold, budget.computation) == (0.5e-3, 1e-3)
    assert budget.sensor == pytest.approx(1 / (2 * np.pi * 200), rel=2e-3)


def test_lead_and_valve_cancel_to_20_hz():
    valve, lead = eft.linear.inverse_dynamics(RIG, [0.0, 10.0, 20.0])
    both = valve * lead
    assert abs(both[1:] / both[0]) == pytest.approx([1.033, 1.107], abs=6e-4)
    assert np.degrees(np.angle(both[1:])) == pytest.approx([-1.27, -5.4], abs=0.05)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"flow_gain": "steep"}, 'flow_gain = "steep": must be "nominal"'),
        ({"sample_rate": 0.0}, "sample_rate = 0: must lie within"),
        ({"sample_rate": float("nan")}, "sample_rate = NaN"),
    ],
)
def test_bad_arguments_are_named(arguments, says):
    for function in (eft.linearize, eft.stability_margin, eft.linear.stability_margins):
        with pytest.raises(ValueError, match=says):
            function(RIG, **arguments)
    with pytest.raises(ValueError, match="output = torque: must be one of force"):
        eft.linearize(RIG).response([1.0], "torque")


@pytest.mark.parametrize("rate", [512.0, 4096.0, 20000.0])
@pytest.mark.parametrize("drift", [1.0, 100.0, 1e4])
def test_the_observers_gains_are_scipys(rate, drift):
    rig = eft.Rig.zhao2005().replace({"controller.observer_drift": drift})
    t = 1 / rate
    a = np.array([[1, t, t * t / 2], [0, 1, t], [0, 0, 1]])
    b = rig["controller.observer_acceleration_noise"] * np.array([[t * t / 2], [t], [0]])
    # In units with a measurement noise of 1, because SciPy loses digits otherwise.
    noise = rig["controller.observer_displacement_noise"]
    q = (b @ b.T + np.diag([0, 0, (drift * t) ** 2])) / noise**2
    c = np.array([[1.0, 0, 0]])
    p = solve_discrete_are(a.T, c.T, q, np.eye(1))
    expected = (p @ c.T / (c @ p @ c.T + 1)).ravel()
    np.testing.assert_allclose(eft.linear.observer_gains(rig, rate), expected, rtol=1e-5)


@pytest.mark.parametrize("sampled", [False, True])
def test_a_model_is_pickled_whole(sampled):
    rig = RIG.replace({"compensation.computation_delay": 2, "servovalve.overlap": 0.01})
    model = eft.linearize(rig, sampled=sampled)
    for other in (pickle.loads(pickle.dumps(model)), copy.deepcopy(model)):
        for name in ("A", "B", "C", "D"):
            np.testing.assert_array_equal(getattr(other, name), getattr(model, name))
        for name in ("states", "inputs", "outputs", "left_out", "sample_time"):
            assert getattr(other, name) == getattr(model, name)
        np.testing.assert_array_equal(other.poles(), model.poles())
    make, (matrices, names, sample_time) = model.__reduce__()
    with pytest.raises(ValueError, match="must be as it was pickled"):
        make((*matrices[:2], matrices[0], matrices[3]), names, sample_time)


def test_the_continuous_model_names_an_estimated_velocity_and_the_sampled_one_contains_it():
    observer = {"controller.velocity_source": "observer", "controller.observer_mass": 7040.0}
    rig = RIG.replace(observer | {"compensation.adaptive": True})
    own = ["compensation.adaptive", "controller.velocity_source"]
    for sampled, expected in ((False, own), (True, own[:1])):
        assert eft.linearize(rig, sampled=sampled).left_out == expected
    found = eft.linear.stability_map(
        RIG,
        ("servovalve.overlap", [0.0, 0.001]),
        ("controller.velocity_source", ["sensor", "derivative"]),
    )
    assert found.left_out == ("servovalve.overlap",)
    sensor, derivative = found.values[:, 0]
    assert sensor != derivative
    assert (
        eft.linear.stability_map(
            RIG, ("compensation.level", [1.0, 1.1]), ("structure.damping", [4e3])
        ).left_out
        == ()
    )


def test_a_loop_with_an_integral_part_and_a_free_structure_are_marginally_stable():
    assert repr(eft.design_force_loop(RIG).open_loop).endswith(" marginally stable>")
    free = RIG.replace({"structure.stiffness": 0.0})
    said = eft.check_feasibility(free, eft.sine_sweep(2000.0, 0.5, 5.0, 1.0, 4096.0)).reasons
    assert not any("unstable" in reason for reason in said), said
