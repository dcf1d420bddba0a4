//! A channel whose plausibility watch has lost every signal of the motion.

use eft_core::{
    Channel, Input, Parameters, PlausibilityParameters, ProtectionParameters, VelocitySource, status,
};

use crate::rig;

#[test]
fn without_motion_and_flow_the_valve_closes_at_once() {
    let plausibility = Some(PlausibilityParameters::DEFAULT);
    let protection = ProtectionParameters { plausibility, ..ProtectionParameters::DEFAULT };
    let waits = protection.lost_samples;
    let closing = (protection.shutdown_time * rig::PARAMETERS.sample_rate) as u32 + 2;
    let rest =
        Input { velocity: 0.0, force: 0.0, spool: 0.0, displacement: 0.0, command: 0.0, ..Input::default() };
    // A sensor of the velocity is lost before the displacement, a few samples before it, or with it. A derivative is
    // lost with it.
    for (velocity_source, first) in [
        (VelocitySource::Sensor, 1000),
        (VelocitySource::Sensor, 2000 - waits / 2),
        (VelocitySource::Sensor, 1999),
        (VelocitySource::Sensor, 2000),
        (VelocitySource::Derivative { corner: 80.0 }, 2000),
    ] {
        let p = Parameters { velocity_source, protection: Some(protection), ..rig::PARAMETERS };
        let channel = Channel::<f64, 21>::new(&p).unwrap();
        let mut state = channel.at_rest();
        let closes = 3000 + waits;
        for tick in 0..closes + closing {
            let mut i = rest;
            if tick >= first {
                i.velocity = f64::NAN;
            }
            if tick >= 2000 {
                i.displacement = f64::NAN;
            }
            if tick >= 3000 {
                i.spool = f64::NAN;
            }
            let out = rig::tick(&channel, &mut state, &i);
            let is = |flag: u32| out.status & flag != 0;
            assert_eq!(is(status::TRIPPED), tick >= first + waits, "{velocity_source:?}: tick {tick}");
            // The flow balance shows the motion until the spool is lost as well.
            assert_eq!(is(status::SHUT_DOWN), tick >= closes, "{velocity_source:?}: tick {tick}");
            if tick < closes {
                assert_eq!(out.authority, 1.0, "{velocity_source:?}: tick {tick}");
            }
            if tick == closes + closing - 1 {
                assert_eq!(out.authority, 0.0, "{velocity_source:?}");
            }
        }
    }
}
