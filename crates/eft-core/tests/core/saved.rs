//! A saved calibration: a learner that starts from it continues like one that never stopped.

use eft_core::{
    Calibration, Channel, Deviations, Input, Learner, LearnerState, Learning, Parameters, Realization,
    SavedCalibration, SavedEvidence, status,
};

use crate::rig::{self, Valve, refused};

const LEARNS: Learning = Learning { curve_correction: true, guard: false, ..Learning::ADAPTIVE };
const BESIDE: Parameters<'static> =
    Parameters { realization: Realization::Analog, learning: LEARNS, ..rig::LEARNING };
const TRUE: Valve = Valve { flow_gain: 1.06, valve_gain: 1.03, delay: 7.0e-3 };

/// A learner, its state, and measurements of a valve with some noise.
struct Bench {
    channel: Channel<f64, 21>,
    learner: Learner<f64, 21>,
    memory: LearnerState<f64>,
    /// Factor on the forward flow; the backward flow is divided by it.
    forward: f64,
    noise: u64,
}

impl Bench {
    fn new(p: &Parameters) -> Self {
        let (channel, learner) = (Channel::<f64, 21>::new(p).unwrap(), Learner::<f64, 21>::new(p).unwrap());
        Self { channel, memory: learner.at_rest(), learner, forward: 1.02, noise: 1 }
    }

    fn start(p: &Parameters, saved: &SavedCalibration) -> Self {
        let bench = Self::new(p);
        Self { memory: bench.learner.start_from(saved).unwrap(), ..bench }
    }

    /// A number from -1 to 1, for the noise of a sensor.
    fn noise(&mut self) -> f64 {
        self.noise =
            self.noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.noise >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// The calibrations of some seconds of swinging, from rest. With `lies` the velocity has the wrong sign.
    fn swing(&mut self, seconds: f64, lies: bool) -> Vec<Calibration<f64>> {
        let (mut state, mut found) = (self.channel.at_rest(), Vec::new());
        for tick in 0..(seconds * BESIDE.sample_rate) as u32 {
            // From rest, like a test.
            let time = f64::from(tick) / BESIDE.sample_rate;
            let wave = |time: f64| 0.3 * time.clamp(0.0, 1.0) * (5.0 * time).sin();
            let spool = TRUE.valve_gain * wave(time - TRUE.delay);
            let velocity = TRUE.flow_gain * rig::table().flow(spool) / BESIDE.piston_area;
            let valve_command = wave(time) / BESIDE.valve_gain;
            let mut i = Input { velocity, spool, valve_command, ..TRUE.swing(0.0, 0.0) };
            i.velocity *= if i.velocity > 0.0 { self.forward } else { 1.0 / self.forward };
            i.velocity += 1e-3 * self.noise();
            i.spool += 1e-3 * self.noise();
            i.velocity *= if lies { -1.0 } else { 1.0 };
            let out = rig::tick(&self.channel, &mut state, &i);
            if let Some(window) = out.window {
                let calibration = self.learner.update(&mut self.memory, &window);
                self.channel.publish(&mut state, calibration);
                found.push(calibration);
            }
        }
        found
    }

    fn saved(&self) -> SavedCalibration {
        self.learner.saved(&self.memory)
    }
}

fn learned() -> (Calibration<f64>, SavedCalibration) {
    let mut bench = Bench::new(&BESIDE);
    let last = *bench.swing(8.0, false).last().unwrap();
    (last, bench.saved())
}

fn close(one: f64, other: f64, share: f64) -> bool {
    (one - other).abs() <= share * other.abs()
}

#[test]
fn the_saved_values_are_those_of_the_last_calibration() {
    let (last, saved) = learned();
    assert_eq!((saved.version, saved.flow_gain), (SavedCalibration::VERSION, last.flow_gain));
    assert_eq!((saved.valve_gain, saved.response_delay), (last.valve_gain, last.response_delay));
    assert_eq!((saved.velocity_delay, saved.null_offset), (last.velocity_delay, last.null_offset));
    assert!(saved.excitation > 1e-3 && (-0.025..-0.01).contains(&saved.curve.asymmetry), "{saved:?}");
    assert!((1e-4..0.02).contains(&saved.curve.asymmetry_deviation), "{saved:?}");
    assert!((saved.flow_gain - 1.06).abs() < 0.01, "{saved:?}");
}

#[test]
fn the_deviation_of_the_flow_gain_has_the_departures_share() {
    // Both directions have the table's flow, so the departures have only what the flow gain lacks.
    let mut bench = Bench { forward: 1.0, ..Bench::new(&BESIDE) };
    let found = bench.swing(5.0, false);
    let saved = bench.saved();
    let error = |gain: f64| (gain - TRUE.flow_gain).abs();
    let of_table = saved.flow_gain / (1.0 + saved.curve.flow_gain_share);
    assert!(error(saved.flow_gain) > 5e-3 && error(of_table) < 0.5 * error(saved.flow_gain), "{saved:?}");
    // The last two seconds are more than one period.
    let last: Vec<_> = found.iter().skip(found.len() * 3 / 5).collect();
    let square = |of: fn(&Calibration<f64>) -> f64| last.iter().map(|c| of(c) * of(c)).sum::<f64>();
    let ratio = (square(|c| c.deviations.flow_gain) / square(|c| c.flow_gain - TRUE.flow_gain)).sqrt();
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
    // One flow gain has no departures.
    let single = Parameters { learning: Learning { curve_correction: false, ..LEARNS }, ..BESIDE };
    let mut alone = Bench { forward: 1.0, ..Bench::new(&single) };
    alone.swing(5.0, false);
    let alone = alone.saved();
    assert_eq!(alone.curve.flow_gain_share.to_bits(), 0);
    assert!(error(alone.flow_gain) < 1e-3, "{alone:?}");
}

#[test]
fn a_departure_reaches_a_fifth_of_its_flow() {
    let (_, saved) = learned();
    let greatest = BESIDE.flows.iter().fold(0.0, |most, flow| f64::max(most, flow.abs()));
    assert!(close(saved.greatest_flow, greatest, 1e-12), "{} of {greatest}", saved.greatest_flow);
    let learner = Learner::<f64, 21>::new(&BESIDE).unwrap();
    // Node 12 of 16 lies at four sevenths of the greatest flow, and node 2 at minus six sevenths.
    for (node, flow) in [(12, 4.0 / 7.0 * greatest), (2, -6.0 / 7.0 * greatest)] {
        let with = |share: f64| {
            let mut departs = saved;
            departs.curve.departures[node] = share * flow;
            learner.start_from(&departs)
        };
        for share in [0.199, -0.199] {
            assert!(with(share).is_ok(), "{node}: {share}");
        }
        for share in [0.201, -0.201] {
            assert_eq!(refused(with(share)), "calibration.curve.departures", "{node}: {share}");
        }
    }
}

#[test]
fn a_learner_continues_from_its_calibration() {
    let mut unbroken = Bench::new(&BESIDE);
    unbroken.swing(8.0, false);
    let saved = unbroken.saved();
    let mut bench = Bench { noise: unbroken.noise, ..Bench::start(&BESIDE, &saved) };
    let again = bench.saved();
    for (one, other) in [
        (again.flow_gain, saved.flow_gain),
        (again.valve_gain, saved.valve_gain),
        (again.response_delay, saved.response_delay),
        (again.velocity_delay, saved.velocity_delay),
        (again.null_offset, saved.null_offset),
        (again.excitation, saved.excitation),
        (again.curve.asymmetry, saved.curve.asymmetry),
    ] {
        assert!(close(one, other, 1e-12), "{one}, {other}");
    }
    let before = unbroken.learner.first_calibration(&unbroken.memory).deviations;
    let Deviations { flow_gain, valve_gain, response_delay, velocity_delay, null_offset } =
        bench.learner.first_calibration(&bench.memory).deviations;
    for (one, other) in [
        (flow_gain, before.flow_gain),
        (valve_gain, before.valve_gain),
        (response_delay, before.response_delay),
        (velocity_delay, before.velocity_delay),
        (null_offset, before.null_offset),
        (again.curve.flow_gain_share, saved.curve.flow_gain_share),
        (again.curve.error, saved.curve.error),
        (again.curve.asymmetry_deviation, saved.curve.asymmetry_deviation),
    ] {
        // Each deviation is of this window or of the one before.
        assert!(close(one, other, 1e-2), "{one}, {other}");
    }
    let nodes = saved.curve.departures.iter().zip(&again.curve.departures);
    assert!(nodes.clone().all(|(one, other)| (one - other).abs() < 1e-15), "{nodes:?}");
    // The next test has the estimates of a learner that never stopped.
    let stayed = unbroken.swing(3.0, false);
    for (now, then) in bench.swing(3.0, false).iter().zip(&stayed) {
        assert!((now.flow_gain - then.flow_gain).abs() < 1e-3, "{now:?} {then:?}");
        assert!((now.valve_gain - then.valve_gain).abs() < 5e-4, "{now:?} {then:?}");
        assert!((now.response_delay - then.response_delay).abs() < 1e-4, "{now:?} {then:?}");
        assert!((now.velocity_delay - then.velocity_delay).abs() < 1e-4, "{now:?} {then:?}");
        for opening in [-0.25, 0.25] {
            let [now, then] = [now, then].map(|c| bench.learner.found_flow(c, opening));
            assert!(close(now, then, 2e-3), "{opening}: {now} {then}");
        }
    }
}

#[test]
fn single_precision_starts_from_what_double_saved_and_another_rate_too() {
    let (_, saved) = learned();
    let single = Learner::<f32, 21>::new(&BESIDE).unwrap();
    let again = single.saved(&single.start_from(&saved).unwrap());
    assert!(close(again.flow_gain, saved.flow_gain, 1e-6), "{again:?}");
    assert!(close(again.evidence.flow_error, saved.evidence.flow_error, 1e-6), "{again:?}");
    // A value on a bound in one precision is not beyond it in the other.
    let bound = SavedCalibration { flow_gain: f64::from(1.35_f32), ..again };
    let double = Learner::<f64, 21>::new(&Parameters { sample_rate: 1024.0, ..BESIDE }).unwrap();
    let again = double.saved(&double.start_from(&bound).unwrap());
    assert!(close(again.flow_gain, 1.35, 1e-6), "{again:?}");
    let [now, then] = [again, saved].map(|saved| saved.evidence.mean_square_frequency);
    assert!(close(now, then, 1e-6), "{again:?}");
}

#[test]
fn a_wrong_start_is_replaced_like_any_evidence() {
    let (_, saved) = learned();
    let wrong = SavedCalibration { flow_gain: 1.2, valve_gain: 0.9, response_delay: 1.0e-2, ..saved };
    let learning = Learning { curve_correction: false, ..LEARNS };
    let mut bench = Bench::start(&Parameters { learning, ..BESIDE }, &wrong);
    let found = bench.swing(5.0, false);
    let (first, last) = (found.first().unwrap(), found.last().unwrap());
    assert!((first.flow_gain - 1.2).abs() < 0.01 && (first.valve_gain - 0.9).abs() < 0.01, "{first:?}");
    assert!((last.flow_gain - 1.06).abs() < 0.01 && (last.valve_gain - 1.03).abs() < 0.01, "{last:?}");
    assert!((last.response_delay - saved.response_delay).abs() < 1e-4, "{last:?}");
}

/// The largest sums that are accepted delay new evidence, and do not stop it.
#[test]
fn the_largest_sums_are_forgotten() {
    let (_, saved) = learned();
    let mut largest = SavedCalibration { flow_gain: 1.2, ..saved };
    for evidence in [
        |e: &mut SavedEvidence, most: f64| e.rate_flow = most,
        |e: &mut SavedEvidence, most: f64| e.flow_rate = most,
        |e: &mut SavedEvidence, most: f64| e.flow = most,
        |e: &mut SavedEvidence, most: f64| e.rate_flow_rate = most,
    ] {
        // The largest value that is accepted.
        let learner = Learner::<f64, 21>::new(&BESIDE).unwrap();
        let (mut accepted, mut refused) = (0.0, 1.0e9);
        for _ in 0..60 {
            let middle = 0.5 * (accepted + refused);
            largest.evidence = saved.evidence;
            evidence(&mut largest.evidence, middle);
            if learner.start_from(&largest).is_ok() { accepted = middle } else { refused = middle }
        }
        assert!(accepted > 0.0);
        largest.evidence = saved.evidence;
        evidence(&mut largest.evidence, accepted);
        let found = Bench::start(&BESIDE, &largest).swing(8.0, false);
        let last = found.last().unwrap();
        assert!((last.flow_gain - TRUE.flow_gain).abs() < 0.02, "{accepted}: {last:?}");
    }
}

#[test]
fn a_rejection_returns_to_the_start() {
    let (_, saved) = learned();
    let found = Bench::start(&BESIDE, &saved).swing(2.0, true);
    assert!(found.iter().any(|c| c.status & status::ADAPTATION_FROZEN != 0));
    let last = found.last().unwrap();
    assert!((last.flow_gain - saved.flow_gain).abs() < 0.01, "{last:?}");
}

#[test]
fn data_without_evidence_give_a_learner_at_rest() {
    let learner = Learner::<f64, 21>::new(&BESIDE).unwrap();
    let nothing = learner.saved(&learner.at_rest());
    assert!(nothing.excitation == 0.0 && nothing.evidence.time == 0.0, "{nothing:?}");
    assert_eq!(learner.start_from(&nothing), Ok(learner.at_rest()));
    // A learner without estimates does not use it.
    let guard = Learning { guard: true, ..Learning::OFF };
    let guards = Learner::<f64, 21>::new(&Parameters { learning: guard, ..BESIDE }).unwrap();
    assert_eq!(guards.start_from(&learned().1), Ok(guards.at_rest()));
}

#[test]
fn impossible_data_are_refused_by_name() {
    let (_, saved) = learned();
    let refuses = |name: &str, change: fn(&mut SavedCalibration)| {
        let mut wrong = saved;
        change(&mut wrong);
        let learner = Learner::<f64, 21>::new(&BESIDE).unwrap();
        assert_eq!(refused(learner.start_from(&wrong)), name);
    };
    refuses("calibration.version", |s| s.version = 1);
    refuses("calibration.greatest_flow", |s| s.greatest_flow *= 1.01);
    refuses("calibration.excitation", |s| s.excitation = f64::NAN);
    refuses("calibration.flow_gain", |s| s.flow_gain = 1.36);
    refuses("calibration.valve_gain", |s| s.valve_gain = f64::INFINITY);
    refuses("calibration.response_delay", |s| s.response_delay = 0.0);
    refuses("calibration.velocity_delay", |s| s.velocity_delay = 0.1);
    refuses("calibration.null_offset", |s| s.null_offset = -0.051);
    refuses("calibration.evidence.time", |s| s.evidence.time = 0.0);
    refuses("calibration.evidence.mean_weight", |s| s.evidence.mean_weight = 1.01);
    refuses("calibration.evidence.mean_square_frequency", |s| s.evidence.mean_square_frequency = -1.0);
    refuses("calibration.evidence.growth", |s| {
        s.evidence.growth = 1.01 * s.evidence.mean_square_frequency.sqrt();
    });
    refuses("calibration.evidence.flow", |s| s.evidence.flow = -1e-3);
    refuses("calibration.evidence.flow_rate", |s| s.evidence.flow_rate = f64::NAN);
    refuses("calibration.evidence.rate_flow", |s| s.evidence.rate_flow = f64::INFINITY);
    refuses("calibration.evidence.rate_flow_rate", |s| s.evidence.rate_flow_rate = -1.0);
    refuses("calibration.evidence.compressed_flow", |s| s.evidence.compressed_flow = -1e-3);
    refuses("calibration.evidence.flow_error", |s| s.evidence.flow_error = -1e-3);
    refuses("calibration.evidence.spool_error", |s| s.evidence.spool_error = 1001.0);
    refuses("calibration.evidence.distances.flow_gain", |s| s.evidence.distances.flow_gain = f64::NAN);
    refuses("calibration.evidence.distances.valve_gain", |s| s.evidence.distances.valve_gain = 2e6);
    refuses("calibration.evidence.distances.response_delay", |s| s.evidence.distances.response_delay = 2e6);
    refuses("calibration.evidence.distances.velocity_delay", |s| s.evidence.distances.velocity_delay = -2e6);
    refuses("calibration.evidence.distances.null_offset", |s| s.evidence.distances.null_offset = f64::NAN);
    refuses("calibration.curve.asymmetry", |s| s.curve.asymmetry = -0.31);
    refuses("calibration.curve.asymmetry_deviation", |s| s.curve.asymmetry_deviation = 0.0);
    refuses("calibration.curve.error", |s| s.curve.error = 0.0);
    refuses("calibration.curve.flow_gain_share", |s| s.curve.flow_gain_share = -0.21);
    refuses("calibration.curve.mean_departure", |s| s.curve.mean_departure = 1.01);
    refuses("calibration.curve.time", |s| s.curve.time = 4.1);
    refuses("calibration.curve.sensor_offset", |s| s.curve.sensor_offset = f64::NAN);
    refuses("calibration.curve.null_time", |s| s.curve.null_time = -1.0);
    refuses("calibration.curve.null_coupling", |s| s.curve.null_coupling = 1.01);
    refuses("calibration.curve.departures", |s| s.curve.departures[7] = f64::NAN);
    refuses("calibration.curve.departures", |s| s.curve.departures[8] = 1e-6);
    refuses("calibration.curve.departure_deviations", |s| s.curve.departure_deviations[2] = -1e-6);
    // A calibration is refused for another table.
    let linear = Parameters { mode: eft_core::Mode::Linear, ..BESIDE };
    let learner = Learner::<f64, 21>::new(&linear).unwrap();
    assert_eq!(refused(learner.start_from(&saved)), "calibration.greatest_flow");
}

/// With the valve at a learned null nothing moves from the first tick on, whatever supplies the null.
#[test]
fn a_rig_rests_at_the_null_that_was_saved() {
    let (_, saved) = learned();
    for (realization, integral_gain, null_bias) in [
        (Realization::Analog, 0.0, 0.0),
        (Realization::Digital, 0.0, 0.0),
        (Realization::Digital, 0.0, 0.01),
        (Realization::Digital, 4.0, 0.0),
        (Realization::Digital, 4.0, 0.01),
    ] {
        let p = Parameters { realization, integral_gain, null_bias, ..BESIDE };
        let null_offset = 0.03;
        let mut bench = Bench::start(&p, &SavedCalibration { null_offset, ..saved });
        let first = bench.learner.first_calibration(&bench.memory);
        assert_eq!((first.window, first.flow_gain), (u32::MAX, saved.flow_gain));
        assert_eq!((first.null_offset, first.valve_gain), (null_offset, saved.valve_gain));
        let mut state = bench.channel.at_rest_with(&first);
        let held = null_offset / p.valve_gain;
        let held = if realization == Realization::Digital { held } else { held / p.proportional_gain };
        let before = bench.channel.hold(&state).voltage;
        assert!((before - held).abs() < 1e-12, "{realization:?} {integral_gain}: {before}, not {held}");
        let valve_command = null_offset / p.valve_gain;
        let still = Input { spool: null_offset, valve_command, ..Input::default() };
        for tick in 0..2000 {
            let out = rig::tick(&bench.channel, &mut state, &still);
            assert_eq!(state.calibration().flow_gain, saved.flow_gain, "{tick}");
            let near = (out.voltage - held).abs() < 1e-9;
            assert!(near, "{realization:?} {integral_gain} {tick}: {} V, not {held} V", out.voltage);
            if let Some(window) = out.window {
                let calibration = bench.learner.update(&mut bench.memory, &window);
                bench.channel.publish(&mut state, calibration);
            }
        }
    }
}
