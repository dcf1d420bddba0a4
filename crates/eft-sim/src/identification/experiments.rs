//! The paper's identification tests on the virtual rig: displacement control of 10 V per full stroke, gain one.

use crate::closed_loop::{SimulateOptions, motions, one_actuator};
use crate::config::{RigConfig, StructureKind};
use crate::error::{Error, Result};
use crate::ground_motion::excitation::{Command, sine_sweep};
use crate::plant::{
    ActuatorState, Driver, Equations, Motion, Plant, ServoActuator, Spool, Stages, Structure, TimeGrid,
    runge_kutta,
};

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
    let mut valve = Valve { servo_actuator: ServoActuator::pack(|_| rig.plant())?, command: 0.0 };
    // Pilot flow and spool opening, and the torque motor's numbers.
    let mut state = [0.0; 4];
    let mut stages = Stages::new(&state);
    let mut spool = Vec::with_capacity(sweep.values.len());
    for command in &sweep.values {
        spool.push(state[1]);
        valve.command = *command;
        for n in 0..grid.steps {
            runge_kutta(&mut state, &mut stages, f64::from(n) * grid.step(), grid.step(), &mut valve);
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
    let free = rig.plant().with(|free| {
        free.structure.kind = StructureKind::Linear;
        (free.structure.mass, free.structure.damping, free.structure.stiffness) = (piston_mass, 0.0, 0.0);
    })?;
    let sweep = sine_sweep(amplitude, frequency, frequency, duration, sample_rate)?;
    let mut plant = Plant::<f64>::pack(|_| &free)?;
    // The resonance of the free piston on the oil is far above that of the loaded rig.
    let actuator = &free.actuator;
    let compressibility = actuator.compressibility + actuator.attachment_compressibility();
    let resonance = actuator.piston_area / (compressibility * piston_mass).sqrt();
    let steps = SimulateOptions::default().grid(&free, sample_rate)?.steps;
    let grid = TimeGrid::new(sample_rate, steps.max((4.0 * resonance / sample_rate).ceil() as u32));
    let per_metre = FULL_SCALE / rig.actuator.stroke;
    let mut test = FlowTest { command: Vec::new(), displacement: Vec::new(), spool: Vec::new() };
    for command in sweep.values {
        let state = plant.actuator(0);
        test.command.push(command);
        test.displacement.push(state.displacement);
        test.spool.push(state.spool);
        let error = per_metre * (command - state.displacement);
        plant.advance(&[Driver::held(error)], grid);
    }
    if test.displacement.iter().all(|x| x.is_finite()) {
        Ok(test)
    } else {
        Err(Error::value(
            "piston_mass",
            piston_mass,
            "must be large enough for the integration: the motion has no end",
        ))
    }
}

/// Displacement (m) of the rig's structure released from a displacement (m), disconnected from the actuator.
///
/// # Errors
/// An invalid rate or duration.
pub fn free_vibration(rig: &RigConfig, from: f64, duration: f64, sample_rate: f64) -> Result<Vec<f64>> {
    one_actuator(rig)?;
    let still = Command::new(vec![0.0; (duration * sample_rate).round().max(0.0) as usize], sample_rate)?;
    let start = [Motion { displacement: from, ..Motion::default() }];
    let structure = Structure::pack(|_| rig);
    let grid = TimeGrid::new(sample_rate, 8);
    let mut responses = motions(&structure, &start, still.values.len(), grid, |_, _| [0.0; 2]);
    Ok(responses.swap_remove(0).displacement)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::linear::{phase_delay, valve_response};
    use crate::identification::{
        Recording, identify_damping, identify_delay, identify_flow_curve, identify_flow_gain,
    };
    use std::f64::consts::TAU;

    #[test]
    fn the_delay_of_valves_from_2_to_10_ms_is_their_phase_slope() {
        for delay in [2e-3, 4e-3, 5.18e-3, 10e-3] {
            // The delay of the inner loop is 1/(K_3·K_vp/A_v); the pilot's time constant is scaled in
            // proportion.
            let ratio = 5.18e-3 / delay;
            let rig = RigConfig::zhao2005().with(|rig| {
                rig.servovalve.pilot_flow_gain *= ratio;
                rig.servovalve.pilot_time_constant /= ratio;
            });
            let rig = rig.unwrap();
            let test = valve_test(&rig, 0.0254, 2000.0).unwrap();
            let band = (0.25, 10.0);
            let found = identify_delay(&test.valve_command, &test.spool, 2000.0, band).unwrap();
            // The virtual rig holds the command for a sample.
            let true_delay = phase_delay(|f| valve_response(&rig, f), band).unwrap() + 0.5 / 2000.0;
            assert!(
                (found.delay / true_delay - 1.0).abs() < 0.02,
                "{delay}: {} and {true_delay}",
                found.delay
            );
        }
    }

    fn flow_tests() -> Vec<FlowTest> {
        let rig = RigConfig::zhao2005();
        let run = |share: f64| flow_test(&rig, share * rig.actuator.stroke, 3.0, 4.0, 20.0, 2048.0).unwrap();
        [0.9, 0.8, 0.6, 0.4, 0.2].map(run).to_vec()
    }

    fn worst(tests: &[FlowTest]) -> (f64, usize) {
        let rig = RigConfig::zhao2005();
        let recordings: Vec<_> =
            tests.iter().map(|t| Recording { spool: &t.spool, displacement: &t.displacement }).collect();
        let found = identify_flow_curve(&recordings, 2048.0, rig.actuator.piston_area, 21).unwrap();
        let truth = &rig.servovalve.flow_table.flows;
        let error = |i: usize| (found.flows[i] - truth[i]).abs() / truth[20];
        let reached = (0..21).filter(|i| found.measured[*i]);
        (reached.clone().map(error).fold(0.0, f64::max), reached.count())
    }

    #[test]
    fn the_flow_curve_of_the_virtual_rig_is_table_2() {
        let mut tests = flow_tests();
        let (error, reached) = worst(&tests);
        assert!(error < 0.01 && reached >= 15, "{error} at {reached} points");
        // 1 % of each sensor's range, uniform noise of that standard deviation.
        let mut state = 7_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
        };
        for test in &mut tests {
            test.spool.iter_mut().for_each(|v| *v += 0.01 * noise());
            test.displacement.iter_mut().for_each(|v| *v += 0.01 * 0.127 * noise() + 0.003);
            test.displacement[3000..3200].fill(f64::NAN);
        }
        let (error, reached) = worst(&tests);
        assert!(error < 0.02 && reached >= 15, "{error} at {reached} points with noise");
    }

    #[test]
    fn the_flow_gain_at_the_origin_is_the_slope_there() {
        let tests = flow_tests();
        let recordings: Vec<_> =
            tests.iter().map(|t| Recording { spool: &t.spool, displacement: &t.displacement }).collect();
        let found = identify_flow_gain(&recordings, 2048.0, 8.212e-3, 0.1).unwrap();
        let mean = 1016.0 * 1.6387064e-5;
        assert!((found.value / mean - 1.0).abs() < 0.01, "{found:?}, {mean}");
    }

    #[test]
    fn free_vibration_gives_the_structure_s_damping() {
        let rig = RigConfig::zhao2005();
        let found = identify_damping(&free_vibration(&rig, 0.02, 10.0, 500.0).unwrap(), 500.0).unwrap();
        let s = &rig.structure;
        let omega = (s.stiffness / s.mass).sqrt();
        let ratio = s.damping / (2.0 * s.mass * omega);
        assert!((found.ratio.value / ratio - 1.0).abs() < 1e-4, "{found:?}, {ratio}");
        assert!((found.frequency.value / (omega / TAU) - 1.0).abs() < 1e-6);
    }
}
