//! The rig of the paper: Tables 1 and 2 and Fig. 7, in SI units.

use super::sections::*;
use super::{RigConfig, RigValues};

/// m³ per in³.
const CUBIC_INCH: f64 = 1.6387064e-5;

/// Table 2, in³/s at openings of 0.1, 0.2, … 1.0.
const EXTENDING: [f64; 10] = [102.2, 187.2, 260.4, 321.1, 369.8, 411.2, 441.0, 468.3, 495.7, 523.0];
/// Table 2, in³/s at openings of −0.1, −0.2, … −1.0.
const RETRACTING: [f64; 10] =
    [-101.0, -188.2, -260.9, -324.2, -377.1, -419.9, -452.3, -480.2, -508.2, -536.2];

const IDEAL: Sensor = Sensor {
    gain: 1.0,
    noise: 0.0,
    bandwidth: None,
    bits: None,
    range: None,
    delay: 0,
    bias: 0.0,
    dropout: 0.0,
};

impl RigConfig {
    /// The rig of Zhao, Shield, French and Posbergh (Tables 1 and 2, Fig. 7), nonlinear
    /// compensation at level 1, sampled at 4096 Hz.
    pub fn zhao2005() -> Self {
        let flows = RETRACTING.iter().rev().chain(&[0.0]).chain(&EXTENDING);
        let values = RigValues {
            name: Some("zhao2005".into()),
            actuator: Actuator {
                piston_area: 8.212e-3,
                compressibility: 7.56e-13,
                leakage: 1.3e-11,
                stroke: 0.127,
                dead_length: None,
                area_ratio: 1.0,
                attachment_stiffness: None,
                friction: 0.0,
                friction_velocity: 1e-3,
                bypass_flow: 0.0,
                bypass_time: 0.05,
                stop_stiffness: None,
                stop_damping: 0.0,
            },
            supply: Supply {
                pressure: 1.9e7,
                droop: None,
                accumulator: None,
                pump_flow: None,
                schedule: None,
            },
            servovalve: Servovalve {
                pilot_time_constant: 1.4e-3,
                pilot_flow_gain: 1.06e-5,
                spool_area: 1.964e-4,
                spool_stroke: 2.79e-3,
                spool_sensitivity: 3579.13,
                flow_gain_scale: 1.0,
                true_flow_table: None,
                flow_table: FlowCurve {
                    openings: (-10..=10).map(|tenth| f64::from(tenth) / 10.0).collect(),
                    flows: flows.map(|flow| flow * CUBIC_INCH).collect(),
                },
                pilot_flow_limit: None,
                torque_motor_frequency: None,
                torque_motor_damping: 0.7,
                overlap: 0.0,
                null_bias: 0.0,
                leakage: ValveLeakage { proportional: 0.0, constant: 0.0, null_region: 0.003 },
            },
            controller: Controller {
                force_sensitivity: 5.6e-5,
                proportional_gain: 0.8059,
                derivative_gain: 2.0e-4,
                integral_gain: 0.0,
                force_loop: ForceLoop::Pd,
                deviations: 1.0,
                realization: Realization::Analog,
                sample_rate: 4096.0,
                velocity_source: VelocitySource::Sensor,
                force_delay: 0.0,
                velocity_corner: 80.0,
                observer_mass: None,
                observer_displacement_noise: 6.4e-5,
                observer_acceleration_noise: 0.02,
                observer_drift: 200.0,
                accelerometer_drift: 1.0,
            },
            compensation: Compensation {
                mode: Mode::Nonlinear,
                level: 1.0,
                flow_gain: 1.64e-2,
                valve_gain: 0.1,
                response_delay: 5.0e-3,
                velocity_delay: 0.0,
                lead_alpha: 0.1,
                computation_delay: 0,
                sign_from: SignFrom::Spool,
                feedforward: false,
                look_ahead: false,
                adaptive: false,
                curve_correction: false,
                supply_correction: false,
                guard: false,
                learning: Learning {
                    excitation: 5.0e-4,
                    lowest_flow_gain: 0.7,
                    highest_flow_gain: 1.35,
                    lowest_valve_gain: 0.8,
                    highest_valve_gain: 1.25,
                    shortest_delay: 0.2,
                    longest_delay: 4.0,
                    age_limit: 1.0,
                },
            },
            calibration: None,
            structure: Structure {
                kind: StructureKind::Bilinear,
                mass: 7040.0,
                damping: 4330.0,
                stiffness: 693.8e3,
                softening: Some(Softening { displacement: 25.0e-3, stiffness: 350.0e3 }),
                bouc_wen: None,
                power_damper: None,
                stories: None,
            },
            sensors: Sensors {
                seed: 0,
                motion_at: MotionAt::Piston,
                cell_mass: None,
                force: IDEAL,
                velocity: IDEAL,
                displacement: IDEAL,
                spool: IDEAL,
                supply_pressure: IDEAL,
                acceleration: IDEAL,
                load_pressure: IDEAL,
                fault: None,
            },
            dac: Dac { range: None, bits: None, delay: 0 },
            protection: Protection {
                enabled: false,
                force_warning: None,
                force_trip: None,
                displacement_warning: None,
                displacement_trip: None,
                velocity_warning: None,
                velocity_trip: None,
                spool_warning: None,
                spool_trip: None,
                start_time: 0.0,
                ramp_time: 0.5,
                soft_end: false,
                shutdown_time: 0.1,
                lost_samples: 10,
                plausibility: true,
                force_noise: None,
                displacement_noise: None,
                velocity_noise: None,
                spool_noise: 5.0e-4,
                load_pressure_tolerance: None,
                false_alarms: 1.0e-3,
                settle_time: 1.5,
                stuck_samples: 0,
                fault_time: None,
                oscillation_limit: None,
                period_tolerance: 0.1,
            },
            limits: Limits {
                valve_command: None,
                valve_command_rate: None,
                spool_warning: 0.6,
                force_range: None,
                velocity_range: None,
                spool_range: None,
                gap_time: 0.01,
            },
            verdict: Verdict {
                caution: VerdictLimits {
                    force_error: 0.1,
                    displacement_error: 0.1,
                    gain_margin: 1.2,
                    dead_time: 1e-3,
                    level_margin: 1.02,
                    oscillation: 0.05,
                    supply_pressure: 0.9,
                },
                no: VerdictLimits {
                    force_error: 0.3,
                    displacement_error: 0.3,
                    gain_margin: 1.1,
                    dead_time: 1e-4,
                    level_margin: 1.0,
                    oscillation: 0.3,
                    supply_pressure: 0.7,
                },
            },
        };
        Self { values, given: None, underlapped: None, truth: None }
    }
}
