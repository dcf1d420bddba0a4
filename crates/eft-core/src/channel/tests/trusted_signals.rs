//! What takes the place of distrusted measurements, and which flags say so.

use super::*;
use crate::channel::state::CalibrationHistory;
use crate::compensation::{Calibration, LeadNetwork};
use crate::parameters::{Levels, Mode, VelocitySource};

fn watched() -> Channel<f64, 21> {
    Channel::<f64, 21>::new(&Parameters { protection: WATCHED, ..RIG }).unwrap()
}

/// A state in the middle of a motion.
fn moving(channel: &Channel<f64, 21>) -> ChannelState<f64> {
    let mut state = channel.at_rest();
    for tick in 0..60 {
        channel.step(&mut state, &swing(tick));
    }
    state
}

/// A swing with the displacement (m) of its velocity.
fn measured(tick: u32) -> Input<f64> {
    let displacement = 0.2 / (0.01 * RIG.sample_rate) * (1.0 - libm::cos(0.01 * f64::from(tick)));
    Input { displacement, ..swing(tick) }
}

/// A state in the middle of such a swing.
fn healthy(channel: &Channel<f64, 21>) -> ChannelState<f64> {
    let mut state = channel.at_rest();
    for tick in 0..60 {
        channel.step(&mut state, &measured(tick));
    }
    assert!(!state.protection.is_tripped());
    state
}

#[test]
fn a_distrusted_spool_is_that_of_the_valves_model() {
    let channel = watched();
    let before = moving(&channel);
    let step = |distrusted: bool, spool: f64| {
        let mut state = before;
        if distrusted {
            state.plausibility.distrust(Cause::SpoolImplausible);
        }
        let output = channel.step(&mut state, &Input { spool, ..swing(60) });
        (output.status & status::SPOOL_DISTRUSTED != 0, output.voltage)
    };
    let (near, far) = (swing(60).spool, swing(60).spool + 0.01);
    assert_eq!((step(false, near).0, step(true, near).0), (false, true));
    // The reading has no effect then, whatever it is.
    assert_eq!(step(true, near), step(true, far));
}

#[test]
fn the_force_loop_is_open_while_the_force_jumps() {
    let channel = watched();
    let mut state = moving(&channel);
    let mut opens = |force: f64| {
        let output = channel.step(&mut state, &Input { force, ..swing(60) });
        output.status & status::FORCE_LOOP_OPEN != 0
    };
    let healthy = swing(60).force;
    assert_eq!([healthy, 2e5, healthy].map(&mut opens), [false, true, false]);
}

#[test]
fn after_a_trip_the_last_reading_replaces_a_lost_one_and_the_output_is_not_held() {
    let channel = watched();
    let moves = |tick: u32| {
        let displacement = -20.0 * libm::cos(0.01 * f64::from(tick)) / RIG.sample_rate;
        Input { displacement, ..swing(tick) }
    };
    let mut before = channel.at_rest();
    for tick in 0..60 {
        channel.step(&mut before, &moves(tick));
    }
    let [last, next] = [59, 60].map(moves);
    let lost = f64::NAN;
    for (gone, repeats) in [
        (Input { force: lost, ..next }, Input { force: last.force, ..next }),
        (Input { velocity: lost, ..next }, Input { velocity: last.velocity, ..next }),
        (Input { spool: lost, ..next }, Input { spool: last.spool, ..next }),
    ] {
        for trips in [false, true] {
            let step = |input| {
                let mut state = before;
                if trips {
                    state.protection.trip();
                }
                let output = channel.step(&mut state, input);
                (output.voltage, output.status & status::INVALID_MEASUREMENT != 0)
            };
            assert_eq!((step(&gone) == step(&repeats), step(&gone).1), (trips, !trips), "{gone:?}");
        }
    }
    // `prime` forgets the readings: until there is a new one the output is held.
    let mut primed = before;
    primed.protection.trip();
    channel.prime(&mut primed, &next);
    let held = channel.hold(&primed).voltage;
    let output = channel.step(&mut primed, &Input { velocity: lost, ..next });
    assert_eq!((output.voltage, output.status & status::INVALID_MEASUREMENT != 0), (held, true));
    // If the sensor stays lost, the watch blames it, as before a trip.
    before.protection.trip();
    let flags = |state: &mut _| channel.step(state, &Input { velocity: lost, ..next }).status;
    let late = (0..20).map(|_| flags(&mut before)).position(|flags| flags & status::VELOCITY_DISTRUSTED != 0);
    assert_eq!(late, Some(10));
}

#[test]
fn a_force_that_contradicts_the_flow_leaves_the_velocity_in_doubt() {
    let channel = watched();
    let mut state = channel.at_rest();
    state.protection.trip_by(Cause::ForceImplausible);
    state.plausibility.distrust(Cause::ForceImplausible);
    assert!(!channel.distrusts_velocity(&state));
    // The force has the wrong sign while the oil of a held piston is compressed. The balance contains the velocity as well.
    let (size, turn) = (4e3, 0.05);
    let opening = size * turn * RIG.sample_rate * RIG.compressibility / (RIG.piston_area * RIG.flow_gain);
    for (realization, cause) in [
        // The valve command is unknown.
        (Realization::Analog, Cause::ForceImplausible),
        // Without a swing of the valve command the reading of the spool is wrong as well.
        (Realization::Digital, Cause::SpoolImplausible),
    ] {
        let channel =
            Channel::<f64, 21>::new(&Parameters { realization, protection: WATCHED, ..RIG }).unwrap();
        let (mut state, mut tripped) = (channel.at_rest(), false);
        for tick in 0..4000 {
            let angle = turn * f64::from(tick);
            let (force, spool) = (-size * libm::sin(angle), opening * libm::cos(angle));
            // Sensors that live.
            let velocity = 1e-6 * libm::sin(f64::from(tick * tick));
            let readings = Input { force, spool, displacement: velocity, velocity, ..swing(0) };
            let output = channel.step(&mut state, &Input { valve_command: f64::NAN, ..readings });
            tripped |= output.status & status::TRIPPED != 0;
        }
        assert!(tripped && state.cause() == cause, "{:?}", state.cause());
        assert_eq!(channel.distrusts_velocity(&state), cause == Cause::ForceImplausible);
    }
}

#[test]
fn after_a_force_level_the_velocity_is_doubted_and_after_another_level_not() {
    let channel = watched();
    for (cause, distrusted) in
        [(Cause::ForceLevel, true), (Cause::DisplacementLevel, false), (Cause::Request, false)]
    {
        let mut state = channel.at_rest();
        state.protection.trip_by(cause);
        assert_eq!(channel.distrusts_velocity(&state), distrusted, "{cause:?}");
    }
}

#[test]
fn after_a_blamed_displacement_the_flow_decides_whether_the_velocity_is_doubted() {
    let channel = watched();
    let swing = measured;
    let healthy = healthy(&channel);
    for (velocity_turns, distrusted) in [(false, false), (true, true)] {
        let mut state = healthy;
        state.protection.trip_by(Cause::DisplacementImplausible);
        state.plausibility.distrust(Cause::DisplacementImplausible);
        assert!(!channel.distrusts_velocity(&state));
        for tick in 60..120 {
            let (input, stuck) = (swing(tick), swing(60).displacement);
            let input = if velocity_turns {
                // Slowly, as a jump would be refused.
                let sign = 1.0 - 0.05 * f64::from(tick - 60);
                Input { velocity: sign * input.velocity, ..input }
            } else {
                Input { displacement: stuck, ..input }
            };
            channel.step(&mut state, &input);
        }
        assert_eq!(channel.distrusts_velocity(&state), distrusted, "{velocity_turns}");
        // A force that is blamed as well was wrong.
        state.plausibility.distrust(Cause::ForceLost);
        assert!(!channel.distrusts_velocity(&state));
    }
}

#[test]
fn a_distrusted_force_or_displacement_counts_as_zero() {
    let protection = ProtectionParameters {
        force: Levels { warning: 0.5, trip: 20e3 },
        displacement: Levels { warning: 0.05, trip: 0.115 },
        plausibility: Some(PlausibilityParameters::DEFAULT),
        ..ProtectionParameters::DEFAULT
    };
    let channel = Channel::<f64, 21>::new(&Parameters { protection: Some(protection), ..RIG }).unwrap();
    let away = Input { force: 50.0, displacement: 0.06, velocity: 0.0, spool: 0.0, ..Input::default() };
    for (force, displacement) in [(0.0, 0.06), (50.0, 0.0)] {
        let mut state = channel.at_rest();
        let input = Input { force, displacement, ..away };
        let warns = |state: &mut _| channel.step(state, &input).status & status::PROTECTION_WARNING != 0;
        assert!(warns(&mut state), "{force} {displacement}");
        let sensor = if force > 0.0 { Cause::ForceImplausible } else { Cause::DisplacementImplausible };
        state.plausibility.distrust(sensor);
        assert!(!warns(&mut state), "{force} {displacement}");
    }
}

/// A closed valve would make a larger force than the loop, which stops a motion that only the flow balance shows.
#[test]
fn a_motion_by_the_flow_balance_is_stopped_by_the_loop_until_the_command_has_faded() {
    let force = Levels { warning: 2e3, trip: 2e3 };
    let protection = WATCHED.map(|p| ProtectionParameters { force, ..p });
    let channel = Channel::<f64, 21>::new(&Parameters { protection, ..RIG }).unwrap();
    for (causes, opens_at_once) in [
        ([Cause::VelocityImplausible, Cause::DisplacementImplausible], false),
        ([Cause::VelocityImplausible, Cause::VelocityImplausible], true),
    ] {
        let mut state = healthy(&channel);
        for cause in causes {
            state.plausibility.distrust(cause);
            state.protection.trip_by(cause);
        }
        // The force is beyond 1.25 times its level from tick 104 on, and the command has faded 0.1 s after tick 60.
        let opened = (60..1000_u32)
            .find(|tick| channel.step(&mut state, &measured(*tick)).status & status::SHUT_DOWN != 0);
        let opened = opened.unwrap();
        assert!(if opens_at_once { opened < 160 } else { (400..600).contains(&opened) }, "{opened}");
    }
}

/// While the displacement's derivative replaces the velocity, the force loop gets softer, by half at half the command.
#[test]
fn without_its_velocity_sensor_the_force_loop_gets_softer_as_the_command_fades() {
    let channel =
        Channel::<f64, 21>::new(&Parameters { mode: Mode::Off, protection: WATCHED, ..RIG }).unwrap();
    let slope = |state: &ChannelState<f64>, tick: u32| {
        let step = |added: f64| {
            let (mut state, input) = (*state, measured(tick));
            let voltage = channel.step(&mut state, &Input { force: input.force + added, ..input }).voltage;
            (voltage, state.protection.braking())
        };
        ((step(10.0).0 - step(0.0).0) / 10.0, step(0.0).1.unwrap_or(0.0))
    };
    let mut state = healthy(&channel);
    let (stiff, _) = slope(&state, 60);
    state.plausibility.distrust(Cause::VelocityImplausible);
    state.protection.trip_by(Cause::VelocityImplausible);
    for tick in 60..300 {
        let (soft, share) = slope(&state, tick);
        assert!((soft / stiff - (1.0 - 0.5 * share)).abs() < 1e-9, "{tick}: {}", soft / stiff);
        // The command is gone 0.1 s after tick 60.
        let expected = (2.0 * f64::from(tick - 59) / 410.0).min(1.0);
        assert!((share - expected).abs() < 1e-3, "{tick}: {share}");
        channel.step(&mut state, &measured(tick));
    }
}

/// A rig that estimates its velocity, in the middle of a swing.
fn estimating(source: VelocitySource) -> (Channel<f64, 21>, ChannelState<f64>) {
    let rig = Parameters { protection: WATCHED, velocity_source: source, ..RIG };
    let channel = Channel::<f64, 21>::new(&rig).unwrap();
    let mut state = channel.at_rest();
    for tick in 0..60 {
        channel.step(&mut state, &travelling(tick));
    }
    (channel, state)
}

/// A swing without a velocity sensor, with the opening whose flow it needs.
fn travelling(tick: u32) -> Input<f64> {
    let swing = measured(tick);
    let spool = swing.velocity * RIG.piston_area / RIG.flow_gain;
    Input { spool, velocity: 0.0, ..swing }
}

#[test]
fn without_its_force_a_rig_that_estimates_its_velocity_follows_the_motion() {
    let observer = VelocitySource::Observer { gains: [0.05, 5.0, 10.0], mass: 7040.0 };
    for source in [VelocitySource::Derivative { corner: 80.0 }, observer] {
        let (channel, mut state) = estimating(source);
        state.protection.shut_down_by(Cause::ForceLost);
        state.plausibility.distrust(Cause::ForceLost);
        let voltage = |mut state: ChannelState<f64>, force: f64| {
            let step = |n: u32| channel.step(&mut state, &Input { force, ..travelling(60 + n) }).voltage;
            (0..40).map(step).last().unwrap()
        };
        // The valve stays open, and the distrusted force has no effect, not even through the observer.
        assert!(voltage(state, 0.0) > 0.5, "{source:?}: {}", voltage(state, 0.0));
        assert_eq!(voltage(state, 0.0), voltage(state, 500.0), "{source:?}");
    }
}

#[test]
fn without_force_and_velocity_sensor_the_shorter_of_learned_and_configured_delays_is_led() {
    for source in [VelocitySource::Sensor, VelocitySource::Derivative { corner: 80.0 }] {
        for (learned, cause, shorter) in [
            (4.0e-3, Cause::ForceLost, true),
            (4.0e-3, Cause::SpoolLost, false),
            (-4.0e-3, Cause::ForceLost, false),
        ] {
            let learning = Learning::ADAPTIVE;
            let rig = Parameters { velocity_source: source, learning, protection: WATCHED, ..RIG };
            let channel = Channel::<f64, 21>::new(&rig).unwrap();
            let mut state = channel.at_rest();
            let nominal = *state.calibration();
            // Another gain of the lead network, as a guard leaves it.
            let lead = LeadNetwork::of(0.5, 3.0, 0.9 * nominal.lead.gain());
            state.history = CalibrationHistory::new(Calibration { velocity_delay: learned, lead, ..nominal });
            state.plausibility.distrust(cause);
            state.protection.trip_by(cause);
            channel.step(&mut state, &swing(0));
            let found = *state.calibration();
            let shorter = shorter && source != VelocitySource::Sensor;
            let of = if shorter { &nominal.lead } else { &lead };
            assert_eq!([found.lead.pole(), found.lead.rate()], [of.pole(), of.rate()], "{learned} {cause:?}");
            assert_eq!(found.velocity_delay, if shorter { 0.0 } else { learned }, "{learned} {cause:?}");
            assert_eq!(found.lead.gain(), lead.gain(), "{learned} {cause:?}");
        }
    }
}
