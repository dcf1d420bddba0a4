use super::*;
use crate::ground_motion::excitation::sine_sweep;

fn rig(changes: &[(&str, toml::Value)]) -> RigConfig {
    RigConfig::zhao2005().replace(changes).unwrap()
}

#[test]
fn one_that_fails_loses_no_other_and_the_order_stays() {
    let command = sine_sweep(8900.0, 0.0, 10.0, 0.5, 4096.0).unwrap();
    let one = |value: f64| toml::Value::Array(vec![value.into()]);
    let building = rig(&[
        ("structure.kind", "shear_building".into()),
        ("structure.stories.masses", one(7040.0)),
        ("structure.stories.dampings", one(4330.0)),
        ("structure.stories.stiffnesses", one(693.8e3)),
    ]);
    let (good, bad) = (RigConfig::zhao2005(), building);
    let rigs = [&good, &bad, &good];
    let tests = rigs.map(|rig| Test { rig, command: &command });
    let outcomes = simulate_batch::<f64>(&tests, &BatchOptions::default(), |_, _| true).unwrap();
    assert!(outcomes[1].as_ref().unwrap_err().to_string().starts_with("structure.kind = "));
    assert!(
        outcomes[0].as_ref().unwrap().finished() && outcomes[0].as_ref().ok() == outcomes[2].as_ref().ok()
    );
}

#[test]
fn an_interruption_ends_it_soon() {
    let command = sine_sweep(8900.0, 0.0, 10.0, 600.0, 4096.0).unwrap();
    let rig = rig(&[]);
    let tests = [Test { rig: &rig, command: &command }; 50];
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

/// Every test of a batch against the same test by `simulate`.
fn compare(rigs: &[RigConfig], commands: &[Command], options: &BatchOptions) {
    let tests: Vec<_> = rigs.iter().zip(commands).map(|(rig, command)| Test { rig, command }).collect();
    let wide = pieces::<f64>(&tests, options).iter().filter(|piece| piece.side_by_side.is_some()).count();
    assert!(wide > 0, "nothing runs side by side");
    let outcomes = simulate_batch::<f64>(&tests, options, |_, _| true).unwrap();
    for (n, (outcome, test)) in outcomes.into_iter().zip(&tests).enumerate() {
        let alone = simulate::<f64>(test.rig, test.command, &options.simulate, |_, _| true).unwrap();
        let (outcome, alone) = (outcome.unwrap(), Outcome::new(alone, options).unwrap());
        // As text, where NaN equals NaN: every bit of every number shows in it.
        assert_eq!(format!("{outcome:?}"), format!("{alone:?}"), "test {n}");
    }
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
fn tests_of_many_kinds_find_their_own_outcomes() {
    let rigs: Vec<_> = mixed().into_iter().cycle().take(40).collect();
    let commands: Vec<_> = (0..rigs.len())
        .map(|i| sine_sweep(8900.0, 0.0, 10.0, 0.5 + 0.25 * (i % 3) as f64, 4096.0).unwrap())
        .collect();
    compare(&rigs, &commands, &BatchOptions { threads: Some(3), ..BatchOptions::default() });
}
