//! The whole tick with its learner: defined for all inputs, held on bad samples, primed without a bump, and equal to
//! the controller alone if everything else is off.

use eft_core::{
    Calibration, Channel, ChannelState, Controller, ControllerInput, Input, Learner, Learning, Levels,
    Parameters, ProtectionParameters, Real, Realization, VelocitySource, status,
};
use proptest::prelude::*;

use crate::rig;

/// Whether a rig that looks ahead does not know the next command.
fn lost_ahead<T: Real>(p: &Parameters, input: &Input<T>) -> bool {
    p.feedforward && p.look_ahead && !(input.next_command.abs() <= T::splat(1.0e12))
}

/// A rig near the paper's with random switches and a velocity sensor.
fn parameters() -> impl Strategy<Value = Parameters<'static>> {
    let realization = prop::sample::select(vec![Realization::Digital, Realization::Analog]);
    (rig::parameters(), any::<[bool; 6]>(), realization).prop_map(
        |(
            p,
            [feedforward, look_ahead, supply_correction, adaptive, curve_correction, guard],
            realization,
        )| {
            let learning = Learning { adaptive, curve_correction, guard, ..Learning::OFF };
            let (valve_command, valve_command_rate) = (10.0, 2.0e4);
            Parameters {
                realization,
                feedforward,
                look_ahead,
                supply_correction,
                learning,
                valve_command,
                valve_command_rate,
                ..p
            }
        },
    )
}

/// The same with any velocity estimate, protection and check for stuck sensors.
fn guarded() -> impl Strategy<Value = Parameters<'static>> {
    // Stable at every sample rate of the strategy.
    let gains = [0.07, 10.0, 300.0];
    let source = prop::sample::select(vec![
        VelocitySource::Sensor,
        VelocitySource::Derivative { corner: 80.0 },
        VelocitySource::Observer { gains, mass: 7040.0 },
        VelocitySource::Accelerometer { gains },
    ]);
    let protection = ProtectionParameters {
        force: Levels { warning: 1.0e5, trip: 1.4e5 },
        displacement: Levels { warning: 0.1, trip: 0.12 },
        start_time: 1e-3,
        lost_samples: 3,
        ..ProtectionParameters::DEFAULT
    };
    let protection = prop::sample::select(vec![None, Some(protection)]);
    (parameters(), source, protection, 0..5_u32).prop_map(
        |(p, velocity_source, protection, stuck_samples)| Parameters {
            velocity_source,
            protection,
            stuck_samples,
            ..p
        },
    )
}

macro_rules! tests {
    ($module:ident, $t:ty, $given:path) => {
        mod $module {
            use super::*;

            proptest! {
                #[test]
                fn finite_and_held_where_a_sample_is_bad(
                    p in parameters(), samples in prop::collection::vec(rig::inputs(), 1..120),
                ) {
                    let channel = Channel::<$t, 21>::new(&p).unwrap();
                    let learner = Learner::<$t, 21>::new(&p).unwrap();
                    let (mut state, mut learned) = (channel.at_rest(), learner.at_rest());
                    let most = match p.realization {
                        Realization::Digital => 10.0,
                        // The largest compensation signal, for a step of the whole stroke.
                        Realization::Analog => 2.001 / 0.02 * 1.25 / (p.proportional_gain * p.valve_gain),
                    };
                    let mut last = channel.hold(&state).voltage;
                    for sample in samples {
                        let i = $given(&sample);
                        let out = rig::tick(&channel, &mut state, &i);
                        prop_assert!(out.voltage.abs() <= most as $t && out.compensation.is_finite());
                        let commanded = i.command.abs() <= 1.0e12;
                        let bad = !commanded || out.status & status::INVALID_MEASUREMENT != 0;
                        let share = i.supply_pressure / 1.9e7;
                        let good = commanded && i.velocity.abs() <= 3.0 && i.force.abs() <= 2.0e5
                            && i.spool.abs() <= 1.2 && (0.051..=3.99).contains(&share);
                        prop_assert!(!(good && bad), "refused a good sample");
                        let flagged = out.status & status::INVALID_COMMAND != 0;
                        prop_assert_eq!(flagged, !commanded || lost_ahead(&p, &i));
                        if bad {
                            prop_assert_eq!(out.voltage.to_bits(), (last as $t).to_bits());
                        }
                        last = out.voltage;
                        if let Some(window) = out.window {
                            channel.publish(&mut state, learner.update(&mut learned, &window));
                        }
                        let found = state.calibration();
                        prop_assert!((0.69..=1.36).contains(&found.flow_gain));
                        prop_assert!((0.79..=1.26).contains(&found.valve_gain));
                        prop_assert!((0.5..=1.0).contains(&found.level));
                        prop_assert!(found.response_delay.is_finite() && found.test_ratio.is_finite());
                        prop_assert_eq!(out.status & status::CALIBRATION_LATE, 0);
                    }
                }

                #[test]
                fn a_learner_without_evidence_begins_with_the_nominal_calibration(
                    p in guarded(), velocity_delay in prop_oneof![Just(0.0), 0.0..1.0e-2f64],
                ) {
                    let p = Parameters { velocity_delay, ..p };
                    let channel = Channel::<$t, 21>::new(&p).unwrap();
                    let learner = Learner::<$t, 21>::new(&p).unwrap();
                    let first = learner.first_calibration(&learner.at_rest());
                    prop_assert_eq!(first, Calibration::<$t>::nominal(&p).unwrap());
                    prop_assert_eq!(channel.at_rest_with(&first).integrity(), channel.at_rest().integrity());
                }

                #[test]
                fn finite_with_everything_around_it(
                    p in guarded(), samples in prop::collection::vec(rig::inputs(), 1..120),
                ) {
                    let p = Parameters { realization: Realization::Digital, ..p };
                    let channel = Channel::<$t, 21>::new(&p).unwrap();
                    let learner = Learner::<$t, 21>::new(&p).unwrap();
                    let (mut state, mut learned) = (channel.at_rest(), learner.at_rest());
                    for sample in samples {
                        let out = rig::tick(&channel, &mut state, &$given(&sample));
                        prop_assert!(out.voltage.abs() <= 10.0 && out.compensation.is_finite());
                        prop_assert!(p.protection.is_none() || out.permitted_command.is_finite());
                        prop_assert!((0.0..=1.0).contains(&out.authority));
                        if let Some(window) = out.window {
                            channel.publish(&mut state, learner.update(&mut learned, &window));
                        }
                    }
                }

                #[test]
                fn primed_it_steps_without_a_bump(
                    p in parameters(), before in prop::collection::vec(rig::inputs(), 0..40), sample in rig::inputs(),
                ) {
                    let channel = Channel::<$t, 21>::new(&p).unwrap();
                    let mut sample = $given(&sample);
                    sample.next_command = sample.command;
                    let mut state = channel.at_rest();
                    // After a lost supply pressure a deviation of the last one decreases from tick to tick.
                    let measured = (0.051..=3.99).contains(&(sample.supply_pressure / 1.9e7));
                    for before in before.iter().filter(|_| measured) {
                        rig::tick(&channel, &mut state, &$given(before));
                    }
                    channel.prime(&mut state, &sample);
                    let held = channel.hold(&state);
                    prop_assert_eq!(held.status, status::HELD);
                    let out = rig::tick(&channel, &mut state, &sample);
                    prop_assert_eq!(out.voltage.to_bits(), held.voltage.to_bits());
                    prop_assert_eq!(out.compensation.to_bits(), held.compensation.to_bits());
                }

                #[test]
                fn everything_else_off_it_is_the_controller_bit_for_bit(
                    p in parameters(), samples in prop::collection::vec(rig::inputs(), 1..120),
                ) {
                    let p = Parameters { learning: Learning::OFF, ..p };
                    let channel = Channel::<$t, 21>::new(&p).unwrap();
                    let plain = Controller::<$t, 21>::new(&p).unwrap();
                    let (mut state, mut alone) = (channel.at_rest(), plain.at_rest());
                    for sample in samples {
                        let i = $given(&sample);
                        let asked = ControllerInput {
                            command: i.command,
                            next_command: i.next_command,
                            velocity: i.velocity,
                            force: i.force,
                            spool: i.spool,
                            supply_pressure: i.supply_pressure,
                        };
                        let out = rig::tick(&channel, &mut state, &i);
                        let expected = plain.step(&mut alone, &asked, &plain.nominal(), |compensation| compensation);
                        prop_assert_eq!(out.voltage.to_bits(), expected.valve_command.to_bits());
                        prop_assert_eq!(out.compensation.to_bits(), expected.compensation.to_bits());
                        let lost = if lost_ahead(&p, &i) { status::INVALID_COMMAND } else { 0 };
                        prop_assert_eq!(out.status, expected.status | lost);
                        prop_assert!(out.window.is_none());
                    }
                }
            }
        }
    };
}
tests!(single, f32, rig::single);
tests!(double, f64, rig::double);

#[test]
fn swapping_a_configuration_changes_no_state() {
    let p = Parameters { velocity_source: VelocitySource::Sensor, ..rig::LEARNING };
    let channel = Channel::<f64, 21>::new(&p).unwrap();
    let steeper = Channel::<f64, 21>::new(&Parameters { force_sensitivity: 6.0e-5, ..p }).unwrap();
    let mut state = channel.at_rest();
    for tick in 0..100 {
        rig::tick(&channel, &mut state, &rig::SOUND.swing(f64::from(tick) / p.sample_rate, 0.0));
    }
    // At zero force the sensitivity has no effect, so both continue equally.
    let (mut one, mut other) = (state, state);
    for tick in 100..200 {
        let i = rig::SOUND.swing(f64::from(tick) / p.sample_rate, 0.0);
        assert_eq!(rig::tick(&channel, &mut one, &i), rig::tick(&steeper, &mut other, &i));
    }
    assert_eq!(one, other);
}

/// With the force loop that is designed for the paper's rig, and one flow gain.
const DESIGNED: Parameters<'static> = Parameters {
    proportional_gain: 0.2857,
    derivative_gain: 1.288e-03,
    integral_gain: 31.54,
    learning: Learning { curve_correction: false, ..Learning::ADAPTIVE },
    ..rig::LEARNING
};

#[test]
fn a_learned_calibration_outlives_prime() {
    let channel = Channel::<f64, 21>::new(&DESIGNED).unwrap();
    let learner = Learner::<f64, 21>::new(&DESIGNED).unwrap();
    let (mut state, mut learned) = (channel.at_rest(), learner.at_rest());
    let valve = rig::Valve { flow_gain: 1.06, ..rig::SOUND };
    let mut run = |state: &mut ChannelState<f64>, ticks: std::ops::Range<u32>| {
        for tick in ticks {
            let input = valve.swing(f64::from(tick) / DESIGNED.sample_rate, 0.0);
            if let Some(window) = rig::tick(&channel, state, &input).window {
                channel.publish(state, learner.update(&mut learned, &window));
            }
        }
    };
    run(&mut state, 0..8192);
    let found = *state.calibration();
    assert!((found.flow_gain - 1.06).abs() < 0.01, "{}", found.flow_gain);
    channel.prime(&mut state, &valve.swing(2.0, 0.0));
    assert_eq!(*state.calibration(), found);
    // Of the next windows, the first has the calibration that was published before, and later ones are learned.
    for tick in 8192..12_000 {
        run(&mut state, tick..tick + 1);
        assert!((state.calibration().flow_gain - found.flow_gain).abs() < 1e-3, "tick {tick}");
    }
}

#[test]
fn designed_gains_take_over_from_the_papers_without_a_bump() {
    // A learned calibration would keep the gains of the earlier configuration.
    let fixed = |p| Channel::<f64, 21>::new(&Parameters { learning: Learning::OFF, ..p }).unwrap();
    let (paper, designed) = (fixed(rig::LEARNING), fixed(DESIGNED));
    let moving = |tick: u32, error: f64| {
        let input = rig::SOUND.swing(f64::from(tick) / DESIGNED.sample_rate, 1e4);
        Input { command: input.force + error, ..input }
    };
    for error in [0.0, 300.0] {
        let [mut state, mut as_before] = [paper.at_rest(); 2];
        for tick in 0..1000 {
            rig::tick(&paper, &mut state, &moving(tick, error));
            rig::tick(&paper, &mut as_before, &moving(tick, error));
        }
        designed.take_over(&mut state);
        for tick in 1000..1100 {
            let taken = rig::tick(&designed, &mut state, &moving(tick, error)).voltage;
            let kept = rig::tick(&paper, &mut as_before, &moving(tick, error)).voltage;
            // The compensation goes on. The gains act on the force error only, and the integral begins at zero.
            let gains = DESIGNED.proportional_gain - rig::LEARNING.proportional_gain;
            let summed = DESIGNED.integral_gain * f64::from(tick - 1000) / DESIGNED.sample_rate;
            let expected = DESIGNED.force_sensitivity * error * (gains + summed);
            assert!((taken - kept - expected).abs() < 1e-9, "{error} N, tick {tick}: {taken} V, {kept} V");
        }
    }
}

#[test]
fn another_level_steps_the_compensation_as_the_lead_network_lets_it() {
    let of = |level| Parameters { level, learning: Learning::OFF, feedforward: false, ..rig::LEARNING };
    let [full, half] = [1.0, 0.5].map(|level| Channel::<f64, 21>::new(&of(level)).unwrap());
    let steady = Input { command: 500.0, velocity: 0.02, force: 500.0, spool: 0.01, ..Input::default() };
    let mut state = full.at_rest();
    full.prime(&mut state, &steady);
    let before = rig::tick(&full, &mut state, &steady).voltage;
    half.take_over(&mut state);
    let first = rig::tick(&half, &mut state, &steady).voltage;
    let settled = (0..400).fold(first, |_, _| rig::tick(&half, &mut state, &steady).voltage);
    let Parameters { response_delay, lead_alpha, sample_rate, .. } = rig::PARAMETERS;
    let (lead, half_period) = (response_delay / (1.0 - lead_alpha), 0.5 / sample_rate);
    let step = (lead + half_period) / (lead_alpha * lead + half_period);
    assert!((settled - 0.5 * before).abs() < 1e-9 && before > 0.05, "{before} V, {settled} V");
    assert!((first - before - step * (settled - before)).abs() < 1e-9, "{before} V, {first} V, {step}");
}

#[test]
fn a_held_output_repeats_the_voltage_of_a_shutdown() {
    for realization in [Realization::Digital, Realization::Analog] {
        let protection = Some(ProtectionParameters::DEFAULT);
        let p = Parameters { realization, protection, ..rig::PARAMETERS };
        let channel = Channel::<f64, 21>::new(&p).unwrap();
        let mut state = channel.at_rest();
        let (mut closing, mut open) = (0, 0.0);
        for tick in 0..3000 {
            let mut i = Input { displacement: 0.0, ..rig::SOUND.swing(0.2, 1e3) };
            if tick >= 1000 {
                (i.velocity, i.force) = (f64::NAN, f64::NAN);
            }
            let out = rig::tick(&channel, &mut state, &i);
            if tick == 999 {
                open = out.voltage;
            }
            let held = channel.hold(&state);
            assert_eq!((held.voltage, held.authority), (out.voltage, out.authority), "tick {tick}");
            if out.authority > 0.1 && out.authority < 0.9 {
                closing += 1;
                // An analog force loop closes the valve by itself.
                let closes = out.voltage.abs() < 0.95 * open.abs();
                assert_eq!(closes, realization == Realization::Digital, "{open} V, {} V", out.voltage);
            }
        }
        assert!(closing > 10 && open.abs() > 0.1, "{closing} ticks, {open} V");
    }
}

#[test]
fn a_long_soft_start_ends_on_its_sample() {
    // 60 s at 20 kHz: neither a sum nor a counter may drift.
    let protection = ProtectionParameters { start_time: 60.0, ..ProtectionParameters::DEFAULT };
    let p = Parameters { sample_rate: 20e3, protection: Some(protection), ..rig::PARAMETERS };
    let channel = Channel::<f32, 21>::new(&p).unwrap();
    let mut state = channel.at_rest();
    let mut i = rig::single(&rig::SOUND.swing(0.0, 0.0));
    // A power of two, so that the permitted command is the ramp's share exactly.
    (i.command, i.displacement) = (1024.0, 0.0);
    let mut before = 0.0;
    for tick in 1..=1_200_000_u32 {
        let permitted = rig::tick(&channel, &mut state, &i).permitted_command;
        assert!(permitted >= before, "tick {tick} falls");
        if tick % 120_000 == 0 {
            let share = f64::from(permitted) / 1024.0 * 1.2e6;
            assert!((share - f64::from(tick)).abs() < 1.0, "tick {tick}: {share}");
        }
        before = permitted;
    }
    assert_eq!(before, 1024.0);
    state.end();
    let fall = Parameters { protection: Some(ProtectionParameters { ramp_time: 60.0, ..protection }), ..p };
    let channel = Channel::<f32, 21>::new(&fall).unwrap();
    let down = (1..=1_200_000_u32).find(|_| {
        rig::tick(&channel, &mut state, &i);
        state.is_down()
    });
    assert_eq!(down, Some(1_200_000));
}

#[test]
fn a_command_known_in_advance_replaces_the_late_force_in_the_load_pressure_correction() {
    let opening = |look_ahead: bool, force: f64, next_command: f64| {
        let p = Parameters { feedforward: true, look_ahead, ..rig::PARAMETERS };
        let channel = Channel::<f64, 21>::new(&p).unwrap();
        let input =
            Input { command: 2e4, next_command, velocity: 0.2, force, spool: 0.15, ..Input::default() };
        let mut state = channel.at_rest();
        (0..2000).fold(f64::NAN, |_, _| rig::tick(&channel, &mut state, &input).compensation)
    };
    let (measured, known) = (opening(false, 2e4, 2e4), opening(true, 2e4, 2e4));
    assert!((known - measured).abs() < 1e-9, "{known} {measured}");
    // The measured force acts through the force loop only.
    assert!((opening(true, 5e3, 2e4) - known).abs() < 1e-12);
    // Eq. (6): a lower force needs a smaller opening for the same flow.
    assert!(opening(false, 5e3, 2e4) < 0.97 * measured);
    // A lost next command leaves the last valid one, here that at rest.
    assert!(opening(true, 2e4, f64::NAN) < 0.95 * known);
}
