//! The energy balance of a test from its traces.

use crate::plant::{ActuatorState, EnergyBalance, recorded_balance};
use crate::{Result, RigConfig, checks};

/// The traces of one actuator that an energy balance needs, with one value per tick.
#[derive(Debug, Clone, Copy)]
pub struct EnergyTraces<'a> {
    /// Displacement (m).
    pub displacement: &'a [f64],
    /// Velocity (m/s).
    pub velocity: &'a [f64],
    /// Spool opening (1).
    pub spool: &'a [f64],
    /// Load pressure (Pa).
    pub load_pressure: &'a [f64],
}

/// The energy balance (J) of a recorded test of a rig's own structure at a sample rate (Hz), from the first
/// sample to the last, whatever the controller was. It is `None` for a rig with effects beyond the paper's
/// model, whose traces do not contain its whole state; then [`TestRun::energy`](super::TestRun::energy) has
/// the balance. It is also `None` if the test diverged so far that a power is not finite.
///
/// # Errors
/// Traces of different lengths, or a sample rate that is not positive and finite.
pub fn energy_of_traces(
    rig: &RigConfig,
    sample_rate: f64,
    traces: &EnergyTraces<'_>,
) -> Result<Option<EnergyBalance>> {
    let EnergyTraces { displacement, velocity, spool, load_pressure } = *traces;
    checks::positive("sample_rate", sample_rate, "Hz")?;
    let total = displacement.len();
    for (name, trace) in [("velocity", velocity), ("spool", spool), ("load_pressure", load_pressure)] {
        let allowed = format!("must have {total}, as the displacement");
        checks::require(trace.len() == total, name, format!("{} samples", trace.len()), allowed)?;
    }
    let states = (0..total).map(|tick| ActuatorState {
        pilot_flow: 0.0,
        spool: spool[tick],
        load_pressure: load_pressure[tick],
        displacement: displacement[tick],
        velocity: velocity[tick],
    });
    recorded_balance(rig, sample_rate, states)
}
