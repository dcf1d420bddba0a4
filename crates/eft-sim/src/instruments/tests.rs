use super::*;
use crate::config::RigConfig;

const RATE: f64 = 4096.0;
const STILL: Signals<f64> = Signals {
    displacement: 0.0,
    velocity: 0.0,
    force: 0.0,
    spool: 0.0,
    supply_pressure: 0.0,
    acceleration: 0.0,
    load_pressure: 0.0,
};

fn rig(changes: &[(&str, toml::Value)]) -> RigConfig {
    RigConfig::zhao2005().replace(changes).unwrap()
}

fn sensors(changes: &[(&str, toml::Value)], actuator: u64) -> Option<Sensors<f64>> {
    let rig = rig(changes);
    Sensors::new(&|_| &rig, RATE, actuator)
}

/// Readings of a force that rises by 1 N per tick.
fn ramp(changes: &[(&str, toml::Value)], ticks: usize) -> Vec<f64> {
    let mut sensors = sensors(changes, 0).unwrap();
    let truth = |tick: usize| Signals { force: tick as f64, supply_pressure: 1.9e7, ..STILL };
    (0..ticks).map(|tick| sensors.read(&truth(tick)).0.force).collect()
}

#[test]
fn ideal_sensors_are_not_simulated() {
    assert!(sensors(&[], 0).is_none());
}

#[test]
fn delay_is_in_samples_and_starts_at_rest() {
    assert_eq!(ramp(&[("sensors.force.delay", 3.into())], 6), [0.0, 0.0, 0.0, 0.0, 1.0, 2.0]);
}

#[test]
fn gain_bias_range_and_resolution() {
    let scaled = ramp(&[("sensors.force.gain", 0.5.into()), ("sensors.force.bias", 5.0.into())], 3);
    assert_eq!(scaled, [5.0, 5.5, 6.0]);
    assert_eq!(ramp(&[("sensors.force.bias", 5.0.into())], 3), [5.0, 6.0, 7.0]);
    assert_eq!(ramp(&[("sensors.force.range", 1.5.into())], 3), [0.0, 1.0, 1.5]);
    let coarse = ramp(&[("sensors.force.range", 8.0.into()), ("sensors.force.bits", 3.into())], 9);
    // Eight codes over ±8 N, a step of 2 N.
    assert_eq!(coarse, [0.0, 2.0, 2.0, 4.0, 4.0, 6.0, 6.0, 6.0, 6.0]);
}

#[test]
fn bandwidth_lags_a_ramp_by_its_time_constant() {
    let mut sensors = sensors(&[("sensors.velocity.bandwidth", 100.0.into())], 0).unwrap();
    let read = |tick: u32| sensors.read(&Signals { velocity: f64::from(tick), ..STILL }).0.velocity;
    let last = (0..4096).map(read).last().unwrap();
    let lag = RATE / (std::f64::consts::TAU * 100.0);
    assert!((last - (4095.0 - lag)).abs() < 1e-6);
}

#[test]
fn noise_has_its_deviation_and_no_memory() {
    let read = ramp(&[("sensors.force.noise", 20.0.into())], 20_000);
    let errors: Vec<f64> = read.iter().enumerate().map(|(i, r)| r - i as f64).collect();
    let power = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
    assert!((power.sqrt() / 20.0 - 1.0).abs() < 0.02);
}

#[test]
fn the_share_of_lost_samples_is_the_configured_one() {
    let lost = ramp(&[("sensors.force.dropout", 0.1.into())], 20_000).iter().filter(|r| r.is_nan()).count();
    assert!((1830..2170).contains(&lost), "{lost}");
}

#[test]
fn faults_start_and_end_on_their_tick() {
    let fault = |kind| ramp(&fault(kind, 2.0, 2.0), 6);
    assert_eq!(fault("zero"), [0.0, 1.0, 0.0, 0.0, 4.0, 5.0]);
    assert_eq!(fault("sign"), [0.0, 1.0, -2.0, -3.0, 4.0, 5.0]);
    assert_eq!(fault("stuck"), [0.0, 1.0, 1.0, 1.0, 4.0, 5.0]);
    assert_eq!(fault("gain"), [0.0, 1.0, 3.0, 4.5, 4.0, 5.0]);
    assert!(fault("lost")[2..4].iter().all(|r| r.is_nan()));
    assert_eq!(fault("dead"), [0.0, 1.0, 0.0, 0.0, 4.0, 5.0]);
    assert_eq!(fault("offset"), [0.0, 1.0, 3.5, 4.5, 4.0, 5.0]);
    assert_eq!(fault("drift"), [0.0, 1.0, 2.0, 5.0, 4.0, 5.0]);
}

/// A fault of the load cell over some ticks: a gain, an offset or a noise of 1.5, a drift of 2 N per tick.
fn fault(kind: &str, start: f64, ticks: f64) -> Vec<(&str, toml::Value)> {
    let size = match kind {
        "gain" => Some(("sensors.fault.gain", 1.5.into())),
        "offset" => Some(("sensors.fault.offset", 1.5.into())),
        "drift" => Some(("sensors.fault.drift", (2.0 * RATE).into())),
        "noise" => Some(("sensors.fault.noise", 1.5.into())),
        _ => None,
    };
    let changes = [
        ("sensors.fault.signal", "force".into()),
        ("sensors.fault.kind", kind.into()),
        ("sensors.fault.start", (start / RATE).into()),
        ("sensors.fault.duration", (ticks / RATE).into()),
    ];
    changes.into_iter().chain(size).collect()
}

#[test]
fn a_dead_sensor_reads_its_bias_and_noise() {
    let sensor = [("sensors.force.noise", 20.0.into()), ("sensors.force.bias", 5.0.into())];
    let still = (0..100).zip(ramp(&sensor, 100)).map(|(tick, read)| read - f64::from(tick));
    let dead = ramp(&[&sensor[..], &fault("dead", 0.0, 100.0)].concat(), 100);
    assert!(still.zip(dead).all(|(error, read)| (error - read).abs() < 1e-12));
}

#[test]
fn noise_of_a_fault_has_its_deviation_and_is_none_of_the_sensors() {
    const TICKS: usize = 20_000;
    let sensor = [("sensors.force.noise", 1.5.into())];
    let [own, both] =
        [vec![], fault("noise", 0.0, 1e6)].map(|one| ramp(&[&sensor[..], &one].concat(), TICKS));
    let pairs = || own.iter().zip(&both).enumerate().map(|(i, (own, both))| (own - i as f64, both - own));
    let mean = |product: fn((f64, f64)) -> f64| pairs().map(product).sum::<f64>() / TICKS as f64;
    // Four standard errors of each estimate.
    let error = 4.0 / (TICKS as f64).sqrt();
    assert!((mean(|(_, added)| added * added) / 2.25 - 1.0).abs() < error * 2f64.sqrt());
    assert!((mean(|(own, added)| own * added) / 2.25).abs() < error);
    assert_eq!(both, ramp(&[&sensor[..], &fault("noise", 0.0, 1e6)].concat(), TICKS));
}

#[test]
fn a_disturbed_output_stays_within_the_range() {
    let range = [("sensors.force.range", 3.0.into())];
    for (kind, expected) in [("offset", [1.5, 2.5, 3.0]), ("drift", [0.0, 3.0, 3.0])] {
        assert_eq!(ramp(&[&range[..], &fault(kind, 0.0, 9.0)].concat(), 3), expected, "{kind}");
    }
}

#[test]
fn two_actuators_have_noise_of_their_own() {
    let other = sensors(&[("sensors.force.noise", 20.0.into())], 1).unwrap();
    let mine = sensors(&[("sensors.force.noise", 20.0.into())], 0).unwrap();
    let read = |mut sensors: Sensors<f64>| sensors.read(&STILL).0.force;
    assert_ne!(read(other), read(mine), "two actuators share a stream");
}
