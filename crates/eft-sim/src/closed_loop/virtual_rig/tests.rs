use super::*;
use crate::closed_loop::{RigChannel, parameters, simulate};
use crate::ground_motion::excitation::sine_sweep;

type Changes<'a> = &'a [(&'a str, toml::Value)];

fn rig(changes: Changes<'_>) -> RigConfig {
    let digital = RigConfig::zhao2005().replace(&[("controller.realization", "digital".into())]).unwrap();
    digital.replace(changes).unwrap()
}

/// Rigs on the fast path and beyond it, with every instrument, protection and learner.
fn rigs() -> Vec<RigConfig> {
    let noisy: Changes<'_> = &[
        ("sensors.force.noise", 20.0.into()),
        ("sensors.force.delay", 2.into()),
        ("sensors.velocity.bandwidth", 300.0.into()),
        ("sensors.velocity.noise", 1e-3.into()),
        ("sensors.spool.dropout", 0.01.into()),
        ("dac.delay", 3.into()),
        ("dac.range", 10.0.into()),
    ];
    let protected: Changes<'_> = &[
        ("protection.enabled", true.into()),
        ("protection.displacement_trip", 1e-3.into()),
        ("actuator.bypass_flow", 1e-3.into()),
        ("actuator.friction", 50.0.into()),
    ];
    let adaptive: Changes<'_> =
        &[("compensation.adaptive", true.into()), ("truth.servovalve.flow_gain_scale", 0.8.into())];
    [&[], noisy, protected, adaptive].map(rig).to_vec()
}

#[test]
fn controller_and_rig_in_turn_give_the_test() {
    let command = sine_sweep(4000.0, 0.5, 6.0, 2.0, 4096.0).unwrap();
    for rig in rigs() {
        let run = simulate::<f64>(&rig, &command, &SimulateOptions::default(), |_, _| true).unwrap();
        let mut channel = RigChannel::<f64>::new(&parameters(&rig, 4096.0).unwrap()).unwrap();
        let mut stand = VirtualRig::new(&rig).unwrap();
        for (i, value) in command.values.iter().enumerate() {
            // Stored and brought back on the way, into others.
            if i % 1000 == 777 {
                let (state, learned) = (stand.state(), channel.state());
                stand = VirtualRig::new(&rig).unwrap();
                channel = RigChannel::new(&parameters(&rig, 4096.0).unwrap()).unwrap();
                stand.go_to(&state).unwrap();
                channel.go_to(&learned).unwrap();
            }
            let now = stand.reading();
            assert_eq!(now.truth.force.to_bits(), run.force[i].to_bits(), "sample {i}");
            let next = command.values.get(i + 1).copied().unwrap_or(*value);
            let measured = stand.measured.input(*value, next, 0.0);
            let out = channel.step(&measured);
            stand.step(out.voltage, out.status & status::TRIPPED != 0).unwrap();
            if let Some(estimate) = run.flow_gain_estimate.get(i) {
                assert_eq!(channel.estimates(&rig)[0], ("flow_gain_estimate", *estimate));
            }
        }
    }
}

#[test]
fn bad_commands_and_states_are_named_and_change_nothing() {
    let mut stand = VirtualRig::new(&rig(&[])).unwrap();
    stand.step(0.1, false).unwrap();
    let state = stand.state();
    let text = |result: Result<()>| result.unwrap_err().to_string();
    assert!(text(stand.step(f64::NAN, false)).starts_with("valve_command = NaN"));
    assert!(text(stand.go_to(&state[1..])).starts_with("state = 18 numbers"));
    assert_eq!(stand.state(), state);
    assert!(text(stand.step(f64::MAX, false)).contains("diverge"));
}
