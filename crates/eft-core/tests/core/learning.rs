//! The estimates of a channel with its learner inline.

use eft_core::{Calibration, Channel, Learner, Learning, Parameters, Realization, status};

use crate::rig::{self, SOUND, Valve};

/// With an analog force loop, whose valve command is sampled, so that the measurements do not depend on the estimates.
const BESIDE: Parameters<'static> = Parameters { realization: Realization::Analog, ..rig::LEARNING };

macro_rules! tests {
    ($module:ident, $t:ty, $given:path) => {
        mod $module {
            use super::*;

            /// After some seconds of swinging: the calibration in use, the learner, and the last flags.
            fn learned(
                p: &Parameters,
                valve: Valve,
                force_per_velocity: f64,
                seconds: f64,
            ) -> (Calibration<$t>, Learner<$t, 21>, u32) {
                let channel = Channel::<$t, 21>::new(p).unwrap();
                let learner = Learner::<$t, 21>::new(p).unwrap();
                let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
                let mut flags = 0;
                for tick in 0..(seconds * p.sample_rate) as u32 {
                    let i = $given(&valve.swing(f64::from(tick) / p.sample_rate, force_per_velocity));
                    let out = rig::tick(&channel, &mut state, &i);
                    flags = out.status;
                    if let Some(window) = out.window {
                        channel.publish(&mut state, learner.update(&mut memory, &window));
                    }
                }
                (*state.calibration(), learner, flags)
            }

            #[test]
            fn a_valve_is_found() {
                let flow = Valve { flow_gain: 1.06, ..SOUND };
                let (found, ..) = learned(&BESIDE, flow, 0.0, 3.0);
                assert!((found.flow_gain - 1.06).abs() < 0.01, "{found:?}");
                assert!((found.flow_gain * found.per_flow_gain - 1.0).abs() < 1e-6, "{found:?}");
                let spool = Valve { valve_gain: 1.05, delay: 7.0e-3, ..SOUND };
                let quiet = Learning { guard: false, ..Learning::ADAPTIVE };
                let p = Parameters { feedforward: false, learning: quiet, ..BESIDE };
                let (found, ..) = learned(&p, spool, 0.0, 3.0);
                assert!((found.valve_gain - 1.05).abs() < 0.01, "{found:?}");
                // The sampled command contains the lead network's voltage one sample later.
                let whole = 7.0e-3 + 1.0 / 4096.0;
                assert!((f64::from(found.response_delay) - whole).abs() < 1e-4, "{found:?}");
            }

            #[test]
            fn a_guard_alone_lowers_the_level_only() {
                let p = Parameters { learning: Learning { guard: true, ..Learning::OFF }, ..BESIDE };
                let nominal = Calibration::<$t>::nominal(&p).unwrap();
                assert_eq!(
                    (nominal.null_offset, nominal.null_signal, nominal.velocity_delay),
                    (0.0, 0.0, 0.0)
                );
                let (found, _, flags) = learned(&p, SOUND, 2.0e4, 3.0);
                assert!(found.level < 0.99, "{found:?}");
                assert_ne!(flags & status::LEVEL_REDUCED, 0);
                assert_eq!((found.flow_gain, found.valve_gain, found.curve), (1.0, 1.0, nominal.curve));
                assert_eq!(found.response_delay, nominal.response_delay);
            }

            #[test]
            fn found_flow_is_the_table_times_what_was_found() {
                for (curve_correction, tolerance) in [(false, 0.01), (true, 0.02)] {
                    let learning = Learning { curve_correction, ..Learning::ADAPTIVE };
                    let p = Parameters { learning, ..BESIDE };
                    let (found, learner, _) = learned(&p, Valve { flow_gain: 0.95, ..SOUND }, 0.0, 10.0);
                    for opening in [-0.25, 0.25] {
                        let flow = f64::from(learner.found_flow(&found, opening as $t));
                        let share = flow / rig::table().flow(opening);
                        assert!((share - 0.95).abs() < tolerance, "{opening}: {share}");
                    }
                    assert!(learner.found_flow(&found, <$t>::NAN).is_nan());
                    let end = |opening| learner.found_flow(&found, opening).to_bits();
                    assert_eq!([end(2.0), end(<$t>::INFINITY)], [end(1.0); 2]);
                }
            }

            #[test]
            fn estimates_from_a_stuck_sensor_are_discarded() {
                let p = Parameters { learning: Learning { guard: false, ..Learning::ADAPTIVE }, ..BESIDE };
                let channel = Channel::<$t, 21>::new(&p).unwrap();
                let learner = Learner::<$t, 21>::new(&p).unwrap();
                let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
                let (mut frozen, mut farthest) = (false, 0.0);
                for tick in 0..20_000_u32 {
                    let mut i =
                        $given(&Valve { flow_gain: 1.06, ..SOUND }.swing(f64::from(tick) / 4096.0, 0.0));
                    if (8500..9500).contains(&tick) {
                        i.velocity = 0.1;
                    }
                    let out = rig::tick(&channel, &mut state, &i);
                    frozen |= out.status & status::ADAPTATION_FROZEN != 0;
                    if let Some(window) = out.window {
                        channel.publish(&mut state, learner.update(&mut memory, &window));
                    }
                    if tick > 8000 {
                        let off = (state.calibration().flow_gain - 1.06).abs();
                        farthest = if off > farthest { off } else { farthest };
                    }
                }
                assert!(frozen && farthest < 0.03, "{farthest}");
                assert!((state.calibration().flow_gain - 1.06).abs() < 0.01, "{:?}", state.calibration());
            }
        }
    };
}
tests!(single, f32, rig::single);
tests!(double, f64, rig::double);

#[test]
fn a_closed_valve_passes_what_its_table_says() {
    let (openings, flows) = (&[-1.0, 0.0, 1.0], &[-7.0e-3, 1.0e-3, 9.0e-3]);
    let p = Parameters { openings, flows, ..BESIDE };
    let learner = Learner::<f64, 21>::new(&p).unwrap();
    let flow = learner.found_flow(&Calibration::<f64>::nominal(&p).unwrap(), 0.0);
    assert!((flow - 1.0e-3).abs() < 1e-12, "{flow}");
}

#[test]
fn flow_gain_is_found_at_every_sample_rate_that_is_allowed() {
    for sample_rate in [200.0, 256.0, 1024.0, 20_000.0] {
        let p = Parameters { sample_rate, ..BESIDE };
        let channel = Channel::<f64, 21>::new(&p).unwrap();
        let learner = Learner::<f64, 21>::new(&p).unwrap();
        let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
        for tick in 0..(10.0 * sample_rate) as u32 {
            let i = Valve { flow_gain: 1.06, ..SOUND }.swing(f64::from(tick) / sample_rate, 0.0);
            if let Some(window) = rig::tick(&channel, &mut state, &i).window {
                channel.publish(&mut state, learner.update(&mut memory, &window));
            }
        }
        let found = state.calibration().flow_gain;
        assert!((found - 1.06).abs() < 0.01, "{sample_rate} Hz: {found}");
    }
    let slow = Parameters { sample_rate: 199.0, ..BESIDE };
    for refused in [Channel::<f64, 21>::new(&slow).unwrap_err(), Learner::<f64, 21>::new(&slow).unwrap_err()]
    {
        assert!(refused.to_string().starts_with("sample_rate = 199: must lie in [200, "), "{refused}");
    }
    // Without learning there is no lowest rate.
    let off = Parameters { sample_rate: 10.0, learning: Learning::OFF, ..BESIDE };
    assert_eq!(Channel::<f64, 21>::new(&off).unwrap().window_ticks(), 0);
}

/// The time (s) without learning after the window of this number, which has a lost sample or does not reach the
/// learner.
fn without_learning(at: u32, lost: bool) -> f64 {
    let p = Parameters { learning: Learning { guard: false, ..Learning::ADAPTIVE }, ..BESIDE };
    let channel = Channel::<f64, 21>::new(&p).unwrap();
    let learner = Learner::<f64, 21>::new(&p).unwrap();
    let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
    let (window, mut frozen) = (channel.window_ticks(), 0);
    for tick in 0..8192 {
        let mut i = SOUND.swing(f64::from(tick) / p.sample_rate, 0.0);
        if lost && tick == at * window + 3 {
            i.spool = f64::NAN;
        }
        if let Some(closed) = rig::tick(&channel, &mut state, &i).window
            && (lost || closed.number != at)
        {
            let found = learner.update(&mut memory, &closed);
            // The jump at the start may be rejected.
            if closed.number > 200 && found.status & status::ADAPTATION_FROZEN != 0 {
                assert!(closed.number >= at, "window {}", closed.number);
                frozen += 1;
            }
        }
    }
    f64::from(frozen * window) / p.sample_rate
}

#[test]
fn nothing_is_learned_for_a_tenth_of_a_second_after_lost_samples_and_windows() {
    for lost in [true, false] {
        let time = without_learning(300, lost);
        assert!((0.1..0.11).contains(&time), "{lost}: {time}");
    }
}

/// In another unit it differs by much more, and the squares of a smaller one would overflow in `f32`.
#[test]
fn a_flow_gain_far_from_the_flow_table_is_refused() {
    let greatest = 536.2 * rig::IN3;
    for (share, expected) in [(0.9e-3, false), (1.1e-3, true), (0.9e3, true), (1.1e3, false), (1e-9, false)] {
        let p = Parameters { flow_gain: share * greatest, ..rig::LEARNING };
        let made = Learner::<f32, 21>::new(&p);
        assert_eq!(rig::refused(made), if expected { "accepted" } else { "flow_gain" }, "{share}");
        // The linear scheme has no table.
        let p = Parameters { mode: eft_core::Mode::Linear, ..p };
        assert!(Learner::<f32, 21>::new(&p).is_ok(), "{share}");
    }
}

#[test]
fn impossible_learning_parameters_are_refused_by_name() {
    let l = Learning::ADAPTIVE;
    let with = |learning| Parameters { learning, ..BESIDE };
    for (name, parameters) in [
        ("accepted", BESIDE),
        ("excitation", with(Learning { excitation: f64::NAN, ..l })),
        ("excitation", with(Learning { excitation: 0.0, ..l })),
        ("flow_gain_bounds", with(Learning { flow_gain_bounds: [1.3, 0.7], ..l })),
        ("flow_gain_bounds", with(Learning { flow_gain_bounds: [-1.0, 1.3], ..l })),
        ("flow_gain_bounds", with(Learning { flow_gain_bounds: [0.009, 1.3], ..l })),
        ("valve_gain_bounds", with(Learning { valve_gain_bounds: [f64::NAN; 2], ..l })),
        ("valve_gain_bounds", with(Learning { valve_gain_bounds: [0.7, 101.0], ..l })),
        ("response_delay_bounds", with(Learning { response_delay_bounds: [0.2, 1e4], ..l })),
        ("lead_alpha", Parameters { response_delay: 1.0, lead_alpha: 0.999, ..BESIDE }),
        ("response_delay_bounds", with(Learning { response_delay_bounds: [0.2, f64::INFINITY], ..l })),
        ("velocity_delay", Parameters { velocity_delay: 1.1, ..BESIDE }),
        ("computation_delay", Parameters { computation_delay: 1001, ..BESIDE }),
        ("compressibility", Parameters { compressibility: 0.0, ..BESIDE }),
        ("leakage", Parameters { leakage: -1.0, ..BESIDE }),
        ("force_sensitivity", Parameters { force_sensitivity: f64::NAN, ..BESIDE }),
    ] {
        assert_eq!(rig::refused(Learner::<f32, 21>::new(&parameters)), name);
    }
}
