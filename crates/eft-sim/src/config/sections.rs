//! One struct per section. Ranges and defaults stand in [`super::KEYS`], not here.

use serde::{Deserialize, Serialize};

/// `[actuator]`, Eq. (7).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Actuator {
    /// Effective piston area A, m².
    pub piston_area: f64,
    /// Oil compressibility of the chambers K_a, m³/Pa.
    pub compressibility: f64,
    /// Cross-piston leakage C_l, m³/(s·Pa).
    pub leakage: f64,
    /// Stroke to either side of the middle, m.
    pub stroke: f64,
    /// What is left of a chamber at the end of the stroke, its volume over the piston area, m; constant volumes
    /// where absent.
    pub dead_length: Option<f64>,
    /// Coulomb friction of the seals, N.
    pub friction: f64,
    /// Velocity below which the friction falls to zero, m/s.
    pub friction_velocity: f64,
    /// Stiffness of the stops at the ends of the stroke, N/m; no stops where absent.
    pub stop_stiffness: Option<f64>,
    /// Damping of the stops relative to their elastic force, s/m.
    pub stop_damping: f64,
}

/// `[supply]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Supply {
    /// Supply pressure P_s at which the flow curve was measured, Pa.
    pub pressure: f64,
    /// Fall of the pressure with the pump's flow, Pa·s/m³.
    pub droop: Option<f64>,
    /// Capacity of the accumulator, m³/Pa.
    pub accumulator: Option<f64>,
    /// The pump's largest flow, m³/s.
    pub pump_flow: Option<f64>,
    /// What the set pressure does during a test.
    pub schedule: Option<SupplySchedule>,
}

/// `[supply.schedule]`: the set pressure against time, straight between its points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupplySchedule {
    /// Times of the points, strictly increasing, s.
    pub times: Vec<f64>,
    /// Set pressures at the points, Pa.
    pub pressures: Vec<f64>,
}

/// `[servovalve]`: the true valve, Eqs. (2), (3) and (6).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Servovalve {
    /// Time constant of the pilot stage τ, s.
    pub pilot_time_constant: f64,
    /// Flow gain of the pilot stage K_vp, m³/(s·V).
    pub pilot_flow_gain: f64,
    /// End area of the main spool A_v, m².
    pub spool_area: f64,
    /// Stroke of the main spool to either side x_vmax, m.
    pub spool_stroke: f64,
    /// Sensitivity of the spool position sensor K_3, V/m.
    pub spool_sensitivity: f64,
    /// Scale of the true flow against the curve the controller knows, dimensionless.
    pub flow_gain_scale: f64,
    /// The flow curve f, Table 2.
    pub flow_table: FlowCurve,
    /// Largest flow of the pilot stage, m³/s.
    pub pilot_flow_limit: Option<f64>,
    /// Overlap of the spool's lands, an opening, dimensionless.
    pub overlap: f64,
    /// Leakage of the main stage, Eq. (5).
    pub leakage: ValveLeakage,
}

/// `[servovalve.leakage]`, the second part of Eq. (5).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ValveLeakage {
    /// Part proportional to the load pressure, m³/(s·Pa).
    pub proportional: f64,
    /// Constant part at `supply.pressure`, m³/s.
    pub constant: f64,
    /// Opening within which the constant part changes its sign, dimensionless.
    pub null_region: f64,
}

/// A piecewise linear flow curve through (0, 0).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlowCurve {
    /// Spool openings of the points, strictly increasing, dimensionless.
    pub openings: Vec<f64>,
    /// No-load flows at the points, strictly increasing, m³/s.
    pub flows: Vec<f64>,
}

/// `[controller]`: the servovalve controller, Eq. (1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Controller {
    /// Force sensitivity C_F, V/N.
    pub force_sensitivity: f64,
    /// Proportional gain G_p, dimensionless.
    pub proportional_gain: f64,
    /// Derivative gain G_d, s.
    pub derivative_gain: f64,
    /// Where the force loop runs.
    pub realization: Realization,
    /// Sample rate where no command brings its own, Hz.
    pub sample_rate: f64,
}

/// Where the force loop runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Realization {
    /// The loop runs in continuous time; only the compensation is sampled and held.
    Analog,
    /// The loop and the compensation are sampled; the valve command is held.
    Digital,
}

/// `[compensation]`: the velocity feedback compensation, Fig. 5 and Eq. (8).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Compensation {
    /// The scheme.
    pub mode: Mode,
    /// Compensation level, 1 = full, dimensionless.
    pub level: f64,
    /// No-load flow gain at the origin K_v, m³/s per full opening.
    pub flow_gain: f64,
    /// Valve gain K_s, 1/V.
    pub valve_gain: f64,
    /// Response delay of the valve T_d, s.
    pub response_delay: f64,
    /// Ratio of the lead network's time constants α, dimensionless.
    pub lead_alpha: f64,
    /// Delay of the compensation by computation, samples.
    pub computation_delay: u32,
    /// Which signal gives the sign of the load-pressure term.
    pub sign_from: SignFrom,
    /// Whether the command's own flow is demanded as well.
    pub feedforward: bool,
    /// Whether flow gain and valve are estimated during the test.
    pub adaptive: bool,
    /// Whether a measured supply pressure scales the flow.
    pub supply_correction: bool,
    /// Whether overcompensation takes the level back without estimates as well.
    pub guard: bool,
}

/// The compensation scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// No velocity feedback.
    Off,
    /// Constant flow gain `K_v`.
    Linear,
    /// Inverse flow curve with load-pressure correction.
    Nonlinear,
}

/// Which signal gives the sign of the load-pressure term.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SignFrom {
    /// The measured spool opening, as in the paper.
    Spool,
    /// The demanded flow, which does not chatter at null.
    Demand,
}

/// `[structure]`, Fig. 7.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Structure {
    /// The kind of structure; parts that a kind does not use are ignored.
    pub kind: StructureKind,
    /// Mass m, kg.
    pub mass: f64,
    /// Viscous damping c, N·s/m.
    pub damping: f64,
    /// Stiffness k, N/m.
    pub stiffness: f64,
    /// Softening of the bilinear elastic kind.
    pub softening: Option<Softening>,
    /// Yielding of the Bouc–Wen kind.
    pub bouc_wen: Option<BoucWen>,
    /// A power-law damper beside the viscous one, with any kind but the shear building.
    pub power_damper: Option<PowerDamper>,
    /// The stories of a shear building.
    pub stories: Option<Stories>,
}

/// The kind of structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StructureKind {
    /// Linear spring.
    Linear,
    /// Two slopes, elastic, continuous.
    Bilinear,
    /// Hysteretic.
    BoucWen,
    /// Several stories, each with an actuator.
    ShearBuilding,
}

/// Where and how a bilinear elastic spring softens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Softening {
    /// Displacement of the kink, m.
    pub displacement: f64,
    /// Stiffness beyond the kink, N/m.
    pub stiffness: f64,
}

/// How a Bouc–Wen spring yields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoucWen {
    /// Yield displacement, m.
    pub yield_displacement: f64,
    /// Stiffness after yielding over that before, dimensionless.
    pub post_yield_ratio: f64,
    /// Sharpness of the yield point n, dimensionless.
    pub exponent: f64,
    /// Share β of the loop's shape, 1 − β being γ, dimensionless.
    pub shape: f64,
}

/// The stories of a shear building, from the ground up; one actuator on each floor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stories {
    /// Masses of the floors, kg.
    pub masses: Vec<f64>,
    /// Damping of the columns below each floor, N·s/m.
    pub dampings: Vec<f64>,
    /// Stiffness of the columns below each floor, N/m.
    pub stiffnesses: Vec<f64>,
}

/// A fluid damper with a power law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PowerDamper {
    /// Force at a velocity of 1 m/s, N.
    pub coefficient: f64,
    /// Exponent of the velocity, dimensionless.
    pub exponent: f64,
}

/// `[sensors]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Seed of the noise.
    pub seed: u64,
    /// Mass between load cell and piston, part of the structure's, kg.
    pub cell_mass: Option<f64>,
    /// Load cell, N.
    pub force: Sensor,
    /// Velocity sensor, m/s.
    pub velocity: Sensor,
    /// Displacement sensor, m.
    pub displacement: Sensor,
    /// Spool position sensor, opening.
    pub spool: Sensor,
    /// Supply pressure sensor, Pa.
    pub supply_pressure: Sensor,
    /// A failure of one sensor during the test.
    pub fault: Option<SensorFault>,
}

/// One sensor; ideal when every value is at its default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Standard deviation of the noise per sample, in the signal's unit.
    pub noise: f64,
    /// First-order bandwidth, Hz.
    pub bandwidth: Option<f64>,
    /// Resolution over the range, bits.
    pub bits: Option<u32>,
    /// Range to either side, in the signal's unit.
    pub range: Option<f64>,
    /// Delay, samples.
    pub delay: u32,
    /// Constant offset, in the signal's unit.
    pub bias: f64,
    /// Share of samples that get lost, dimensionless.
    pub dropout: f64,
}

/// `[sensors.fault]`: a failure put in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorFault {
    /// The sensor that fails.
    pub signal: FaultSignal,
    /// How it fails.
    pub kind: FaultKind,
    /// When it fails, s from the start of the test.
    pub start: f64,
    /// How long, s; to the end of the test where absent.
    pub duration: Option<f64>,
}

/// The sensor that fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultSignal {
    /// The load cell.
    Force,
    /// The velocity sensor.
    Velocity,
    /// The displacement sensor.
    Displacement,
    /// The spool position sensor.
    Spool,
    /// The supply pressure sensor.
    SupplyPressure,
}

/// How a sensor fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// No valid reading, and the electronics know.
    Lost,
    /// Reads zero.
    Zero,
    /// Repeats the last reading.
    Stuck,
    /// Reads with the wrong sign.
    Sign,
}

/// `[dac]`: the converter between the digital side and the valve's electronics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dac {
    /// Range to either side, V.
    pub range: f64,
    /// Resolution over the range, bits.
    pub bits: Option<u32>,
}

/// `[limits]`: absent means unlimited.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Largest valve command to either side, V.
    pub valve_command: Option<f64>,
    /// Largest rate of the valve command, V/s.
    pub valve_command_rate: Option<f64>,
    /// Spool opening beyond which a warning flag is raised, dimensionless.
    pub spool_warning: f64,
    /// Largest plausible measured force to either side, N.
    pub force_range: Option<f64>,
    /// Largest plausible measured velocity to either side, m/s.
    pub velocity_range: Option<f64>,
    /// Largest plausible measured spool opening to either side, dimensionless.
    pub spool_range: Option<f64>,
}

/// `[protection]` of the specimen; absent levels never trip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protection {
    /// Whether the protection is in the loop.
    pub enabled: bool,
    /// Force that raises a warning, N.
    pub force_warning: Option<f64>,
    /// Force that trips the test, N.
    pub force_trip: Option<f64>,
    /// Displacement that raises a warning, m.
    pub displacement_warning: Option<f64>,
    /// Displacement that trips the test, m.
    pub displacement_trip: Option<f64>,
    /// Velocity that raises a warning, m/s.
    pub velocity_warning: Option<f64>,
    /// Velocity that trips the test, m/s.
    pub velocity_trip: Option<f64>,
    /// Spool opening that raises a warning, dimensionless.
    pub spool_warning: Option<f64>,
    /// Spool opening that trips the test, dimensionless.
    pub spool_trip: Option<f64>,
    /// Soft start, s.
    pub start_time: f64,
    /// Ramp to zero force after a trip and at the soft end, s.
    pub ramp_time: f64,
    /// Whether the command fades along the ramp at its end.
    pub soft_end: bool,
    /// Ramp of the valve command to zero in a shutdown, s.
    pub shutdown_time: f64,
    /// Invalid samples in a row that are waited for.
    pub lost_samples: u32,
}
