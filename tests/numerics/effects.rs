//! The effects beyond the paper's model in a whole test: the effect of each on the force, and the energy balance.

use eft::sim::closed_loop::{EnergyTraces, Method, energy_balance, energy_of_traces};
use eft::sim::excitation::{Command, sine_sweep};
use eft::sim::metrics::nrmse;
use eft::sim::plant::EnergyBalance;
use eft::sim::{RigConfig, SimulateOptions, TestRun, simulate};
use toml::Value;

use crate::results::keep;

const RATE: f64 = 4096.0;

fn changed(changes: &[(&str, Value)]) -> RigConfig {
    RigConfig::zhao2005().replace(changes).unwrap()
}

fn numbers(values: &[f64]) -> Value {
    Value::Array(values.iter().map(|v| (*v).into()).collect())
}

fn run(rig: &RigConfig, command: &Command) -> TestRun {
    simulate::<f64>(rig, command, &SimulateOptions::default(), |_, _| true).unwrap()
}

fn sweep() -> Command {
    sine_sweep(8900.0, 0.0, 10.0, 32.0, RATE).unwrap()
}

fn tracking(changes: &[(&str, Value)]) -> f64 {
    let run = run(&changed(changes), &sweep());
    nrmse(&run.command, &run.force).unwrap()
}

/// Every effect at once, each large enough to matter.
fn everything() -> RigConfig {
    changed(&[
        ("actuator.dead_length", 0.01.into()),
        ("actuator.friction", 300.0.into()),
        ("actuator.stroke", 0.05.into()),
        ("actuator.stop_stiffness", 5e7.into()),
        ("actuator.stop_damping", 1.0.into()),
        ("supply.droop", 3e8.into()),
        ("supply.accumulator", 5e-10.into()),
        ("supply.pump_flow", 6e-3.into()),
        ("supply.schedule.times", numbers(&[0.0, 4.0, 6.0])),
        ("supply.schedule.pressures", numbers(&[1.9e7, 1.9e7, 1.7e7])),
        ("servovalve.pilot_flow_limit", 2e-5.into()),
        ("truth.servovalve.overlap", 0.005.into()),
        ("servovalve.leakage.proportional", 2e-12.into()),
        ("servovalve.leakage.constant", 4e-5.into()),
        ("structure.kind", "bouc_wen".into()),
        ("structure.bouc_wen.yield_displacement", 0.02.into()),
        ("structure.bouc_wen.post_yield_ratio", 0.2.into()),
        ("structure.bouc_wen.exponent", 2.0.into()),
        ("structure.bouc_wen.shape", 0.6.into()),
        ("structure.power_damper.coefficient", 2000.0.into()),
        ("structure.power_damper.exponent", 0.5.into()),
        ("sensors.cell_mass", 40.0.into()),
        ("sensors.force.bandwidth", 400.0.into()),
    ])
}

#[test]
fn effects_that_are_off_change_nothing() {
    // A schedule of one constant pressure also needs the general plant, and therefore Runge–Kutta.
    let command = sine_sweep(8900.0, 0.0, 10.0, 8.0, RATE).unwrap();
    let runge_kutta = SimulateOptions { method: Method::RungeKutta, ..SimulateOptions::default() };
    let plain = simulate::<f64>(&changed(&[]), &command, &runge_kutta, |_, _| true).unwrap();
    let detailed = run(
        &changed(&[
            ("supply.schedule.times", numbers(&[0.0])),
            ("supply.schedule.pressures", numbers(&[1.9e7])),
        ]),
        &command,
    );
    assert!(plain.energy.is_none() && detailed.energy.is_some());
    let distance =
        plain.force.iter().zip(&detailed.force).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
    assert!(distance < 1e-6, "{distance} N");
}

#[test]
fn energy_adds_up_with_every_effect_and_the_gap_shrinks_with_the_step() {
    let command = sine_sweep(20e3, 0.5, 2.8, 5.0, RATE).unwrap();
    let rig = everything();
    let largest = run(&rig, &command).displacement.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    assert!(largest > 0.05, "the test must reach the stops: {largest} m");
    let gap = |divisor: f64| {
        let options = SimulateOptions { largest_step: 1.0 / (RATE * divisor), ..SimulateOptions::default() };
        let balance = energy_balance(&rig, std::slice::from_ref(&command), &options).unwrap();
        for part in
            [balance.droop, balance.valve, balance.leakage, balance.friction, balance.stops, balance.damping]
        {
            assert!(part > 1e-4 * balance.supplied, "{balance:?}");
        }
        assert!(balance.swept.abs() > 0.0);
        balance.gap().abs()
    };
    let gaps = [4.0, 16.0].map(gap);
    assert!(gaps[0] < 1e-6, "{gaps:?}");
    assert!(gaps[1] < gaps[0] / 4.0, "{gaps:?}");
}

#[test]
fn energy_adds_up_with_an_attachment_unequal_areas_and_lapped_lands() {
    let command = sine_sweep(2e3, 0.5, 6.0, 6.0, RATE).unwrap();
    for (overlap, area_ratio, level) in [(-0.01, 0.8, 0.4), (0.005, 1.2, 0.9)] {
        let rig = changed(&[
            ("servovalve.overlap", overlap.into()),
            ("truth.servovalve.null_bias", 0.01.into()),
            ("servovalve.torque_motor_frequency", 300.0.into()),
            ("actuator.area_ratio", area_ratio.into()),
            ("actuator.attachment_stiffness", 5e8.into()),
            ("actuator.attachment_play", 5e-5.into()),
            ("actuator.dead_length", 0.01.into()),
            ("controller.proportional_gain", 0.3.into()),
            ("compensation.level", level.into()),
        ]);
        let balance =
            energy_balance(&rig, std::slice::from_ref(&command), &SimulateOptions::default()).unwrap();
        assert!(balance.gap().abs() < 1e-6, "{balance:?}");
        assert!(balance.valve > 0.1 * balance.supplied && balance.supplied > 0.0, "{balance:?}");
    }
}

fn of_traces(run: &TestRun) -> Option<EnergyBalance> {
    let TestRun { rig, sample_rate, traces, .. } = run;
    let traces = EnergyTraces {
        displacement: &traces.displacement,
        velocity: &traces.velocity,
        spool: &traces.spool,
        load_pressure: &traces.load_pressure,
    };
    energy_of_traces(rig, *sample_rate, &traces).unwrap()
}

#[test]
fn traces_of_the_papers_rig_have_its_energy() {
    let (rig, command) = (changed(&[]), sine_sweep(8900.0, 0.0, 10.0, 8.0, RATE).unwrap());
    let balance = energy_balance(&rig, std::slice::from_ref(&command), &SimulateOptions::default()).unwrap();
    let traced = of_traces(&run(&rig, &command)).unwrap();
    assert!(traced.gap().abs() < 1e-8, "{traced:?}");
    for (a, b) in [
        (traced.supplied, balance.supplied),
        (traced.valve, balance.valve),
        (traced.leakage, balance.leakage),
        (traced.damping, balance.damping),
    ] {
        // The balance ends a tick later.
        assert!((a / b - 1.0).abs() < 1e-4, "{traced:?} {balance:?}");
    }
    let rubs = run(&changed(&[("actuator.friction", 300.0.into())]), &command);
    assert!(rubs.energy.is_some() && of_traces(&rubs).is_none());
    let short = EnergyTraces { displacement: &[0.0], velocity: &[], spool: &[0.0], load_pressure: &[0.0] };
    let refused = energy_of_traces(&rig, RATE, &short).unwrap_err().to_string();
    assert_eq!(refused, "velocity = 0 samples: must have 1, as the displacement");
    assert!(energy_of_traces(&rig, 0.0, &EnergyTraces { velocity: &[0.0], ..short }).is_err());
}

#[test]
fn energy_of_the_papers_rig_adds_up() {
    let balance = energy_balance(&changed(&[]), &[sweep()], &SimulateOptions::default()).unwrap();
    let share = |part: f64| part / balance.supplied;
    keep(
        "energy of the paper's rig over what is supplied",
        &[
            ("valve", share(balance.valve)),
            ("leakage", share(balance.leakage)),
            ("damping", share(balance.damping)),
        ],
    );
    assert!(balance.gap().abs() < 1e-5, "{}", balance.gap());
    // Most of the hydraulic power of such a test is throttled away.
    assert!(balance.valve > 0.8 * balance.supplied);
}

#[test]
fn constant_leakage_worsens_the_tracking_and_proportional_leakage_hardly() {
    let without = tracking(&[]);
    // 0.5 % of the valve's capacity, the paper's bound.
    let constant = tracking(&[("servovalve.leakage.constant", 4.3e-5.into())]);
    // As large as the rig's whole proportional leakage.
    let proportional = tracking(&[("servovalve.leakage.proportional", 1.3e-11.into())]);
    keep("NRMSE with leakage", &[("none", without), ("constant", constant), ("proportional", proportional)]);
    assert!(constant > 1.4 * without, "{constant} against {without}");
    assert!(proportional < 1.2 * without, "{proportional} against {without}");
}

#[test]
fn constant_leakage_leaves_an_offset_that_the_loop_cannot_remove() {
    let leakage = 4.3e-5;
    let rig = changed(&[
        ("servovalve.leakage.constant", leakage.into()),
        ("structure.kind", "linear".into()),
        // Damped, so that it is soon at rest.
        ("structure.damping", 1e5.into()),
    ]);
    let run = run(&rig, &Command::new(vec![5000.0; 16384], RATE).unwrap());
    let force = *run.force.last().unwrap();
    // At rest the valve passes the leakage: f(K_s′·G_p·C_F·(F_c − F))·√(1 − P_L/P_s) = C_l·P_L + Q_c. Past null the
    // whole constant part leaks; the table's first stretch is a straight line.
    let (v, c) = (&rig.servovalve, &rig.controller);
    let gain = c.proportional_gain * c.force_sensitivity / (v.spool_sensitivity * v.spool_stroke);
    let load = force / rig.actuator.piston_area;
    let opening = gain * (5000.0 - force);
    let flow = opening * v.flow_table.flows[11] / 0.1 * (1.0 - load / rig.supply.pressure).sqrt();
    let side = (opening / 0.003).min(1.0);
    assert!((flow / (rig.actuator.leakage * load + leakage * side) - 1.0).abs() < 1e-6, "{force} N");
    assert!(5000.0 - force > 300.0, "{force} N");
}

#[test]
fn a_null_bias_leaves_the_force_that_holds_the_spool_at_the_bias() {
    for bias in [0.02, -0.01] {
        let rig = changed(&[
            ("truth.servovalve.null_bias", bias.into()),
            ("structure.kind", "linear".into()),
            ("structure.damping", 1e5.into()),
        ]);
        let run = run(&rig, &Command::new(vec![0.0; 16384], RATE).unwrap());
        let force = *run.force.last().unwrap();
        // At rest the valve passes the leakage: f(x_v − b)·√(1 ∓ P_L/P_s) = C_l·P_L, x_v = −K_s′·G_p·C_F·F. Near null
        // the table is a straight line.
        let (v, c) = (&rig.servovalve, &rig.controller);
        let gain = c.proportional_gain * c.force_sensitivity / (v.spool_sensitivity * v.spool_stroke);
        let load = force / rig.actuator.piston_area;
        let open = -gain * force - bias;
        let slope = if open < 0.0 { -v.flow_table.flows[9] } else { v.flow_table.flows[11] } / 0.1;
        let flow = slope * open * (1.0 - open.signum() * load / rig.supply.pressure).sqrt();
        assert!((flow / (rig.actuator.leakage * load) - 1.0).abs() < 1e-6, "{force} N");
        // The force with an ideal integrator after the loop, less the loop's own error of 2 %.
        assert!((force / (-bias / gain) - 1.0).abs() < 0.03, "{force} N");
    }
}

#[test]
fn a_falling_supply_slows_the_flow_by_its_root() {
    let rig = changed(&[
        ("supply.schedule.times", numbers(&[0.0, 16.0, 20.0])),
        ("supply.schedule.pressures", numbers(&[1.9e7, 1.9e7, 0.8 * 1.9e7])),
        ("structure.kind", "linear".into()),
    ]);
    let tone = |t: f64| 3000.0 * (std::f64::consts::TAU * 1.58 * t).sin();
    let command =
        Command::new((0..(32.0 * RATE) as usize).map(|i| tone(i as f64 / RATE)).collect(), RATE).unwrap();
    let run = run(&rig, &command);
    let error = |from: f64, to: f64| {
        let (a, b) = ((from * RATE) as usize, (to * RATE) as usize);
        nrmse(&run.command[a..b], &run.force[a..b]).unwrap()
    };
    assert_eq!(run.supply_pressure[(17.0 * RATE) as usize], 0.95 * 1.9e7);
    assert!((run.supply_pressure.last().unwrap() - 0.8 * 1.9e7).abs() < 1.0);
    assert_eq!(run.measured_supply_pressure(), run.supply_pressure);
    // √0.8 means a tenth less flow than the controller assumes.
    keep("NRMSE as the supply falls", &[("before", error(8.0, 16.0)), ("after", error(24.0, 32.0))]);
    assert!(error(24.0, 32.0) > 2.0 * error(8.0, 16.0));
}

#[test]
fn the_spool_slews_no_faster_than_the_pilot_lets_it() {
    let limit = 2e-6;
    let rig = changed(&[("servovalve.pilot_flow_limit", limit.into())]);
    let run = run(&rig, &sweep());
    let fastest =
        run.spool.windows(2).fold(0.0, |most: f64, pair| most.max((pair[1] - pair[0]).abs() * RATE));
    let bound = limit / (rig.servovalve.spool_area * rig.servovalve.spool_stroke);
    assert!(fastest <= bound * (1.0 + 1e-9) && fastest > 0.99 * bound, "{fastest}, bound {bound}");
}

#[test]
fn overlap_and_friction_worsen_the_tracking() {
    let without = tracking(&[]);
    let unknown = tracking(&[("truth.servovalve.overlap", 0.01.into())]);
    let known = tracking(&[("servovalve.overlap", 0.01.into())]);
    assert!(unknown > 1.2 * without && known < 0.8 * unknown, "{without} {known} {unknown}");
    assert!(tracking(&[("actuator.friction", 500.0.into())]) > 1.02 * without);
}

#[test]
fn the_load_cells_lag_and_inertia_show_in_the_measurement() {
    let rig = changed(&[("sensors.cell_mass", 100.0.into()), ("sensors.force.bandwidth", 400.0.into())]);
    let run = run(&rig, &sweep());
    // dF_s/dt = ω(F − m·a − F_s), checked with central differences of the traces.
    let omega = std::f64::consts::TAU * 400.0;
    let shown = run.measured_force();
    let slope = |x: &[f64], i: usize| (x[i + 1] - x[i - 1]) * RATE / 2.0;
    let mut worst: f64 = 0.0;
    for i in 1..shown.len() - 1 {
        let expected = omega * (run.force[i] - 100.0 * slope(&run.velocity, i) - shown[i]);
        worst = worst.max((slope(shown, i) - expected).abs());
    }
    assert!(worst < 2e-3 * omega * 8900.0, "{worst}");
}
