//! The learner's estimates from a recorded test.

use eft_core::{Calibration, Deviations, Input, Learning, Parameters, Realization, SavedCalibration};

use crate::closed_loop::controller::{Precision, parameters};
use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::interruption;

/// The estimates, one value per window of ticks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Replay {
    /// Time since the start (s) at which the window closed.
    pub time: Vec<f64>,
    /// True flow over the table's (1).
    pub flow_gain_estimate: Vec<f64>,
    /// Delay (s) of the spool, by its sensor.
    pub response_delay_estimate: Vec<f64>,
    /// Delay (s) of the velocity after the spool, each by its sensor.
    pub velocity_delay_estimate: Vec<f64>,
    /// The spool's gain over the configured one (1).
    pub valve_gain_estimate: Vec<f64>,
    /// Commanded opening (1) at which the valve passes nothing at no load.
    pub null_offset_estimate: Vec<f64>,
    /// Standard deviation of the flow gain (1) from sensor noise; infinite if nothing was learned.
    pub flow_gain_deviation: Vec<f64>,
    /// The same of the response delay (s).
    pub response_delay_deviation: Vec<f64>,
    /// The same of the velocity's delay (s).
    pub velocity_delay_deviation: Vec<f64>,
    /// The same of the spool's gain (1).
    pub valve_gain_deviation: Vec<f64>,
    /// The same of the null offset (1).
    pub null_offset_deviation: Vec<f64>,
    /// The guard's factor on the compensation level (1).
    pub level: Vec<f64>,
    /// The gate's test ratio (1). Above 1 the models do not explain the measurements, and nothing is learned.
    pub test_ratio: Vec<f64>,
    /// Bits of [`eft_core::status`] about the learning.
    pub status: Vec<u32>,
    /// Learned no-load flows (m³/s) of the valve at the end, at the openings of the rig's flow table.
    pub found_flows: Vec<f64>,
    /// What was learned by the end, for the rig of the next test; none where nothing was.
    pub calibration: Option<SavedCalibration>,
}

impl Replay {
    fn add(&mut self, time: f64, calibration: &Calibration<impl Precision>) {
        self.time.push(time);
        self.flow_gain_estimate.push(calibration.flow_gain.to_f64());
        self.response_delay_estimate.push(calibration.response_delay.to_f64());
        self.velocity_delay_estimate.push(calibration.velocity_delay.to_f64());
        self.valve_gain_estimate.push(calibration.valve_gain.to_f64());
        self.null_offset_estimate.push(calibration.null_offset.to_f64());
        let Deviations { flow_gain, valve_gain, response_delay, velocity_delay, null_offset } =
            calibration.deviations;
        self.null_offset_deviation.push(null_offset.to_f64());
        self.flow_gain_deviation.push(flow_gain.to_f64());
        self.response_delay_deviation.push(response_delay.to_f64());
        self.velocity_delay_deviation.push(velocity_delay.to_f64());
        self.valve_gain_deviation.push(valve_gain.to_f64());
        self.level.push(calibration.level.to_f64());
        self.test_ratio.push(calibration.test_ratio.to_f64());
        self.status.push(calibration.status);
    }
}

/// Runs the learner of a rig on a recorded test, with one input per tick at a sample rate (Hz). The rig
/// itself need not adapt. Every input needs the valve command (V) at its sampling time.
///
/// # Errors
/// No inputs; parameters that the learner refuses.
pub fn replay<P: Precision<Flags = u32>>(
    rig: &RigConfig,
    sample_rate: f64,
    inputs: &[Input<f64>],
) -> Result<Replay> {
    if inputs.is_empty() {
        return Err(Error::value("inputs", "none", "must have one per tick"));
    }
    let of_rig = parameters(rig, sample_rate)?;
    let parameters = Parameters {
        // The valve command is a measurement here, independent of its source.
        realization: Realization::Analog,
        learning: Learning { adaptive: true, guard: true, ..of_rig.learning },
        protection: None,
        ..of_rig
    };
    let (channel, learner) = (P::channel(&parameters)?, P::learner(&parameters)?);
    let start =
        rig.calibration.as_ref().map_or_else(|| Ok(learner.at_rest()), |saved| learner.start_from(saved));
    let (mut state, mut learned) = (channel.at_rest(), start?);
    let mut replay = Replay::default();
    for (tick, input) in inputs.iter().enumerate() {
        if tick.is_multiple_of(1024) {
            interruption::check()?;
        }
        if let Some(window) = channel.step(&mut state, &super::channel::rounded(input)).window {
            let calibration = learner.update(&mut learned, &window);
            channel.publish(&mut state, calibration);
            replay.add((tick + 1) as f64 / sample_rate, &calibration);
        }
    }
    let flow = |opening: &f64| learner.found_flow(state.calibration(), P::from_f64(*opening)).to_f64();
    replay.calibration = Some(learner.saved(&learned)).filter(|saved| saved.excitation > 0.0);
    replay.found_flows = parameters.openings.iter().map(flow).collect();
    Ok(replay)
}
