//! What a test leaves behind: one value per command sample and channel.

use eft_core::Flags;

use crate::closed_loop::single::Tick;
use crate::config::RigConfig;
use crate::rig::{EnergyBalance, Num};

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
    /// Supply pressure (Pa).
    pub supply_pressure: Vec<f64>,
    /// Valve command `v` (V).
    pub valve_command: Vec<f64>,
    /// Compensation signal `v_c` (V).
    pub compensation: Vec<f64>,
    /// The flow gain the controller believes in, against its table (1).
    pub flow_gain_estimate: Vec<f64>,
    /// The delay (s) that the controller makes up for.
    pub response_delay_estimate: Vec<f64>,
    /// The overcompensation guard's factor on the compensation level (1).
    pub level: Vec<f64>,
    /// Bits of [`eft_core::status`].
    pub status: Vec<u32>,
    /// Where the energy went, with a rig that has effects beyond the paper's model.
    pub energy: Option<EnergyBalance>,
    /// What the sensors reported; none where each is ideal.
    measured: Option<Measured>,
}

/// What the sensors reported, beside the truth; a sample that got lost is NaN.
#[derive(Debug, Clone, PartialEq)]
struct Measured {
    force: Vec<f64>,
    displacement: Vec<f64>,
    velocity: Vec<f64>,
    spool: Vec<f64>,
    supply_pressure: Vec<f64>,
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
            supply_pressure: channel(),
            valve_command: channel(),
            compensation: channel(),
            flow_gain_estimate: channel(),
            response_delay_estimate: channel(),
            level: channel(),
            status: Vec::with_capacity(ticks),
            energy: None,
            measured: (!crate::sensors::are_ideal(rig)).then(|| Measured {
                force: channel(),
                displacement: channel(),
                velocity: channel(),
                spool: channel(),
                supply_pressure: channel(),
            }),
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
        self.supply_pressure.push(tick.supply_pressure.lane(lane));
        self.valve_command.push(tick.decision.valve_command.lane(lane));
        self.compensation.push(tick.decision.compensation.lane(lane));
        self.flow_gain_estimate.push(tick.decision.calibration.flow_gain.lane(lane));
        self.response_delay_estimate.push(tick.decision.calibration.response_delay.lane(lane));
        self.level.push(tick.decision.calibration.level.lane(lane));
        self.status.push(tick.status.lane(lane));
        if let Some(measured) = &mut self.measured {
            measured.force.push(tick.decision.measured.force.lane(lane));
            measured.displacement.push(tick.decision.measured.displacement.lane(lane));
            measured.velocity.push(tick.decision.measured.velocity.lane(lane));
            measured.spool.push(tick.decision.measured.spool.lane(lane));
            measured.supply_pressure.push(tick.decision.measured.supply_pressure.lane(lane));
        }
    }

    /// Force (N) as the load cell reported it.
    pub fn measured_force(&self) -> &[f64] {
        self.measured.as_ref().map_or(&self.force, |measured| &measured.force)
    }

    /// Displacement (m) as its sensor reported it.
    pub fn measured_displacement(&self) -> &[f64] {
        self.measured.as_ref().map_or(&self.displacement, |measured| &measured.displacement)
    }

    /// Velocity (m/s) as its sensor reported it.
    pub fn measured_velocity(&self) -> &[f64] {
        self.measured.as_ref().map_or(&self.velocity, |measured| &measured.velocity)
    }

    /// Spool opening (1) as its sensor reported it.
    pub fn measured_spool(&self) -> &[f64] {
        self.measured.as_ref().map_or(&self.spool, |measured| &measured.spool)
    }

    /// Supply pressure (Pa) as its sensor reported it.
    pub fn measured_supply_pressure(&self) -> &[f64] {
        self.measured.as_ref().map_or(&self.supply_pressure, |measured| &measured.supply_pressure)
    }

    /// Every flag that was raised at any time.
    pub fn status_union(&self) -> u32 {
        self.status.iter().fold(0, |all, s| all | s)
    }
}
