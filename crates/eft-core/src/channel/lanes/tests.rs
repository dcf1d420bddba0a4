//! A lane and the channel of its rig, tick by tick.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use super::*;
use crate::channel::Channel;
use crate::number::{Flags, Lanes};
use crate::parameters::{Learning, Parameters};
use crate::signals::Input;

fn together(inputs: &[Input<f64>; 2]) -> ControllerInput<Lanes<f64, 2>> {
    let of = |pick: fn(&Input<f64>) -> f64| Lanes::from_lanes(|lane| pick(&inputs[lane]));
    ControllerInput {
        command: of(|i| i.command),
        next_command: of(|i| i.next_command),
        velocity: of(|i| i.velocity),
        force: of(|i| i.force),
        spool: of(|i| i.spool),
        supply_pressure: of(|i| i.supply_pressure),
    }
}

/// A swing of a size (1); one sample of force in 29 is lost.
fn swing(tick: u32, size: f64) -> Input<f64> {
    let x = size * libm::sin(0.01 * f64::from(tick));
    Input {
        command: 3e3 * x,
        velocity: 0.2 * x,
        force: if tick % 29 == 7 { f64::NAN } else { 2.9e3 * x },
        spool: 0.15 * x,
        supply_pressure: 1.9e7 * (1.0 - 0.1 * x),
        valve_command: 1.6 * x,
        ..Input::default()
    }
}

#[test]
fn a_lane_has_the_outputs_and_windows_of_its_own_channel() {
    for realization in [Realization::Digital, Realization::Analog] {
        let rigs = [0.9, 1.0].map(|level| Parameters {
            level,
            realization,
            supply_correction: true,
            learning: Learning::ADAPTIVE,
            ..Parameters::ZHAO2005
        });
        let controllers = rigs.map(|rig| Controller::<f64, 21>::new(&rig).unwrap());
        let channels = rigs.map(|rig| Channel::<f64, 21>::new(&rig).unwrap());
        let packed = Controller::<Lanes<f64, 2>, 21>::pack(&|lane| &controllers[lane]);
        let lanes = ChannelLanes::new(packed, channels[0].window_ticks());
        let (mut wide, mut states) =
            (lanes.at_rest_with(&lanes.controller.nominal()), channels.map(|channel| channel.at_rest()));
        for tick in 0..200 {
            // The second rig has no gap.
            let inputs = [swing(tick, 1.0), swing(tick - tick % 29, 0.5)];
            let valve_command = Lanes(inputs.map(|input| input.valve_command));
            let (out, closes) = lanes.step(&mut wide, &together(&inputs), valve_command, |voltage| voltage);
            assert_eq!(closes, tick % 16 == 15);
            for (lane, channel) in channels.iter().enumerate() {
                let alone = channel.step(&mut states[lane], &inputs[lane]);
                let found =
                    (out.valve_command.lane(lane), out.compensation.lane(lane), out.status.lane(lane));
                assert_eq!(found, (alone.voltage, alone.compensation, alone.status), "{lane} {tick}");
                assert_eq!(closes.then(|| wide.window(lane)), alone.window, "{lane} {tick}");
            }
            if closes {
                let window = wide.window.number;
                let learned = [1.02_f64, 0.97].map(|growth| {
                    let flow_gain = growth.powi(window as i32);
                    Calibration {
                        window,
                        flow_gain,
                        per_flow_gain: 1.0 / flow_gain,
                        ..controllers[0].nominal()
                    }
                });
                for (lane, channel) in channels.iter().enumerate() {
                    channel.publish(&mut states[lane], learned[lane]);
                }
                lanes.publish(&mut wide, |lane| &learned[lane]);
            }
        }
    }
}
