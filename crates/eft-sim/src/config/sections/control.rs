//! The force loop and its compensation.

use crate::config::section::{choice, section};

section! {
    /// `[controller]`: the servovalve controller, Eq. (1).
    pub struct Controller {
        /// Force sensitivity C_F, V/N.
        pub force_sensitivity: f64,
        /// Proportional gain G_p, dimensionless.
        pub proportional_gain: f64,
        /// Derivative gain G_d, s.
        pub derivative_gain: f64,
        /// Integral gain G_i of a digital force loop, 1/s; 0 means no integral.
        pub integral_gain: f64,
        /// Where the force loop runs.
        pub realization: Realization,
        /// Where its gains come from.
        pub force_loop: ForceLoop,
        /// Whether the pilot time constant and the compressibility were identified on this rig.
        pub identified_plant: bool,
        /// Sample rate for a command without its own, Hz.
        pub sample_rate: f64,
        /// Where the compensation's velocity comes from.
        pub velocity_source: VelocitySource,
        /// Latency of the load cell that is known, s.
        pub force_delay: f64,
        /// Corner of the derivative's two low-passes, Hz.
        pub velocity_corner: f64,
        /// The mass that the force moves, as the observer knows it, kg.
        pub observer_mass: Option<f64>,
        /// Standard deviation of the displacement's noise per sample, as the observer knows it, m.
        pub observer_displacement_noise: f64,
        /// The same of the acceleration, measured or the force over the mass, m/s².
        pub observer_acceleration_noise: f64,
        /// Rate at which spring and damper change the acceleration, as the observer expects it, m/s³.
        pub observer_drift: f64,
        /// Rate at which the accelerometer's error changes, as the observer expects it, m/s³.
        pub accelerometer_drift: f64,
    }
}

impl Controller {
    /// Whether the force loop has an integral part: it must be digital with an integral gain.
    pub(crate) fn integrates(&self) -> bool {
        self.realization == Realization::Digital && self.integral_gain > 0.0
    }
}

choice! {
    /// Where the compensation's velocity comes from.
    pub enum VelocitySource {
        /// The velocity sensor.
        Sensor = "sensor",
        /// The displacement sensor, differentiated and filtered.
        Derivative = "derivative",
        /// Displacement and force, through a steady-state Kalman observer.
        Observer = "observer",
        /// Displacement and accelerometer, through the same observer.
        Accelerometer = "accelerometer",
    }
}

choice! {
    /// Where the gains of the force loop come from.
    pub enum ForceLoop {
        /// The configuration: the paper's controller.
        Pd = "pd",
        /// [`crate::design`], from the rig as the controller knows it; the loop is then digital.
        Robust = "robust",
    }
}

choice! {
    /// Where the force loop runs.
    pub enum Realization {
        /// The loop runs in continuous time; only the compensation is sampled and held.
        Analog = "analog",
        /// The loop and the compensation are sampled; the valve command is held.
        Digital = "digital",
    }
}

section! {
    /// `[compensation]`: the velocity feedback compensation, Fig. 5 and Eq. (8).
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
        /// Latency of the velocity that is known, s.
        pub velocity_delay: f64,
        /// Ratio of the lead network's time constants α, dimensionless.
        pub lead_alpha: f64,
        /// Delay of the compensation by computation, samples.
        pub computation_delay: u32,
        /// Which signal gives the sign of the load-pressure term.
        pub sign_from: SignFrom,
        /// Whether the flow of the command itself is added.
        pub feedforward: bool,
        /// Whether the feedforward uses the command of the next sample.
        pub look_ahead: bool,
        /// Whether flow gain and valve are estimated during the test.
        pub adaptive: bool,
        /// Whether an adaptive rig also corrects the flow curve by direction and band of opening, except in the linear
        /// scheme.
        pub curve_correction: bool,
        /// Whether a measured supply pressure scales the flow.
        pub supply_correction: bool,
        /// Whether the guard reduces the level on overcompensation, also without estimates.
        pub guard: bool,
        /// The bounds of the learner.
        pub learning: Learning,
    }
}

impl Compensation {
    /// Whether the flow curve is corrected during the test.
    #[must_use]
    pub fn corrects_curve(&self) -> bool {
        self.adaptive && self.curve_correction && self.mode != Mode::Linear
    }

    /// Delay for which the lead network compensates without self-calibration, s: the valve's and the velocity's.
    #[must_use]
    pub fn lead_delay(&self) -> f64 {
        self.response_delay + self.velocity_delay
    }
}

section! {
    /// `[compensation.learning]`: the excitation that learning needs, and the bounds of the estimates.
    pub struct Learning {
        /// Opening below which nothing is learned, dimensionless.
        pub excitation: f64,
        /// Lowest flow gain over the table's, dimensionless.
        pub lowest_flow_gain: f64,
        /// Highest flow gain over the table's, dimensionless.
        pub highest_flow_gain: f64,
        /// Lowest valve gain over the configured one, dimensionless.
        pub lowest_valve_gain: f64,
        /// Highest valve gain over the configured one, dimensionless.
        pub highest_valve_gain: f64,
        /// Shortest response delay over the configured one, dimensionless.
        pub shortest_delay: f64,
        /// Longest response delay over the configured one, dimensionless.
        pub longest_delay: f64,
        /// Time without a new calibration after which the one in use has expired, s.
        pub age_limit: f64,
    }
}

choice! {
    /// The compensation scheme.
    pub enum Mode {
        /// No velocity feedback.
        Off = "off",
        /// Constant flow gain `K_v`.
        Linear = "linear",
        /// Inverse flow curve with load-pressure correction.
        Nonlinear = "nonlinear",
    }
}

choice! {
    /// Which signal gives the sign of the load-pressure term.
    pub enum SignFrom {
        /// The measured spool opening, as in the paper.
        Spool = "spool",
        /// The demanded flow, which does not chatter at null.
        Demand = "demand",
    }
}
