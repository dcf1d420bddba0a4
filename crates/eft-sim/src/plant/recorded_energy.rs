//! The energy balance of a recorded test.

use crate::plant::{ActuatorState, EnergyBalance, Motion, POWERS, ServoActuator, Structure, needs_detail};
use crate::{Result, RigConfig};

/// The energy balance (J) of recorded states at a sample rate (Hz), from the first to the last: powers by the
/// trapezoidal rule, the increase of the stored energy from the states at both ends. It does not depend on
/// the controller. `None` if a state of the rig is not recorded, as with effects beyond the paper's model, or
/// if a power is not finite.
///
/// # Errors
/// A flow curve that the core refuses.
pub(crate) fn recorded_balance(
    rig: &RigConfig,
    sample_rate: f64,
    mut states: impl Iterator<Item = ActuatorState<f64>>,
) -> Result<Option<EnergyBalance>> {
    if needs_detail(rig) || rig.structure.floors() > 1 {
        return Ok(None);
    }
    let parts = Parts {
        servo_actuator: ServoActuator::pack(&|_| rig.plant())?,
        structure: Structure::pack(&|_| rig),
        supply_pressure: rig.plant().supply.pressure,
    };
    let Some(first) = states.next() else {
        return Ok(None);
    };
    let half_period = 0.5 / sample_rate;
    let (mut last, mut before) = (first, parts.powers(&first));
    let mut integrals = EnergyBalance::<f64>::default().to_array();
    for state in states {
        let now = parts.powers(&state);
        for ((integral, before), now) in integrals.iter_mut().zip(before).zip(now) {
            *integral += (before + now) * half_period;
        }
        (last, before) = (state, now);
    }
    let stored = parts.stored(&last) - parts.stored(&first);
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
