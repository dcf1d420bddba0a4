"""The energy balance closes without and with every effect, and its gap decreases with the step."""

import dataclasses
import json

import numpy as np
import pytest

import eft

RIG = eft.Rig.zhao2005()
SWEEP = eft.sine_sweep(8900.0, 0.5, 6.0, 2.0, 1024.0)

EVERYTHING = {
    "actuator.dead_length": 0.01,
    "actuator.friction": 300.0,
    "actuator.stroke": 0.05,
    "actuator.stop_stiffness": 5e7,
    "actuator.stop_damping": 1.0,
    "supply.droop": 3e8,
    "supply.accumulator": 5e-10,
    "supply.pump_flow": 6e-3,
    "supply.schedule.times": [0.0, 4.0, 6.0],
    "supply.schedule.pressures": [1.9e7, 1.9e7, 1.7e7],
    "servovalve.pilot_flow_limit": 2e-5,
    "truth.servovalve.overlap": 0.005,
    "servovalve.leakage.proportional": 2e-12,
    "servovalve.leakage.constant": 4e-5,
    "structure.kind": "bouc_wen",
    "structure.bouc_wen.yield_displacement": 0.02,
    "structure.bouc_wen.post_yield_ratio": 0.2,
    "structure.bouc_wen.exponent": 2.0,
    "structure.bouc_wen.shape": 0.6,
    "structure.power_damper.coefficient": 2000.0,
    "structure.power_damper.exponent": 0.5,
    "sensors.cell_mass": 40.0,
    "sensors.force.bandwidth": 400.0,
}


def test_energy_closes_with_every_effect_on_and_closer_with_a_smaller_step():
    rig, command = RIG.replace(EVERYTHING), eft.sine_sweep(20e3, 0.5, 2.5, 3.0, 4096.0)
    coarse, fine = (eft.energy_balance(rig, command, largest_step=2.0**-power) for power in (14, 16))
    for balance in (coarse, fine):
        lost = balance.droop + balance.valve + balance.leakage + balance.friction + balance.stops
        lost += balance.damping + balance.hysteresis
        assert balance.dissipated == pytest.approx(lost, rel=1e-12)
        open_books = balance.supplied + balance.swept - balance.dissipated - balance.stored
        assert balance.gap == pytest.approx(open_books / abs(balance.supplied), abs=1e-12)
    for part in ("droop", "valve", "leakage", "friction", "stops", "damping", "hysteresis"):
        assert getattr(fine, part) > 1e-4 * fine.supplied, part
    assert abs(coarse.gap) < 1e-4
    assert abs(fine.gap) < abs(coarse.gap) / 4


def test_the_parts_are_the_integrals_of_the_traces():
    """The work of the dampers and of the force, from the traces of the test by the trapezoidal rule."""
    command = eft.sine_sweep(8900.0, 0.0, 6.0, 8.0, 4096.0)
    balance = eft.energy_balance(RIG, command)
    run = eft.simulate(RIG, command)

    def integral(power):
        return float(((power[1:] + power[:-1]) / 2).sum() / run.sample_rate)

    # The traces end a sample before the balance does.
    damping = integral(RIG["structure.damping"] * run.velocity**2)
    assert balance.damping == pytest.approx(damping, rel=2e-3)
    table = RIG["servovalve.flow_table"]
    flow = np.interp(run.spool, table["openings"], table["flows"])
    root = np.sqrt(1.0 - np.sign(run.spool) * run.load_pressure / RIG["supply.pressure"])
    supplied = integral(RIG["supply.pressure"] * abs(flow * root))
    assert balance.supplied == pytest.approx(supplied, rel=2e-3)
    assert run.energy is not None
    assert run.energy.damping == pytest.approx(damping, rel=1e-12)
    assert run.energy.supplied == pytest.approx(supplied, rel=1e-12)


@pytest.mark.parametrize("realization", ["analog", "digital"])
@pytest.mark.parametrize("rate", [1024.0, 4096.0])
def test_the_energy_of_a_run_is_that_of_the_balance(realization, rate):
    rig, command = (
        RIG.replace({"controller.realization": realization}),
        eft.sine_sweep(8900.0, 0.5, 6.0, 8.0, rate),
    )
    energy, balance = eft.simulate(rig, command).energy, eft.energy_balance(rig, command)
    assert energy is not None and abs(energy.gap) < 1e-4
    for part in ("supplied", "valve", "damping", "dissipated"):
        assert getattr(energy, part) == pytest.approx(getattr(balance, part), rel=1e-3), part
    # These are small, and the balance ends a sample later.
    for part in ("leakage", "stored", "swept"):
        assert getattr(energy, part) == pytest.approx(
            getattr(balance, part), rel=2e-2, abs=1e-4 * balance.supplied
        ), part


class Silent:
    def step(self, *_, **__):
        return 0.0


@pytest.mark.parametrize("effects", [{}, {"actuator.friction": 300.0}])
def test_the_energy_is_that_of_the_controller_of_the_run(effects, tmp_path):
    run = eft.simulate(RIG.replace(effects), SWEEP, controller=Silent())
    assert not run.displacement.any()
    for one in (run, eft.TestRun.load(run.save(tmp_path / "run.eft"))):
        assert one.energy is not None
        assert (one.energy.supplied, one.energy.damping, one.energy.stored) == (0.0, 0.0, 0.0)


def test_the_energy_is_that_of_the_precision_of_the_run():
    single, double = (eft.simulate(RIG, SWEEP, dtype).energy for dtype in ("f32", "f64"))
    assert single is not None and double is not None
    assert 0.0 < abs(single.supplied / double.supplied - 1.0) < 1e-4


def test_the_file_of_a_run_has_its_energy(tmp_path):
    run = eft.simulate(RIG, SWEEP)
    path = run.save(tmp_path / "run.eft")
    with np.load(path, allow_pickle=False) as archive:
        kept = json.loads(str(archive["about"]))["energy"]
    assert run.energy is not None and kept == dataclasses.asdict(run.energy)
    assert eft.TestRun.load(path).energy == run.energy


@pytest.mark.parametrize("effects", [{}, {"actuator.friction": 300.0}])
def test_the_energy_of_an_external_structure_is_unknown(effects, tmp_path):
    run = eft.simulate(RIG.replace(effects), SWEEP, structure=lambda force, dt: (0.0, 0.0))
    assert run.energy is None
    assert eft.TestRun.load(run.save(tmp_path / "run.eft")).energy is None


def test_the_energy_of_a_part_is_unknown():
    part = eft.simulate(RIG.replace({"actuator.stroke": 1e-4}), SWEEP).to_its_end()
    assert len(part) < len(SWEEP.values) and part.energy is None
