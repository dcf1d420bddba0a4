//! Tests of a batch, alone and side by side.

use eft_sim::batch::{BatchOptions, Outcome, Test, side_by_side, simulate_batch};
use eft_sim::closed_loop::{DEFAULT_STEP, Method, Precision, simulate_actuators};
use eft_sim::excitation::{Command, sine_sweep};
use eft_sim::{Error, RigConfig, SimulateOptions, TestRun};

fn rig(changes: &[(&str, toml::Value)]) -> RigConfig {
    RigConfig::zhao2005().replace(changes).unwrap()
}

#[test]
fn a_failing_test_does_not_affect_the_others_or_their_order() {
    let command = sine_sweep(8900.0, 0.0, 10.0, 0.5, 4096.0).unwrap();
    let (good, bad) = (RigConfig::zhao2005(), building(2, &[]));
    let (rigs, commands) = ([&good, &bad, &good], [command]);
    let tests = rigs.map(|rig| Test { rig, commands: &commands });
    let outcomes = simulate_batch::<f64>(&tests, &BatchOptions::default(), |_, _| true).unwrap();
    assert!(outcomes[1].as_ref().unwrap_err().to_string().starts_with("commands = "));
    assert!(
        outcomes[0].as_ref().unwrap().finished() && outcomes[0].as_ref().ok() == outcomes[2].as_ref().ok()
    );
}

#[test]
fn an_interruption_ends_it_soon() {
    let commands = [sine_sweep(8900.0, 0.0, 10.0, 600.0, 4096.0).unwrap()];
    let rig = rig(&[]);
    let tests = [Test { rig: &rig, commands: &commands }; 50];
    let start = std::time::Instant::now();
    let stopped = simulate_batch::<f64>(&tests, &BatchOptions::default(), |_, _| false);
    assert!(matches!(stopped, Err(Error::Interrupted)));
    assert!(start.elapsed().as_secs() < 5);
}

fn mixed() -> Vec<RigConfig> {
    let changes: [&[(&str, toml::Value)]; 11] = [
        &[],
        &[("compensation.mode", "linear".into())],
        &[("compensation.mode", "off".into()), ("structure.kind", "linear".into())],
        &[("compensation.sign_from", "demand".into()), ("servovalve.flow_gain_scale", 0.9.into())],
        &[("compensation.feedforward", true.into()), ("compensation.computation_delay", 2.into())],
        &[("compensation.level", 1.6.into())],
        &[("limits.valve_command", 1.0.into()), ("actuator.leakage", 3e-11.into())],
        &[
            ("sensors.force.noise", 20.0.into()),
            ("sensors.spool.bits", 12.into()),
            ("sensors.spool.range", 1.2.into()),
        ],
        &[("structure.mass", 1e-3.into())],
        &[("structure.damping", 2e4.into()), ("supply.pressure", 1.5e7.into())],
        &[("limits.velocity_range", 0.05.into()), ("limits.force_range", 4e3.into())],
    ];
    changes.into_iter().map(rig).collect()
}

fn building(stories: usize, changes: &[(&str, toml::Value)]) -> RigConfig {
    let all = |value: f64| toml::Value::Array(vec![value.into(); stories]);
    let structure = [
        ("structure.kind", "shear_building".into()),
        ("structure.stories.masses", all(7040.0)),
        ("structure.stories.dampings", all(4330.0)),
        ("structure.stories.stiffnesses", all(693.8e3)),
    ];
    rig(&[&structure, changes].concat())
}

/// Whether two runs have the same bits. Text shows each of them, and NaN equals NaN there, but it takes long.
fn same(run: &TestRun, other: &TestRun) -> bool {
    run == other && run.first_difference(other).is_none() || format!("{run:?}") == format!("{other:?}")
}

/// Compares every test of a batch with the same test by `simulate`, in one precision. At least `wide` sets
/// must run side by side.
fn compare_in<P: Precision>(
    rigs: &[RigConfig],
    commands: &[Vec<Command>],
    options: &BatchOptions,
    wide: usize,
) {
    let tests: Vec<_> = rigs.iter().zip(commands).map(|(rig, commands)| Test { rig, commands }).collect();
    let found = side_by_side(&tests, options);
    assert!(found >= wide, "{found} sets run side by side");
    let outcomes = simulate_batch::<P>(&tests, options, |_, _| true).unwrap();
    for (n, (outcome, test)) in outcomes.into_iter().zip(&tests).enumerate() {
        let alone = simulate_actuators::<P>(test.rig, test.commands, &options.simulate, |_, _| true).unwrap();
        let (mut outcome, mut alone) = (outcome.unwrap(), Outcome::new(test.rig, alone, options).unwrap());
        let (runs, others) = (std::mem::take(&mut outcome.runs), std::mem::take(&mut alone.runs));
        assert_eq!(format!("{outcome:?}"), format!("{alone:?}"), "test {n}");
        assert_eq!(runs.len(), others.len(), "test {n}");
        assert!(runs.iter().zip(&others).all(|(run, other)| same(run, other)), "test {n}");
    }
}

fn compare(rigs: &[RigConfig], commands: &[Command], options: &BatchOptions) {
    let commands: Vec<_> = commands.iter().map(|command| vec![command.clone()]).collect();
    compare_in::<f64>(rigs, &commands, options, 1);
}

#[test]
fn side_by_side_every_test_has_the_bits_it_has_alone() {
    let rigs = mixed();
    let commands: Vec<_> = (0..rigs.len())
        .map(|i| sine_sweep(1500.0 * (1 + i) as f64, 0.0, 10.0, 4.0, 4096.0).unwrap())
        .collect();
    for fft in [false, true] {
        compare(&rigs, &commands, &BatchOptions { fft, ..BatchOptions::default() });
    }
}

#[test]
fn side_by_side_in_the_digital_realization_at_another_rate_and_step() {
    let digital = ("controller.realization", toml::Value::from("digital"));
    let rigs: Vec<_> =
        mixed().iter().map(|rig| rig.replace(std::slice::from_ref(&digital)).unwrap()).collect();
    let command = sine_sweep(8900.0, 0.0, 10.0, 3.3, 2048.0).unwrap();
    compare(&rigs, &vec![command; rigs.len()], &BatchOptions::default());
}

#[test]
fn each_test_of_a_mixed_batch_has_its_own_outcome() {
    let rigs: Vec<_> = mixed().into_iter().cycle().take(40).collect();
    let commands: Vec<_> = (0..rigs.len())
        .map(|i| sine_sweep(8900.0, 0.0, 10.0, 0.5 + 0.25 * (i % 3) as f64, 4096.0).unwrap())
        .collect();
    compare(&rigs, &commands, &BatchOptions { threads: Some(3), ..BatchOptions::default() });
}

/// Adaptive rigs, one of which diverges, with further changes such as noise.
fn adaptive(further: &[(&str, toml::Value)]) -> Vec<RigConfig> {
    let changes: [&[(&str, toml::Value)]; 8] = [
        &[],
        &[("servovalve.flow_gain_scale", 0.8.into())],
        &[("truth.servovalve.pilot_time_constant", 0.004.into())],
        &[("compensation.mode", "linear".into()), ("compensation.curve_correction", false.into())],
        &[("structure.mass", 1e-3.into())],
        &[("limits.velocity_range", 0.05.into())],
        &[
            ("compensation.computation_delay", 2.into()),
            ("compensation.feedforward", true.into()),
            // Of the controller alone: the plant stays plain.
            ("actuator.friction", 50.0.into()),
            ("truth.actuator.friction", 0.0.into()),
        ],
        &[("compensation.supply_correction", true.into()), ("compensation.level", 1.3.into())],
    ];
    let all = |one: &[(&str, toml::Value)]| {
        rig(&[&[("compensation.adaptive", true.into())], further, one].concat())
    };
    changes.into_iter().map(all).collect()
}

fn sweeps(count: usize, duration: f64) -> Vec<Vec<Command>> {
    let sweep = |i| sine_sweep(2000.0 + 900.0 * i as f64, 0.0, 10.0, duration, 4096.0).unwrap();
    (0..count).map(|i| vec![sweep(i)]).collect()
}

const KEPT: BatchOptions = BatchOptions {
    simulate: SimulateOptions { largest_step: DEFAULT_STEP, method: Method::Exponential },
    threads: None,
    traces: true,
    fft: false,
};

#[test]
fn side_by_side_learners_have_the_bits_they_have_alone() {
    let digital: (&str, toml::Value) = ("controller.realization", "digital".into());
    for further in [vec![], vec![digital]] {
        let rigs = adaptive(&further);
        for options in [KEPT, BatchOptions { fft: true, ..BatchOptions::default() }] {
            compare_in::<f64>(&rigs, &sweeps(rigs.len(), 2.5), &options, 1);
        }
        compare_in::<f32>(&rigs, &sweeps(rigs.len(), 2.5), &KEPT, 1);
    }
}

#[test]
fn side_by_side_sensors_have_the_bits_they_have_alone() {
    let noise: [(&str, toml::Value); 5] = [
        ("sensors.force.noise", 20.0.into()),
        ("sensors.velocity.noise", 1e-3.into()),
        ("sensors.displacement.noise", 1e-5.into()),
        ("sensors.spool.noise", 1e-3.into()),
        ("sensors.seed", 7.into()),
    ];
    let mut rigs = adaptive(&noise);
    let further: [&[(&str, toml::Value)]; 4] = [
        &[("sensors.force.bits", 12.into()), ("sensors.force.range", 2e4.into()), ("sensors.seed", 1.into())],
        &[("sensors.velocity.delay", 2.into()), ("sensors.velocity.dropout", 0.01.into())],
        &[("sensors.velocity.bandwidth", 200.0.into()), ("sensors.force.gain", 1.01.into())],
        &[("sensors.spool.noise", 0.0.into()), ("sensors.spool.bias", 1e-3.into())],
    ];
    for (rig, further) in rigs.iter_mut().zip(further) {
        *rig = rig.replace(further).unwrap();
    }
    // The last four of them fail as well.
    let faults = [("dead", None), ("offset", Some(300.0)), ("drift", Some(500.0)), ("noise", Some(200.0))];
    for (rig, (kind, size)) in rigs.iter_mut().rev().zip(faults) {
        let key = format!("sensors.fault.{kind}");
        let mut fault: Vec<(&str, toml::Value)> = vec![
            ("sensors.fault.signal", "force".into()),
            ("sensors.fault.kind", kind.into()),
            ("sensors.fault.start", 1.0.into()),
        ];
        fault.extend(size.map(|size| (key.as_str(), size.into())));
        *rig = rig.replace(&fault).unwrap();
    }
    compare_in::<f64>(&rigs, &sweeps(rigs.len(), 2.0), &KEPT, 1);
    compare_in::<f32>(&rigs, &sweeps(rigs.len(), 2.0), &KEPT, 1);
}

#[test]
fn side_by_side_whole_channels_have_the_bits_they_have_alone() {
    let changes: [&[(&str, toml::Value)]; 5] = [
        &[("protection.velocity_trip", 0.1.into())],
        &[("protection.force_trip", 3e3.into()), ("protection.plausibility", true.into())],
        &[("controller.velocity_source", "derivative".into())],
        &[
            ("controller.velocity_source", "observer".into()),
            ("controller.observer_mass", 7040.0.into()),
            ("compensation.adaptive", true.into()),
        ],
        &[
            ("protection.plausibility", true.into()),
            ("sensors.fault.signal", "velocity".into()),
            ("sensors.fault.kind", "stuck".into()),
            ("sensors.fault.start", 1.0.into()),
        ],
    ];
    let protected: [(&str, toml::Value); 2] =
        [("protection.enabled", true.into()), ("protection.soft_end", true.into())];
    let rigs: Vec<_> = changes.iter().cycle().take(15).map(|one| rig(&[&protected, *one].concat())).collect();
    compare_in::<f64>(&rigs, &sweeps(rigs.len(), 2.0), &KEPT, 2);
    compare_in::<f32>(&rigs, &sweeps(rigs.len(), 2.0), &BatchOptions::default(), 2);
}

#[test]
fn side_by_side_in_single_precision() {
    let rigs = mixed();
    compare_in::<f32>(&rigs, &sweeps(rigs.len(), 2.0), &KEPT, 1);
}

#[test]
fn side_by_side_plants_with_effects_have_the_bits_they_have_alone() {
    let changes: [&[(&str, toml::Value)]; 6] = [
        &[("actuator.friction", 50.0.into())],
        &[("servovalve.overlap", 0.01.into()), ("servovalve.leakage.proportional", 1e-12.into())],
        &[("supply.droop", 2e8.into()), ("supply.accumulator", 7e-10.into())],
        &[("structure.mass", 1e-3.into()), ("servovalve.overlap", 0.01.into())],
        &[("sensors.force.bandwidth", 300.0.into())],
        &[
            ("structure.power_damper.coefficient", 5e3.into()),
            ("structure.power_damper.exponent", 0.6.into()),
        ],
    ];
    let rigs: Vec<_> = changes.iter().cycle().take(24).map(|one| rig(one)).collect();
    compare_in::<f64>(&rigs, &sweeps(rigs.len(), 0.5), &KEPT, 1);
    let runge_kutta = Method::RungeKutta;
    let options = BatchOptions { simulate: SimulateOptions { method: runge_kutta, ..KEPT.simulate }, ..KEPT };
    compare_in::<f64>(&mixed(), &sweeps(mixed().len(), 1.0), &options, 1);
}

#[test]
fn side_by_side_buildings_have_the_bits_they_have_alone() {
    let protected: [(&str, toml::Value); 2] =
        [("protection.enabled", true.into()), ("protection.displacement_trip", 2e-3.into())];
    let adaptive: [(&str, toml::Value); 2] =
        [("compensation.adaptive", true.into()), ("sensors.force.noise", 10.0.into())];
    for further in [&[][..], &protected, &adaptive] {
        let rigs: Vec<_> = (0..5)
            .map(|i| {
                building(
                    3,
                    &[further, &[("compensation.level", (0.9 + 0.05 * f64::from(i)).into())]].concat(),
                )
            })
            .collect();
        let commands = vec![sweeps(3, 1.0).concat(); rigs.len()];
        for options in [KEPT, BatchOptions { fft: true, ..BatchOptions::default() }] {
            compare_in::<f64>(&rigs, &commands, &options, 1);
        }
    }
}
