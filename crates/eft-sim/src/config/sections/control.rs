//! The force loop and its compensation.

use crate::config::schema::Kind::{Bool, Choice, Float, Int};
use crate::config::schema::Need::{Required, When};
use crate::config::schema::{OFF, ON, float, int, word};
use crate::config::section::{choice, section, words};

pub use eft_core::{Mode, Realization, SignFrom};

words!(Mode { Off = "off", Linear = "linear", Nonlinear = "nonlinear" });
words!(Realization { Analog = "analog", Digital = "digital" });
words!(SignFrom { Spool = "spool", Demand = "demand" });

section! {
    /// `[controller]`: the servovalve controller, Eq. (1).
    pub struct Controller in "controller." {
        force_sensitivity: f64 = "V/N", Float(1e-12, 1e3), Required, "force sensitivity C_F, Eq. (1)";
        proportional_gain: f64 = "", Float(1e-6, 1e6), Required, "proportional gain G_p, Eq. (1)";
        derivative_gain: f64 = "s", Float(0.0, 10.0), Required, "derivative gain G_d, Eq. (1)";
        integral_gain: f64 = "1/s", Float(0.0, 1e6), float(0.0), "integral gain G_i of a digital force loop, against a null bias; 0 for none";
        realization: Realization = "", Choice(Realization::WORDS), word("analog"), "where the force loop runs: in continuous time or sampled";
        force_loop: ForceLoop = "", Choice(ForceLoop::WORDS), word("pd"), "gains of the force loop: the configured ones, or designed from the rig to damp the oil column; the designed loop is digital";
        identified_plant: bool = "", Bool, OFF, "whether pilot time constant and oil were identified on this rig; a designed force loop then allows for smaller errors of both";
        sample_rate: f64 = "Hz", Float(1.0, 1e6), Required, "sample rate for a command without its own";
        velocity_source: VelocitySource = "", Choice(VelocitySource::WORDS), word("sensor"), "source of the velocity: its sensor, the displacement's derivative, an observer of displacement and force, or an observer of displacement and acceleration";
        force_delay: f64 = "s", Float(0.0, 0.1), float(0.0), "known latency of the load cell; the command is played this much later, so that the force is on time";
        velocity_corner: f64 = "Hz", Float(1e-3, 1e6), float(80.0), "corner of the two low-passes of the derivative";
        observer_mass: Option<f64> = "kg", Float(1e-3, 1e12), When("controller.velocity_source", "observer"), "mass that the force moves, in the observer";
        observer_displacement_noise: f64 = "m", Float(1e-12, 1.0), float(6.4e-5), "noise of the displacement per sample, in the observer";
        observer_acceleration_noise: f64 = "m/s²", Float(1e-9, 1e6), float(0.02), "noise of the acceleration per sample (measured, or force over mass), in the observer";
        observer_drift: f64 = "m/s³", Float(1e-6, 1e9), float(200.0), "rate at which spring and damper change the acceleration, in the observer";
        accelerometer_drift: f64 = "m/s³", Float(1e-6, 1e9), float(1.0), "rate at which the accelerometer's error changes, in the observer of displacement and acceleration";
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

section! {
    /// `[compensation]`: the velocity feedback compensation, Fig. 5 and Eq. (8).
    pub struct Compensation in "compensation." {
        mode: Mode = "", Choice(Mode::WORDS), Required, "velocity feedback scheme";
        level: f64 = "", Float(0.0, 10.0), float(1.0), "compensation level, 1 = full";
        flow_gain: f64 = "m³/s", Float(1e-12, 1e3), Required, "no-load flow gain at the origin K_v, of the linear scheme";
        valve_gain: f64 = "1/V", Float(1e-6, 1e6), Required, "valve gain K_s, Eq. (8)";
        response_delay: f64 = "s", Float(0.0, 1.0), Required, "response delay of the valve T_d, Eq. (8)";
        velocity_delay: f64 = "s", Float(0.0, 0.1), float(0.0), "known latency of the velocity, for which the lead network also compensates";
        lead_alpha: f64 = "", Float(1e-3, 0.99), Required, "ratio of the lead network's time constants α, Eq. (8)";
        computation_delay: u32 = "samples", Int(0, 1000), int(0), "delay of the compensation by computation";
        sign_from: SignFrom = "", Choice(SignFrom::WORDS), word("spool"), "signal that gives the sign of the load-pressure term";
        feedforward: bool = "", Bool, OFF, "add the flow that the command itself needs";
        look_ahead: bool = "", Bool, OFF, "use the next sample's command for feedforward and load pressure; needs `compensation.feedforward`";
        adaptive: bool = "", Bool, OFF, "estimate flow gain, delays and valve gain during the test, with the guard against overcompensation";
        curve_correction: bool = "", Bool, ON, "with `compensation.adaptive`, also correct the flow curve by direction and band of opening during the test; no effect in the linear scheme";
        supply_correction: bool = "", Bool, OFF, "scale the flow by a measured supply pressure; works without estimates";
        guard: bool = "", Bool, OFF, "reduce the level if overcompensation feeds energy into the structure; works without estimates";
        /// The bounds of the learner.
        learning: Learning;
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
    pub struct Learning in "compensation.learning." {
        excitation: f64 = "", Float(1e-6, 0.5), float(5.0e-4), "opening below which nothing is learned";
        lowest_flow_gain: f64 = "", Float(0.01, 1.0), float(0.7), "lowest flow gain that is learned, over the table's";
        highest_flow_gain: f64 = "", Float(1.0, 100.0), float(1.35), "highest flow gain that is learned, over the table's";
        lowest_valve_gain: f64 = "", Float(0.01, 1.0), float(0.8), "lowest valve gain that is learned, over `compensation.valve_gain`";
        highest_valve_gain: f64 = "", Float(1.0, 100.0), float(1.25), "highest valve gain that is learned, over `compensation.valve_gain`";
        shortest_delay: f64 = "", Float(0.01, 1.0), float(0.2), "shortest response delay that is learned, over `compensation.response_delay`";
        longest_delay: f64 = "", Float(1.0, 100.0), float(4.0), "longest response delay that is learned, over `compensation.response_delay`";
        age_limit: f64 = "s", Float(0.02, 1e3), float(1.0), "age after which the calibration in use has expired: a flag is raised, and a protection trips";
    }
}
