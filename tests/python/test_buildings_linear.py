"""Linear models of buildings, compared with matrices from this file and with the simulation."""

from pathlib import Path

import numpy as np
import pytest

import eft
from buildings import RATE, building, command_of, matrices, record


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
    last = time >= seconds - 4.0  # whole periods, after the transients
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
    assert answer.verdict in ("go", "caution")
    assert answer.scheme in ("linear", "nonlinear")
    demands = {demand.name: demand for demand in answer.demands}
    ideal = eft.ideal_response(rig, command_of(rig, record(), scale=0.5))
    assert demands["displacement"].required == pytest.approx(np.abs(ideal.displacement).max())
    assert answer.margin == pytest.approx(eft.stability_margin(rig, sampled=True, flow_gain="steeper"))
    too_much = eft.check_feasibility(rig, command_of(rig, record(), scale=20.0))
    assert too_much.verdict == "no"


@pytest.mark.parametrize("floors", [3, 5, 8])
def test_floors_that_share_poles_have_the_eigenvalues_of_numpy(floors):
    # Every floor's lead network has the same pole. Some QR iterations do not converge at such settings.
    met = [
        (0.00042223024004577395, 0.020017824124905558),
        (0.00011464747232246094, 0.010693870113456577),
        (0.0001042999826885674, 0.20252719536616198),
        (0.005, 1.0),
    ]
    changes = [
        *({"compensation.response_delay": t, "servovalve.flow_gain_scale": k} for t, k in met),
        {"compensation.computation_delay": (190 - 9 * floors) // floors},
    ]
    for change in changes:
        rig = eft.Rig.zhao2005().replace(
            {
                "structure.kind": "shear_building",
                "structure.stories.masses": [7e3] * floors,
                "structure.stories.dampings": [9e3] * floors,
                "structure.stories.stiffnesses": np.linspace(1.5e6, 1e6, floors).tolist(),
                **change,
            }
        )
        model = eft.linearize(rig, sampled=True)
        found, expected = model.poles(), np.linalg.eigvals(model.A)
        assert found.size == expected.size
        # Poles that vanish within some samples are ill-conditioned, more so with a longer chain of delays.
        lasting = expected[np.abs(expected) > 0.9]
        assert lasting.size >= 4 * floors
        assert max(np.abs(found - pole).min() for pole in lasting) < 1e-11, change
        growth = np.log(np.abs(expected).max()) * rig["controller.sample_rate"]
        assert model.growth_rate == pytest.approx(growth, rel=1e-7, abs=1e-7)


def test_poles_at_zero_of_several_delays_are_found():
    rig = eft.Rig.from_toml(Path(__file__).parent / "data" / "poles-at-zero.toml")
    found = eft.check_feasibility(rig, eft.Command(np.zeros((3, 64)), 4096.0))
    assert 1000.0 < found.smallest_sample_rate < 12_800.0


def test_the_margins_of_a_building_of_three_floors_lie_between_stable_and_unstable():
    rig = eft.Rig.zhao2005().replace(
        {
            "structure.kind": "shear_building",
            "structure.stories.masses": [7e3, 7e3, 7e3],
            "structure.stories.dampings": [9e3, 9e3, 9e3],
            "structure.stories.stiffnesses": [1.5e6, 1.2e6, 1e6],
        }
    )
    margins = eft.linear.stability_margins(rig, sampled=True)

    def radius(key, value):
        return np.abs(np.linalg.eigvals(eft.linearize(rig.replace({key: value}), sampled=True).A)).max()

    edges = {
        "compensation.level": margins.level,
        "compensation.response_delay": margins.response_delay[1],
    }
    edges["servovalve.flow_gain_scale"] = margins.flow_gain[1]
    for key, edge in edges.items():
        assert radius(key, edge * (1 - 1e-4)) < 1 < radius(key, edge * (1 + 1e-4)), key


@pytest.mark.parametrize("floors", [3, 6])
def test_every_margin_of_a_tall_building_is_there_with_its_compensation_and_without(floors):
    rig = eft.Rig.zhao2005().replace(
        {
            "structure.kind": "shear_building",
            "structure.stories.masses": [7e3] * floors,
            "structure.stories.dampings": [9e4] * floors,
            "structure.stories.stiffnesses": [1.5e6] * floors,
        }
    )
    off = eft.linear.stability_margins(rig.replace({"compensation.mode": "off"}), sampled=True)
    assert off.dead_time == np.inf and off.growth_rate < 0, "nothing is there to be delayed"
    samples = round(eft.linear.stability_margins(rig, sampled=True).dead_time * rig["controller.sample_rate"])
    for delay, stable in ((samples, False), (samples - 1, True)):
        late = rig.replace({"compensation.computation_delay": delay})
        radius = np.abs(np.linalg.eigvals(eft.linearize(late, sampled=True).A)).max()
        assert (radius < 1) == stable
