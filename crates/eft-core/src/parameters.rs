//! The parameters of a channel and its learner: one set of numbers for firmware, C, export and simulator.

mod protection;

pub use protection::{Levels, PlausibilityParameters, ProtectionParameters};

use crate::checksum::{Integrity, Word};

/// The rig as its controller knows it, in SI units, and the parts of the controller that are switched on.
///
/// [`Parameters::ZHAO2005`] is the paper's rig. `f64::MAX` in a limit or range means none.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(remote = "Self", deny_unknown_fields)
)]
pub struct Parameters<'a> {
    /// Ticks per second (Hz).
    pub sample_rate: f64,
    /// Where the force loop is closed.
    pub realization: Realization,
    /// The compensation scheme.
    pub mode: Mode,
    /// Compensation level (1): 1 is full compensation, 1.02 is 2 % over.
    pub level: f64,
    /// Source of the sign in the load-pressure correction.
    pub sign_from: SignFrom,
    /// Piston area `A` (m²).
    pub piston_area: f64,
    /// Supply pressure `P_s` (Pa) at which the flow table holds.
    pub supply_pressure: f64,
    /// Whether the supply pressure is measured and its deviations from `supply_pressure` are corrected.
    pub supply_correction: bool,
    /// Oil compressibility of the chambers `K_a` (m³/Pa).
    pub compressibility: f64,
    /// Cross-piston leakage `C_l` (m³/(s·Pa)).
    pub leakage: f64,
    /// Coulomb friction `F_c` of the actuator's seals (N), which the oil carries besides the force; 0 for none.
    pub friction: f64,
    /// Velocity `v_0` (m/s) below which the friction falls to zero.
    pub friction_velocity: f64,
    /// Overlap of the spool's lands (1), an opening without flow, which is not in the flow table; 0 for none.
    pub overlap: f64,
    /// Known null bias of the valve (1, within ±0.5): the spool opening at which it passes nothing at no load. The
    /// controller adds it to every opening; 0 for none.
    pub null_bias: f64,
    /// Spool openings (1) of the flow table, strictly increasing.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub openings: &'a [f64],
    /// Flows (m³/s) of the flow table, strictly increasing.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub flows: &'a [f64],
    /// Flow gain `K_v` (m³/s per unit opening) of the linear scheme.
    pub flow_gain: f64,
    /// Valve gain `K_s` (unit opening per V).
    pub valve_gain: f64,
    /// Response delay `T_d` (s) of the valve, for which the lead network compensates.
    pub response_delay: f64,
    /// The lead network's `α` (1).
    pub lead_alpha: f64,
    /// Where the velocity comes from.
    pub velocity_source: VelocitySource,
    /// Delay of the velocity (s), at most 1. A learning lead network compensates for it and for the valve's.
    pub velocity_delay: f64,
    /// Delay of the compensation by computation (samples, at most 1000), before it appears in the valve command.
    pub computation_delay: u32,
    /// Whether the flow that the command needs is demanded in addition to the piston's.
    pub feedforward: bool,
    /// Whether the feedforward uses the next tick's command, and the load-pressure correction uses it in place of the
    /// measured force.
    pub look_ahead: bool,
    /// Force sensitivity `C_F` (V/N) of the force loop.
    pub force_sensitivity: f64,
    /// Proportional gain `G_p` (V/V) of the force loop.
    pub proportional_gain: f64,
    /// Derivative gain `G_d` (s) of the force loop.
    pub derivative_gain: f64,
    /// Integral gain `G_i` (1/s) of a force loop that is closed in the channel; 0 for none.
    pub integral_gain: f64,
    /// Largest valve command (V).
    pub valve_command: f64,
    /// Largest rate of the valve command (V/s).
    pub valve_command_rate: f64,
    /// Opening (1) beyond which [`status::SPOOL_WARNING`](crate::status::SPOOL_WARNING) is raised.
    pub spool_warning: f64,
    /// Velocity (m/s) beyond which a measurement is invalid.
    pub velocity_range: f64,
    /// Force (N) beyond which a measurement is invalid.
    pub force_range: f64,
    /// Spool opening (1) beyond which a measurement is invalid.
    pub spool_range: f64,
    /// Time (s) without a valid sample after which the controller resumes at the new operating point. The
    /// change since the last sample is then not that of one tick. With `f64::MAX` the controller continues from its
    /// last state.
    pub gap_time: f64,
    /// What is learned during the test.
    pub learning: Learning,
    /// The protection of the specimen.
    pub protection: Option<ProtectionParameters>,
    /// Number of samples that a measurement may repeat to the last bit before it counts as stuck; 0 for no check.
    pub stuck_samples: u32,
}

/// Where the force loop is closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[repr(u8)]
pub enum Realization {
    /// The channel closes it: the output is the valve command.
    Digital = 0,
    /// An analog controller closes it, as on the paper's rig: the output is the compensation signal for that
    /// controller.
    Analog = 1,
}

impl Integrity for Realization {
    fn add_to(&self, word: &mut Word) {
        word.add(*self as u32);
    }
}

/// The compensation scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[repr(u8)]
pub enum Mode {
    /// The piston's motion is not compensated.
    Off = 0,
    /// The flow is converted by the initial flow gain `K_v`.
    Linear = 1,
    /// The flow is converted by the inverse flow table with the load-pressure correction.
    Nonlinear = 2,
}

/// Source of the sign of the spool opening in the load-pressure correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[repr(u8)]
pub enum SignFrom {
    /// The measured spool, as in the paper; it chatters near null.
    Spool = 0,
    /// The demanded flow, free of chatter and of the loop through the spool.
    Demand = 1,
}

/// Where the velocity comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case", deny_unknown_fields)
)]
pub enum VelocitySource {
    /// A sensor.
    Sensor,
    /// The filtered derivative of the displacement.
    Derivative {
        /// Corner of its two low-passes (Hz).
        corner: f64,
    },
    /// An observer of displacement and force.
    Observer {
        /// Gains on displacement (1), velocity (1/s) and drift (1/s²).
        gains: [f64; 3],
        /// Mass (kg) that the force moves.
        mass: f64,
    },
    /// The same observer with a measured acceleration.
    Accelerometer {
        /// Gains on displacement (1), velocity (1/s) and drift (1/s²).
        gains: [f64; 3],
    },
}

/// What is learned during the test, and within which bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Learning {
    /// Whether flow gain and valve are estimated.
    pub adaptive: bool,
    /// Whether the flow table is corrected by direction and band of flow. It has an effect with `adaptive`, except in
    /// the linear scheme.
    pub curve_correction: bool,
    /// Whether overcompensation reduces the level.
    pub guard: bool,
    /// Opening (1) below which nothing is learned.
    pub excitation: f64,
    /// Bounds of the flow gain over the table's (1), within [0.01, 100].
    pub flow_gain_bounds: [f64; 2],
    /// Bounds of the valve gain over the configured one (1), within [0.01, 100].
    pub valve_gain_bounds: [f64; 2],
    /// Bounds of the response delay over the configured one (1); the longest delay is at most 10 s.
    pub response_delay_bounds: [f64; 2],
    /// Time (s), at least 0.02, without a new calibration, after which the one in use has expired; `f64::MAX` for
    /// never.
    pub age_limit: f64,
}

impl Learning {
    /// Nothing is learned; the bounds are the usual ones.
    pub const OFF: Self = Self {
        adaptive: false,
        curve_correction: false,
        guard: false,
        excitation: 5.0e-4,
        flow_gain_bounds: [0.7, 1.35],
        valve_gain_bounds: [0.8, 1.25],
        response_delay_bounds: [0.2, 4.0],
        age_limit: 1.0,
    };
    /// Flow gain, valve and flow curve are estimated, under the guard.
    pub const ADAPTIVE: Self = Self { adaptive: true, curve_correction: true, guard: true, ..Self::OFF };

    /// Whether there is a learner.
    pub const fn is_on(&self) -> bool {
        self.adaptive || self.guard
    }
}

impl Parameters<'_> {
    /// Whether the channel's force loop has an integral part.
    pub(crate) const fn integrates(&self) -> bool {
        matches!(self.realization, Realization::Digital) && self.integral_gain > 0.0
    }

    /// The greatest flow (m³/s) of the flow table, or of the linear scheme's straight line.
    pub(crate) const fn greatest_flow(&self) -> f64 {
        match (self.mode, self.flows) {
            (Mode::Off | Mode::Nonlinear, [first, .., last]) => {
                if -*first > *last {
                    -*first
                } else {
                    *last
                }
            }
            _ => self.flow_gain,
        }
    }
}

/// m³ per in³.
const CUBIC_INCH: f64 = 1.6387064e-5;

/// Table 2 of the paper with the origin, from in³/s.
const ZHAO2005_FLOWS: [f64; 21] = {
    let mut flows = [
        -536.2, -508.2, -480.2, -452.3, -419.9, -377.1, -324.2, -260.9, -188.2, -101.0, 0.0, 102.2, 187.2,
        260.4, 321.1, 369.8, 411.2, 441.0, 468.3, 495.7, 523.0,
    ];
    let mut n = 0;
    #[allow(clippy::indexing_slicing, reason = "bounded; iterators are not constant yet")]
    while n < flows.len() {
        flows[n] *= CUBIC_INCH;
        n += 1;
    }
    flows
};

impl Parameters<'static> {
    /// The paper's rig (Tables 1 and 2) at 4096 Hz, the force loop closed in the channel, no limits, nothing learned.
    pub const ZHAO2005: Self = Self {
        sample_rate: 4096.0,
        realization: Realization::Digital,
        mode: Mode::Nonlinear,
        level: 1.0,
        sign_from: SignFrom::Spool,
        piston_area: 8.212e-3,
        supply_pressure: 1.9e7,
        supply_correction: false,
        compressibility: 7.56e-13,
        leakage: 1.3e-11,
        friction: 0.0,
        friction_velocity: 1e-3,
        overlap: 0.0,
        null_bias: 0.0,
        openings: &[
            -1.0, -0.9, -0.8, -0.7, -0.6, -0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6,
            0.7, 0.8, 0.9, 1.0,
        ],
        flows: &ZHAO2005_FLOWS,
        flow_gain: 1.64e-2,
        valve_gain: 0.1,
        response_delay: 5.0e-3,
        lead_alpha: 0.1,
        velocity_source: VelocitySource::Sensor,
        velocity_delay: 0.0,
        computation_delay: 0,
        feedforward: false,
        look_ahead: false,
        force_sensitivity: 5.6e-5,
        proportional_gain: 0.8059,
        derivative_gain: 2.0e-4,
        integral_gain: 0.0,
        valve_command: f64::MAX,
        valve_command_rate: f64::MAX,
        spool_warning: 0.6,
        velocity_range: f64::MAX,
        force_range: f64::MAX,
        spool_range: f64::MAX,
        gap_time: 0.0025,
        learning: Learning::OFF,
        protection: None,
        stuck_samples: 0,
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adaptation_and_guard_need_a_learner() {
        let on = |adaptive, guard| Learning { adaptive, guard, ..Learning::OFF }.is_on();
        assert_eq!([on(false, false), on(true, false), on(false, true)], [false, true, true]);
        let learner = |learning: Learning| (learning.adaptive, learning.guard, learning.curve_correction);
        assert_eq!(learner(Learning::OFF), (false, false, false));
        assert_eq!(learner(Learning::ADAPTIVE), (true, true, true));
    }

    #[test]
    fn only_a_loop_that_the_channel_closes_integrates() {
        let integrates = |realization, integral_gain| {
            Parameters { realization, integral_gain, ..Parameters::ZHAO2005 }.integrates()
        };
        assert!(integrates(Realization::Digital, 4.0) && !integrates(Realization::Digital, 0.0));
        assert!(!integrates(Realization::Analog, 4.0));
    }

    #[test]
    fn the_greatest_flow_is_that_of_either_direction() {
        let greatest =
            |mode, flows: &[f64]| Parameters { mode, flows, ..Parameters::ZHAO2005 }.greatest_flow();
        for (mode, flows, expected) in [
            (Mode::Nonlinear, [-3.0, 0.0, 2.0], 3.0),
            (Mode::Off, [-1.0, 0.0, 2.0], 2.0),
            (Mode::Linear, [-3.0, 0.0, 2.0], 1.64e-2),
        ] {
            assert!((greatest(mode, &flows) - expected).abs() < 1e-15, "{mode:?} {flows:?}");
        }
    }

    /// The controller of the paper: a proportional-derivative loop with velocity feedback, and nothing else.
    #[test]
    fn the_papers_rig_has_neither_feedforward_nor_a_measured_supply() {
        let Parameters { feedforward, look_ahead, supply_correction, .. } = Parameters::ZHAO2005;
        assert!(!feedforward && !look_ahead && !supply_correction);
    }
}
