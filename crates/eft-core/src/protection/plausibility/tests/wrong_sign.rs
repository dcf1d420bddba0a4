//! Readings of wrong sign, beside those that only look like one.

use super::*;

#[test]
fn the_flow_separates_a_wrong_sign_from_a_right_one() {
    let displacement = swing_by(-1.0, 1.0, STEP).unwrap();
    let velocity = swing_by(1.0, -1.0, STEP).unwrap();
    assert_eq!([displacement.1, velocity.1], [Cause::DisplacementImplausible, Cause::VelocityImplausible]);
    assert!(displacement.0 < 1.07 && velocity.0 < 1.07, "{displacement:?} {velocity:?}");
}

/// The swing at a twentieth of its speed, with a null bias (1) of the valve and with noise, and with these signs of
/// displacement and velocity from 1 s on, when the piston is at rest and a wrong sign is no jump.
fn slow_swing(bias: f64, [of_displacement, of_velocity]: [f64; 2]) -> Option<(f64, Cause)> {
    let noise = PlausibilityParameters { displacement_noise: 2e-4, ..PlausibilityParameters::DEFAULT };
    let random = core::cell::Cell::new(20051_u64);
    // Twelve uniform numbers have the variance of one.
    let deviation = || {
        (0..12).fold(-6.0, |sum, _| {
            random.set(random.get().wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1));
            sum + (random.get() >> 11) as f64 / (1_u64 << 53) as f64
        })
    };
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    named_by(&watch_of(1.2, &noise), 3.0, |time| {
        let [force, x, v, _] = swing(time).map(|reading| 0.05 * reading);
        let [of_x, of_v] = if time > 1.0 { [of_displacement, of_velocity] } else { [1.0; 2] };
        let displacement = of_x * (x + noise.displacement_noise * deviation());
        let velocity = of_v * (v + noise.velocity_noise * deviation());
        [force, displacement, velocity, table.opening(RIG.piston_area * v) - bias]
    })
}

#[test]
fn the_flow_separates_a_wrong_sign_from_a_right_one_in_a_slow_motion() {
    for bias in [-0.02, 0.0, 0.02] {
        assert_eq!(slow_swing(bias, [1.0, 1.0]), None);
        let found = [[-1.0, 1.0], [1.0, -1.0]].map(|signs| slow_swing(bias, signs).unwrap());
        assert_eq!(
            found.map(|(_, cause)| cause),
            [Cause::DisplacementImplausible, Cause::VelocityImplausible],
            "{bias}"
        );
        assert!(found.iter().all(|(time, _)| (1.0..1.6).contains(time)), "{found:?}");
    }
}

/// A spool that follows a command of this opening and frequency (Hz) about a null bias (1), with a delay (s) besides
/// the valve's, and reads with the wrong sign from 1 s on if asked to. Piston and force are at rest.
fn follows(opening: f64, frequency: f64, bias: f64, latency: f64, turns: bool) -> Option<(f64, Cause)> {
    let watch = watch();
    let mut state = PlausibilityState::default();
    let swing = |time: f64| opening * libm::sin(core::f64::consts::TAU * frequency * time.max(0.0));
    (0..(4.0 * RIG.sample_rate) as u32).find_map(|n| {
        let time = f64::from(n) * STEP;
        let control = Control { valve_command: swing(time) / RIG.valve_gain, flow_gain: 0.0, ..CONTROL };
        let spool = bias + swing(time - RIG.response_delay - latency);
        let sign = if turns && time > 1.0 { -1.0 } else { 1.0 };
        let input = Input { force: 0.0, displacement: 0.0, spool: sign * spool, ..Input::default() };
        match watch.judge(&mut state, &input, 0.0, &control) {
            Cause::None => None,
            cause => Some((time, cause)),
        }
    })
}

#[test]
fn a_spool_of_wrong_sign_is_noticed_at_openings_within_an_overlap() {
    for (opening, frequency) in [(0.016, 1.5), (0.01, 2.5), (0.009, 4.75), (0.012, 9.0)] {
        for bias in [0.0, 0.01] {
            let (time, cause) = follows(opening, frequency, bias, 0.0, true).unwrap();
            assert_eq!(cause, Cause::SpoolImplausible);
            assert!((1.0..1.6).contains(&time), "{opening} {frequency} {bias}: {time}");
        }
    }
    for (frequency, latency) in [(1.5, 4e-3), (4.75, -4e-3), (9.0, 4e-3), (20.0, 3e-3), (40.0, 2e-3)] {
        for bias in [-0.02, 0.02] {
            assert_eq!(follows(0.1, frequency, bias, latency, false), None, "{frequency} {latency} {bias}");
        }
    }
}

/// A blocked piston with the spool swinging about null. There is no flow within an overlap (1), and the load cell reads
/// a share of the force.
fn held(overlap: f64, share: impl Fn(f64) -> f64) -> Option<(f64, Cause)> {
    const SAMPLES: usize = 4096;
    let spool = |time: f64| 0.015 * libm::sin(core::f64::consts::TAU * 25.0 * time);
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let mut forces = [0.0_f64; SAMPLES];
    for n in 1..SAMPLES {
        let opening = spool((n as f64 - 0.5) * STEP);
        let beyond = (opening.abs() - overlap).max(0.0).copysign(opening);
        let flow = table.flow(beyond) - RIG.leakage / RIG.piston_area * forces[n - 1];
        forces[n] = forces[n - 1] + STEP * flow * RIG.piston_area / RIG.compressibility;
    }
    named(1.0, |time| {
        let force = forces[(time * RIG.sample_rate + 0.5) as usize];
        [share(time) * force, 0.01, 0.0, spool(time)]
    })
}

#[test]
fn a_force_of_wrong_sign_is_noticed_near_null_and_an_overlap_is_not() {
    for overlap in [0.0, 0.005, 0.01] {
        assert_eq!(held(overlap, |_| 1.0), None, "{overlap}");
    }
    // At zero force, so that no reading jumps.
    let start = 0.4;
    let (time, cause) = held(0.0, |time| if time > start { -1.0 } else { 1.0 }).unwrap();
    assert_eq!(cause, Cause::ForceImplausible);
    assert!((start..start + 0.02).contains(&time), "{time}");
}

/// The time at which the watch names a cause after a null bias (1) has its full flow from the first sample on. The
/// piston is blocked at a force (N), and the force changes until the spool has compensated for the bias.
fn biased(bias: f64, force: f64) -> Option<(f64, Cause)> {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let settles = 4e-3;
    let most = table.flow(bias) * settles * RIG.piston_area / RIG.compressibility;
    named(1.0, |time| {
        let left = libm::exp(-time / settles);
        let force = force + most * (1.0 - left);
        let leaked = RIG.leakage / RIG.piston_area * force;
        let root = libm::sqrt(1.0 - bias.signum() * force / (RIG.piston_area * RIG.supply_pressure));
        [force, 0.02, 0.0, table.opening((table.flow(bias) * left + leaked) / root) - bias]
    })
}

#[test]
fn neither_a_null_bias_from_the_first_sample_nor_a_dead_load_is_a_wrong_force() {
    for bias in [-0.03, -0.02, -0.01, 0.01, 0.02, 0.03] {
        for force in [-20e3, 0.0, 5e3, 20e3] {
            assert_eq!(biased(bias, force), None, "{bias} {force}");
        }
    }
}
