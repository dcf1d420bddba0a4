"""The corrected flow table of a test: its values, its file, and its use in the next test."""

import dataclasses

import numpy as np
import pytest

import eft

ON = {"compensation.adaptive": True, "compensation.feedforward": True, "compensation.curve_correction": True}
TABLE = eft.Rig.zhao2005()["servovalve.flow_table"]
OPENINGS, FLOWS = (np.array(TABLE[name]) for name in ("openings", "flows"))
TRUE = FLOWS * np.where(OPENINGS > 0.0, 1.05, 0.95)
RIG = eft.Rig.zhao2005().replace(
    {**ON, "servovalve.true_flow_table": {"openings": OPENINGS.tolist(), "flows": TRUE.tolist()}}
)
COMMAND = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0)


@pytest.fixture(scope="module")
def run():
    return eft.simulate(RIG, COMMAND)


def test_either_direction_is_found_and_the_force_met(run):
    visited = (np.abs(OPENINGS) > 0.05) & (np.abs(OPENINGS) <= np.abs(run.spool).max())
    assert visited.sum() > 6
    assert run.found_flows[visited] == pytest.approx(TRUE[visited], rel=0.01)
    one_gain = eft.simulate(RIG.replace({"compensation.curve_correction": False}), COMMAND)
    assert one_gain.found_flows == pytest.approx(one_gain.flow_gain_estimate[-1] * FLOWS, rel=1e-6)
    assert run.metrics()["nrmse"] < 0.02 < one_gain.metrics()["nrmse"]


def test_the_fixed_scheme_uses_the_found_table(run):
    corrected = run.corrected_rig()
    assert corrected["servovalve.flow_table.flows"] == run.found_flows.tolist()
    assert corrected["servovalve.true_flow_table.flows"] == TRUE.tolist()
    fixed = {"compensation.adaptive": False, "compensation.curve_correction": False}
    before = eft.simulate(RIG.replace(fixed), COMMAND).metrics()["nrmse"]
    after = eft.simulate(eft.Rig(corrected.replace(fixed).to_toml()), COMMAND).metrics()["nrmse"]
    assert after < 0.05 < before


def test_the_found_table_is_saved_with_the_run(run, tmp_path):
    again = eft.TestRun.load(run.save(tmp_path / "run.eft"))
    assert np.array_equal(again.found_flows, run.found_flows)


def test_unequal_areas_are_compensated_and_not_part_of_the_table():
    """With a known ratio the fixed scheme meets the force, and the learner finds the valve's curve alone."""
    loop = {"controller.force_loop": "robust", "compensation.look_ahead": True}
    rig = RIG.replace({**loop, "servovalve.true_flow_table": None, "actuator.area_ratio": 1.3})
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 16.0, 4096.0)
    fixed = eft.simulate(rig.replace({"compensation.adaptive": False}), command)
    ratio = fixed.fft_ratio(0.5, 9.5).ratio
    assert fixed.metrics()["nrmse"] < 0.015 and ratio.min() > 0.98 and ratio.max() < 1.02
    unknown = {"actuator.area_ratio": 1.0, "truth.actuator.area_ratio": 1.3, "compensation.adaptive": False}
    assert eft.simulate(rig.replace(unknown), command).metrics()["nrmse"] > 0.1
    learned = eft.simulate(rig.replace({"servovalve.flow_gain_scale": 1.05}), command)
    visited = (np.abs(OPENINGS) > 0.05) & (np.abs(OPENINGS) <= 0.9 * np.abs(learned.spool).max())
    assert learned.found_flows[visited] == pytest.approx(1.05 * FLOWS[visited], rel=0.01)
    corrected = learned.corrected_rig().replace({"compensation.adaptive": False})
    assert eft.simulate(corrected, command).metrics()["nrmse"] < 0.02


def test_the_linear_scheme_finds_no_table():
    short = eft.sine_sweep(1000.0, 0.0, 10.0, 1.0, 1024.0)
    linear = eft.Rig.zhao2005().replace({"compensation.mode": "linear"})
    with pytest.raises(ValueError, match=r'^compensation.mode = "linear": must be "nonlinear"'):
        eft.simulate(linear.replace({"compensation.adaptive": True}), short).corrected_rig()
    for fixed in (linear, linear.replace({"compensation.supply_correction": True})):
        assert eft.simulate(fixed, short).corrected_rig()["servovalve.flow_table.flows"] == FLOWS.tolist()


def test_a_fixed_controller_finds_its_table():
    short = eft.sine_sweep(1000.0, 0.0, 10.0, 1.0, 1024.0)
    assert eft.simulate(eft.Rig.zhao2005(), short).found_flows.tolist() == FLOWS.tolist()


def test_a_building_has_a_curve_a_floor():
    floors = {"masses": [7040.0] * 2, "dampings": [4330.0] * 2, "stiffnesses": [693.8e3] * 2}
    rig = eft.Rig.zhao2005().replace({"structure.kind": "shear_building", "structure.stories": floors})
    one = eft.sine_sweep(500.0, 0.0, 5.0, 1.0, 1024.0).values
    run = eft.simulate(rig, eft.Command(np.stack([one, one]), 1024.0))
    assert run.found_flows.shape == (2, OPENINGS.size)
    with pytest.raises(ValueError, match="2 actuators"):
        run.corrected_rig()
    assert run.actuator(1).found_flows.shape == OPENINGS.shape


def test_flows_of_a_processor_are_none_and_refused(tmp_path):
    run = dataclasses.replace(eft.simulate(eft.Rig.zhao2005(), COMMAND), found_flows=None)
    with pytest.raises(ValueError, match=r"^found_flows = None: must have been found here"):
        run.corrected_rig()
    again = eft.TestRun.load(run.save(tmp_path / "run.eft"))
    assert again.found_flows is None
    assert np.array_equal(again.force, run.force)
