//! Which of force and spool is named when the flow above the motion's frequencies contradicts them.

use super::*;
use crate::protection::gate::SPOOL;

/// Time (s) from which on a reading is wrong. The force is near zero then.
const WRONG: f64 = 0.4;

/// A valve whose gain and delay are these factors of the model's.
struct Valve {
    gain: f64,
    delay: f64,
}

const AS_MODELLED: Valve = Valve { gain: 1.0, delay: 1.0 };

/// What the readings of force (N) and spool (1) are made of: their noise and their true values.
type Reading = fn([f64; 2], [f64; 2]) -> [f64; 2];

/// The sensor that is named with a blocked piston whose valve swings by an opening (1) at a frequency (Hz).
fn held(valve: &Valve, [size, frequency]: [f64; 2], known: &Control<f64>, wrong: Reading) -> Option<Cause> {
    let mut watch = watch();
    // No overlap.
    watch.balance.null_drift = 0.0;
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let lag = 1.0 / (1.0 + 0.5 * valve.delay * RIG.response_delay * RIG.sample_rate + 0.5);
    let (mut state, mut first, mut opening, mut force) = (PlausibilityState::default(), 0.0, 0.0, 0.0);
    let mut read: Reading = |noise, truth| [truth[0] + noise[0], truth[1] + noise[1]];
    (0..(1.5 * RIG.sample_rate) as u32).find_map(|n| {
        let time = f64::from(n) * STEP;
        let commanded = size * libm::sin(core::f64::consts::TAU * frequency * time);
        first += lag * (valve.gain * commanded - first);
        let last = opening;
        opening += lag * (first - opening);
        let flow = table.flow(0.5 * (last + opening)) - RIG.leakage / RIG.piston_area * force;
        let before = force;
        force += STEP * flow * RIG.piston_area / RIG.compressibility;
        if time > WRONG && force * before <= 0.0 {
            read = wrong;
        }
        let uneven = libm::sin(f64::from(n) * f64::from(n));
        let [force, spool] = read([78.0 * uneven, 5e-4 * uneven], [force, opening]);
        let (velocity, displacement) = (5e-4 * uneven, 6e-5 * uneven);
        let input = Input { force, spool, displacement, velocity, ..Input::default() };
        let input = watch.gate(&mut state, &input);
        let valve_command = commanded * known.valve_command;
        match watch.judge(&mut state, &input, input.velocity, &Control { valve_command, ..*known }) {
            Cause::None => None,
            cause => Some(cause),
        }
    })
}

/// With a valve command that is known.
const KNOWN: Control<f64> = Control { valve_command: 1.0 / RIG.valve_gain, ..CONTROL };

#[test]
fn a_spool_that_leaves_the_valves_model_is_named_in_place_of_the_force() {
    let dead: Reading = |noise, truth| [truth[0] + noise[0], noise[1]];
    let small: Reading = |noise, truth| [truth[0] + noise[0], 0.2 * truth[1] + noise[1]];
    let large: Reading = |noise, truth| [truth[0] + noise[0], 2.4 * truth[1] + noise[1]];
    let off: Reading = |noise, truth| [truth[0] + noise[0], truth[1] + 0.02 + noise[1]];
    for (swing, wrong) in [
        ([0.03, 18.0], dead),
        ([0.03, 25.0], dead),
        ([0.03, 25.0], small),
        ([0.03, 35.0], small),
        ([0.03, 25.0], large),
        ([0.03, 35.0], large),
        ([0.01, 6.0], off),
        ([0.01, 3.0], off),
    ] {
        assert_eq!(held(&AS_MODELLED, swing, &KNOWN, wrong), Some(Cause::SpoolImplausible), "{swing:?}");
        // Without the valve command, and after a trip, nothing tells that the spool is wrong.
        for control in [CONTROL, Control { tripped: true, ..KNOWN }] {
            let found = held(&AS_MODELLED, swing, &control, wrong);
            assert_eq!(found, Some(Cause::ForceImplausible), "{swing:?}");
        }
    }
}

#[test]
fn a_wrong_force_is_named_although_the_valves_model_is_wrong() {
    let turned: Reading = |noise, truth| [-truth[0] - noise[0], truth[1] + noise[1]];
    let dead: Reading = |noise, truth| [noise[0], truth[1] + noise[1]];
    for frequency in [18.0, 25.0, 35.0] {
        for gain in [0.8, 1.0, 1.25] {
            for delay in [0.5, 1.0, 1.5] {
                for wrong in [turned, dead] {
                    let found = held(&Valve { gain, delay }, [0.03, frequency], &KNOWN, wrong);
                    assert_eq!(found, Some(Cause::ForceImplausible), "{frequency} {gain} {delay}");
                }
            }
        }
    }
}

#[test]
fn gain_delay_noise_and_hysteresis_of_the_valve_are_tolerated() {
    let watch = watch();
    for (size, lag) in [(0.01, 0.0), (0.1, 0.0), (-0.1, 0.0), (0.1, 0.03), (-0.1, 0.03), (0.1, -0.03)] {
        // Three deviations of the noise, and the hysteresis.
        let most = 0.2 * f64::abs(size) + f64::abs(lag) + 3.0 * 5e-4 + 2.5e-3;
        for (share, departs) in [(0.999, false), (1.001, true)] {
            // Of the larger swing.
            let smaller = size - f64::copysign(share * most, size);
            for [measured, modelled] in [[size, smaller], [smaller, size]] {
                let mut state = PlausibilityState::<f64>::default();
                // A null bias is no part of the swings.
                let null = 0.02;
                (state.signals[SPOOL].last, state.stroke.measured) = (null + measured, null);
                (state.stroke.opening, state.stroke.commanded) = (modelled, 0.0);
                state.stroke.first = modelled + lag;
                assert_eq!(watch.spool_departs(&state, &KNOWN), departs, "{size} {lag} {share}");
                assert!(!watch.spool_departs(&state, &CONTROL));
            }
        }
    }
}
