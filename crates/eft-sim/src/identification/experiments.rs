//! The paper's identification tests on the virtual rig: displacement control of 10 V per full stroke, gain one.

use eft_core::Short;

use crate::closed_loop::{SimulateOptions, motions, one_actuator};
use crate::config::{RigConfig, StructureKind};
use crate::ground_motion::excitation::{samples, sine_sweep};
use crate::plant::{
    ActuatorState, AnyDrive, Equations, Motion, Plant, ServoActuator, Spool, Stages, TimeGrid, runge_kutta,
};
use crate::{Error, Result, checks, interruption};

/// Output of the displacement control (V) for the full stroke.
const FULL_SCALE: f64 = 10.0;

/// Fig. 4a: the valve driven by a sweep with the main stage shut off.
#[derive(Debug, Clone, PartialEq)]
pub struct ValveTest {
    /// Valve command (V).
    pub valve_command: Vec<f64>,
    /// Spool opening (1).
    pub spool: Vec<f64>,
}

/// Fig. 4b: the free piston under displacement control.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowTest {
    /// Displacement command (m).
    pub command: Vec<f64>,
    /// Displacement (m).
    pub displacement: Vec<f64>,
    /// Spool opening (1).
    pub spool: Vec<f64>,
}

/// The response delay test: a 0–10 Hz sweep of an amplitude (m) in 32 s, sampled at a rate (Hz). Without flow
/// through the main stage the piston does not move, so the error is the whole command.
///
/// # Errors
/// An invalid rate.
pub fn valve_test(rig: &RigConfig, amplitude: f64, sample_rate: f64) -> Result<ValveTest> {
    let sweep = sine_sweep(amplitude * FULL_SCALE / rig.actuator.stroke, 0.0, 10.0, 32.0, sample_rate)?;
    let grid = SimulateOptions::default().grid(rig, sample_rate)?;
    let mut valve = Valve { servo_actuator: ServoActuator::pack(&|_| rig.plant())?, command: 0.0 };
    // Pilot flow and spool opening, and the torque motor's numbers.
    let mut state = [0.0; 4];
    let mut stages = Stages::new(&state);
    let mut spool = Vec::with_capacity(sweep.values.len());
    for command in &sweep.values {
        spool.push(state[1]);
        valve.command = *command;
        for n in 0..grid.steps {
            runge_kutta(&mut state, &mut stages, f64::from(n) * grid.step, grid.step, &mut valve);
            Spool::stop_in(&mut state);
        }
    }
    Ok(ValveTest { valve_command: sweep.values, spool })
}

/// A valve whose main stage is shut off: only pilot and spool move.
struct Valve {
    servo_actuator: ServoActuator<f64>,
    /// The held valve command (V).
    command: f64,
}

impl Equations<f64> for Valve {
    fn rate(&mut self, state: &[f64], _: f64, rate: &mut [f64]) {
        let [pilot_flow, spool, motor @ ..] = state.first_chunk::<4>().copied().unwrap_or_default();
        let state = ActuatorState { pilot_flow, spool, ..ActuatorState::default() };
        let (rates, [flow, flow_rate]) = self.servo_actuator.valve_rate(&state, motor, self.command);
        rate.copy_from_slice(&[rates.pilot_flow, rates.spool, flow, flow_rate]);
    }
}

/// The flow test: sines of a frequency (Hz) and an amplitude (m) for a duration (s) with a piston of a mass (kg) and
/// no structure, sampled at a rate (Hz).
///
/// # Errors
/// An invalid piston mass, rate or duration.
pub fn flow_test(
    rig: &RigConfig,
    amplitude: f64,
    frequency: f64,
    duration: f64,
    piston_mass: f64,
    sample_rate: f64,
) -> Result<FlowTest> {
    checks::within_nyquist("frequency", frequency, sample_rate)?;
    checks::positive("piston_mass", piston_mass, "kg")?;
    let stroke = rig.actuator.stroke;
    let allowed = format!("must be at most the stroke, {} m", Short(stroke));
    checks::require(amplitude.abs() <= stroke, "amplitude", Short(amplitude), allowed)?;
    let free = rig.plant().with(|free| {
        free.structure.kind = StructureKind::Linear;
        (free.structure.mass, free.structure.damping, free.structure.stiffness) = (piston_mass, 0.0, 0.0);
    })?;
    let sweep = sine_sweep(amplitude, frequency, frequency, duration, sample_rate)?;
    let mut plant = Plant::<f64>::pack(&|_| &free)?;
    // The resonance of the free piston on the oil is far above that of the loaded rig.
    let actuator = &free.actuator;
    let compressibility = actuator.compressibility + actuator.attachment_compressibility();
    let resonance = actuator.piston_area / (compressibility * piston_mass).sqrt();
    let steps = SimulateOptions::default().grid(&free, sample_rate)?.steps;
    let grid = TimeGrid::new(sample_rate, steps.max((4.0 * resonance / sample_rate).ceil() as u32));
    let per_metre = FULL_SCALE / stroke;
    let mut test = FlowTest { command: Vec::new(), displacement: Vec::new(), spool: Vec::new() };
    for (i, command) in sweep.values.into_iter().enumerate() {
        if i.is_multiple_of(grid.ticks_per_check()) {
            interruption::check()?;
        }
        let state = plant.actuator(0);
        test.command.push(command);
        test.displacement.push(state.displacement);
        test.spool.push(state.spool);
        let error = per_metre * (command - state.displacement);
        plant.advance(&[AnyDrive::held(error)], grid);
    }
    let finite = test.displacement.iter().all(|x| x.is_finite());
    let allowed = "must be large enough for the integration: the motion has no end";
    checks::require(finite, "piston_mass", piston_mass, allowed)?;
    Ok(test)
}

/// Displacement (m) of the rig's structure released from a displacement (m), disconnected from the actuator.
///
/// # Errors
/// An invalid rate or duration, or a displacement that is not finite or whose motion overflows.
pub fn free_vibration(rig: &RigConfig, from: f64, duration: f64, sample_rate: f64) -> Result<Vec<f64>> {
    one_actuator(rig)?;
    checks::finite("displacement", from, "m")?;
    let samples = samples(duration, sample_rate)?;
    let start = [Motion { displacement: from, ..Motion::default() }];
    let too_slow =
        |_| Error::value("sample_rate", Short(sample_rate), "must be higher: a sample has too many steps");
    let grid = SimulateOptions::default().grid(rig, sample_rate).map_err(too_slow)?;
    let mut responses = motions(rig, &start, samples, grid, |_, _| [0.0; 2])?;
    let displacement = responses.swap_remove(0).displacement;
    let finite = displacement.iter().all(|x| x.is_finite());
    let allowed = "must be smaller: the motion is beyond double precision";
    checks::require(finite, "displacement", Short(from), allowed)?;
    Ok(displacement)
}
