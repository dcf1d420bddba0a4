//! What the learner has found out about the rig, as the tick uses it.

use crate::compensation::{CurvePiece, LeadNetwork, PIECES, table_itself};
use crate::error::{ConfigError, check, positive};
use crate::number::Scalar;
use crate::parameters::Parameters;

/// The only thing that flows from the learner to the tick: plain data, made once a window.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Calibration<S: Scalar> {
    /// Number of the window that it was made of; `u32::MAX` where it was made of the configuration.
    pub window: u32,
    /// Bits of [`status`](crate::status) about the learning.
    pub status: S::Flags,
    /// True flow over the table's, `θ` (1).
    pub flow_gain: S,
    /// 1/`flow_gain` (1), which the tick multiplies by.
    pub per_flow_gain: S,
    /// The inverse of the valve as it was found, with the guard's level in its gain.
    pub lead: LeadNetwork<S>,
    /// Delay (s) that the lead network makes up for: the valve's, half a sample of hold and any computation.
    pub response_delay: S,
    /// The spool's gain over the configured one (1).
    pub valve_gain: S,
    /// The guard's factor on the compensation level (1).
    pub level: S,
    /// The gate's test ratio (1): what the models leave unexplained over what is allowed. Above 1 nothing is learned.
    pub test_ratio: S,
    /// The flow table's correction, from the most negative flow up.
    pub curve: [CurvePiece<S>; PIECES],
}

impl<S: Scalar> Calibration<S> {
    /// The paper's scheme, by a lead network and the response delay (s) that it makes up for.
    pub(crate) fn of(lead: LeadNetwork<S>, response_delay: S) -> Self {
        let one = S::splat(1.0);
        Self {
            window: u32::MAX,
            status: S::Flags::default(),
            flow_gain: one,
            per_flow_gain: one,
            lead,
            response_delay,
            valve_gain: one,
            level: one,
            test_ratio: S::splat(0.0),
            curve: table_itself(),
        }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl Calibration<$t> {
            /// The paper's scheme: the configured valve, the flow table as it is.
            ///
            /// # Errors
            /// A valve gain, proportional gain, response delay, `α` or sample rate that is refused, by name.
            pub fn nominal(p: &Parameters) -> Result<Self, ConfigError> {
                Ok(Self::of(check!(LeadNetwork::<$t>::by(p)), p.response_delay as $t))
            }
        }

        impl LeadNetwork<$t> {
            /// By the configuration.
            pub(crate) const fn by(p: &Parameters) -> Result<Self, ConfigError> {
                let valve_gain = check!(positive("valve_gain", p.valve_gain));
                let gain = 1.0 / (check!(positive("proportional_gain", p.proportional_gain)) * valve_gain);
                Self::new(gain, p.response_delay, p.lead_alpha, p.sample_rate)
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
