//! The learner's estimates from a recorded test.

use eft_core::{Input, Learning, Parameters, Realization, SavedCalibration};

use crate::closed_loop::estimates::{Estimates, FIELDS};
use crate::closed_loop::{Precision, channel, parameters};
use crate::{Result, RigConfig, checks, interruption};

/// The learner's estimates, one value per window of ticks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Replay {
    /// Time since the start (s) at which the window closed.
    pub time: Vec<f64>,
    estimates: Vec<Estimates<f64>>,
    /// Bits of [`eft_core::status`] about the learning.
    pub status: Vec<u32>,
    /// Learned no-load flows (m³/s) of the valve at the end, at the openings of the rig's flow table.
    pub found_flows: Vec<f64>,
    /// What was learned by the end, for the rig of the next test; none where nothing was.
    pub calibration: Option<SavedCalibration>,
}

impl Replay {
    /// The values of each estimate, by the names and in the units of the traces.
    pub fn estimates(&self) -> impl Iterator<Item = (&'static str, Vec<f64>)> {
        FIELDS.iter().map(|(name, of)| (*name, self.estimates.iter().map(of).collect()))
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
    checks::require(!inputs.is_empty(), "inputs", "none", "must have one per tick")?;
    let of_rig = parameters(rig, sample_rate)?;
    let parameters = Parameters {
        // The valve command is a measurement here, independent of its source.
        realization: Realization::Analog,
        learning: Learning { adaptive: true, guard: true, ..of_rig.learning },
        protection: None,
        ..of_rig
    };
    let channel = P::channel(&parameters)?;
    let mut learning = channel::RigLearner::<P>::new(&parameters, rig.calibration.only()?)?;
    let mut state = learning.initial_channel_state(&channel);
    let mut replay = Replay::default();
    for (tick, input) in inputs.iter().enumerate() {
        if tick.is_multiple_of(1024) {
            interruption::check()?;
        }
        if let Some(window) = channel.step(&mut state, &channel::to_precision(input)).window {
            let calibration = learning.learner.update(&mut learning.state, &window);
            channel.publish(&mut state, calibration);
            replay.time.push((tick + 1) as f64 / sample_rate);
            replay.estimates.push(Estimates::unknown().or(|_| Some(&calibration)));
            replay.status.push(calibration.status);
        }
    }
    replay.calibration = learning.saved();
    replay.found_flows = learning.found_flows(state.calibration(), parameters.openings);
    Ok(replay)
}
