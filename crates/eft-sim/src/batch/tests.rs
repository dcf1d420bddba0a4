use super::*;
use crate::excitation::sine_sweep;

fn rig(changes: &[(&str, toml::Value)]) -> RigConfig {
    RigConfig::zhao2005().replace(changes).unwrap()
}

#[test]
fn one_that_fails_loses_no_other_and_the_order_stays() {
    let command = sine_sweep(8900.0, 0.0, 10.0, 0.5, 4096.0).unwrap();
    let (good, bad) = (RigConfig::zhao2005(), {
        let mut rig = RigConfig::zhao2005();
        rig.structure.mass = -1.0;
        rig
    });
    let rigs = [&good, &bad, &good];
    let tests = rigs.map(|rig| Test { rig, command: &command });
    let outcomes = simulate_batch::<f64>(&tests, &BatchOptions::default(), |_, _| true).unwrap();
    assert!(outcomes[1].as_ref().unwrap_err().to_string().starts_with("structure.mass = -1"));
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
