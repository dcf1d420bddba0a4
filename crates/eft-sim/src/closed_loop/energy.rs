//! The energy balance of a test from its traces.

use crate::plant::{ActuatorState, EnergyBalance, Motion, POWERS, ServoActuator, Structure, needs_detail};
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
/// Powers are integrated by the trapezoidal rule.
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
    if needs_detail(rig) || rig.structure.floors() > 1 || total == 0 {
        return Ok(None);
    }
    let parts = Parts {
        servo_actuator: ServoActuator::pack(&|_| rig.plant())?,
        structure: Structure::pack(&|_| rig),
        supply_pressure: rig.plant().supply.pressure,
    };
    let state = |tick: usize| ActuatorState {
        pilot_flow: 0.0,
        spool: spool[tick],
        load_pressure: load_pressure[tick],
        displacement: displacement[tick],
        velocity: velocity[tick],
    };
    let half_period = 0.5 / sample_rate;
    let mut integrals = [0.0; POWERS];
    let mut before = parts.powers(&state(0));
    for tick in 1..total {
        let now = parts.powers(&state(tick));
        for ((integral, before), now) in integrals.iter_mut().zip(before).zip(now) {
            *integral += (before + now) * half_period;
        }
        before = now;
    }
    let stored = parts.stored(&state(total - 1)) - parts.stored(&state(0));
    let finite = integrals.iter().all(|integral| integral.is_finite()) && stored.is_finite();
    Ok(finite.then(|| EnergyBalance::new(integrals, stored)))
}

/// The parts of the paper's plant that use or store energy.
struct Parts {
    servo_actuator: ServoActuator<f64>,
    structure: Structure<f64>,
    supply_pressure: f64,
}

impl Parts {
    /// Powers (W) in this state.
    fn powers(&self, state: &ActuatorState<f64>) -> [f64; POWERS] {
        let hydraulics = self.servo_actuator.hydraulics(state, self.supply_pressure);
        let mut powers = EnergyBalance::default();
        self.servo_actuator.add_powers(&mut powers, state, &hydraulics, self.supply_pressure);
        self.structure.add_powers(&mut powers, |_| motion(state));
        powers.supplied = self.supply_pressure * hydraulics.drawn();
        powers.to_array()
    }

    /// Energy (J) in oil and structure.
    fn stored(&self, state: &ActuatorState<f64>) -> f64 {
        self.servo_actuator.stored(state) + self.structure.stored(|_| motion(state))
    }
}

fn motion(state: &ActuatorState<f64>) -> Motion<f64> {
    Motion { displacement: state.displacement, velocity: state.velocity, hysteresis: 0.0 }
}
