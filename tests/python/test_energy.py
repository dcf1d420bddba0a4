"""The energy balance closes without and with every effect, and its gap decreases with the step."""

import numpy as np
import pytest

import eft

RIG = eft.Rig.zhao2005()

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
    rig, command = RIG.replace(EVERYTHING), eft.sine_sweep(20e3, 0.5, 6.0, 12.0, 4096.0)
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
    assert balance.supplied == pytest.approx(integral(RIG["supply.pressure"] * abs(flow * root)), rel=2e-3)
