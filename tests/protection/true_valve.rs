//! A load cell that fails while the valve is not as its model: the force must not be blamed on the spool, because the
//! loop would stay closed.

use eft::core::Cause;
use eft::sim::RigConfig;
use toml::Value;

use crate::matrix::{fault, runs, seen};
use crate::sizes::{Bench, benches};

/// What differs from the rig that controller and protection know.
fn true_valves(rig: &RigConfig) -> Vec<RigConfig> {
    let valve = &rig.servovalve;
    let slow = |times: f64| ("truth.servovalve.pilot_flow_gain", Value::from(valve.pilot_flow_gain / times));
    let sensitivity = |gain: f64| {
        [
            ("truth.servovalve.spool_sensitivity", Value::from(valve.spool_sensitivity / gain)),
            ("truth.servovalve.pilot_flow_gain", (valve.pilot_flow_gain * gain).into()),
        ]
    };
    let late = ("truth.sensors.spool.delay", Value::from(6));
    let cases: [&[(&str, Value)]; 6] = [
        &[slow(1.5)],
        &[slow(1.5), late.clone()],
        &sensitivity(0.8),
        &sensitivity(1.25),
        &[("truth.servovalve.pilot_flow_limit", 5e-5.into())],
        &[("truth.supply.pressure", (0.75 * rig.supply.pressure).into())],
    ];
    cases.iter().map(|changes| rig.replace(changes).unwrap()).collect()
}

// SR-22
#[test]
fn a_failed_load_cell_is_not_blamed_on_the_spool_of_another_valve() {
    let [Bench { name, rig, .. }, ..] = &benches();
    let command = benches()[0].command();
    for (n, rig) in true_valves(rig).iter().enumerate() {
        let starts = [1.5, 1.58, 1.67, 1.79, 1.9];
        let faults =
            ["zero", "stuck", "sign", "dead"].into_iter().flat_map(|kind| starts.map(|start| (kind, start)));
        let failing = faults.clone().map(|(kind, start)| rig.replace(&fault("force", kind, start)).unwrap());
        let mut rigs: Vec<_> = failing.collect();
        rigs.push(rig.clone());
        let mut runs = runs(&rigs, &command);
        assert_eq!(seen(&runs.pop().unwrap(), 0.0).cause, Cause::None, "{name}, valve {n}");
        for ((kind, start), run) in faults.zip(&runs) {
            let found = seen(run, start).cause;
            let of_force = matches!(found, Cause::ForceImplausible | Cause::ForceLevel);
            assert!(of_force, "{name}, valve {n}, {kind} at {start} s: {found:?}");
        }
    }
}
