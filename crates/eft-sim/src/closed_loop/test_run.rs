//! What a test leaves behind: one value per command sample and channel.

use eft_core::Flags;

use crate::closed_loop::loop_state::Tick;
use crate::config::RigConfig;
use crate::rig::Num;

/// The traces of one test. Value `i` is the plant's true value at time `i / sample_rate`, before that tick's
/// output acts.
#[derive(Debug, Clone, PartialEq)]
pub struct TestRun {
    /// The rig that was tested.
    pub rig: RigConfig,
    /// Ticks per second (Hz).
    pub sample_rate: f64,
    /// Force command (N).
    pub command: Vec<f64>,
    /// Force on the structure (N).
    pub force: Vec<f64>,
    /// Displacement (m).
    pub displacement: Vec<f64>,
    /// Velocity (m/s).
    pub velocity: Vec<f64>,
    /// Spool opening (1).
    pub spool: Vec<f64>,
    /// Load pressure (Pa).
    pub load_pressure: Vec<f64>,
    /// Valve command `v` (V).
    pub valve_command: Vec<f64>,
    /// Compensation signal `v_c` (V).
    pub compensation: Vec<f64>,
    /// The flow gain the controller believes in, against its table (1).
    pub flow_gain_estimate: Vec<f64>,
    /// Bits of [`eft_core::status`].
    pub status: Vec<u32>,
}

impl TestRun {
    pub(crate) fn with_capacity(rig: &RigConfig, sample_rate: f64, ticks: usize) -> Self {
        let channel = || Vec::with_capacity(ticks);
        Self {
            rig: rig.clone(),
            sample_rate,
            command: channel(),
            force: channel(),
            displacement: channel(),
            velocity: channel(),
            spool: channel(),
            load_pressure: channel(),
            valve_command: channel(),
            compensation: channel(),
            flow_gain_estimate: channel(),
            status: Vec::with_capacity(ticks),
        }
    }

    /// Appends one lane of a tick.
    #[inline(always)]
    pub(crate) fn push<S: Num>(&mut self, tick: &Tick<S>, lane: usize, command: f64) {
        self.command.push(command);
        self.force.push(tick.force.lane(lane));
        self.displacement.push(tick.plant.displacement.lane(lane));
        self.velocity.push(tick.plant.velocity.lane(lane));
        self.spool.push(tick.plant.spool.lane(lane));
        self.load_pressure.push(tick.plant.load_pressure.lane(lane));
        self.valve_command.push(tick.valve_command.lane(lane));
        self.compensation.push(tick.compensation.lane(lane));
        self.flow_gain_estimate.push(1.0);
        self.status.push(tick.status.lane(lane));
    }

    /// Every flag that was raised at any time.
    pub fn status_union(&self) -> u32 {
        self.status.iter().fold(0, |all, s| all | s)
    }
}
