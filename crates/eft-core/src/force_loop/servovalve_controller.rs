//! The servovalve controller, Eq. (1) of the paper, sampled: `v = G_p·(C_F·(F_c − F) + v_c) + G_d·C_F·Δ(F_c − F)/Δt`.

use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::integrity::integrity;
use crate::number::Scalar;
use crate::parameters::Parameters;

/// Proportional and derivative action on the force error. The compensation is added after the derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServovalveController<S> {
    force_sensitivity: S,
    pub(crate) proportional_gain: S,
    derivative_per_sample: S,
}
integrity!(ServovalveController<T>: force_sensitivity, proportional_gain, derivative_per_sample);

/// The last force error (V).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct ServovalveControllerState<S> {
    error: S,
}
integrity!(ServovalveControllerState<T>: error);

impl<S: Scalar> ServovalveController<S> {
    /// One sample: the valve command (V) for a force command (N), the measured force (N) and the compensation (V).
    #[inline(always)]
    pub fn step(&self, state: &mut ServovalveControllerState<S>, command: S, force: S, compensation: S) -> S {
        let error = self.force_sensitivity * (command - force);
        let rate = error - state.error;
        state.error = error;
        self.proportional_gain * (error + compensation) + self.derivative_per_sample * rate
    }
    /// The steady state at this command and force, so that the next step has no derivative kick.
    #[inline(always)]
    pub fn at_rest(&self, command: S, force: S) -> ServovalveControllerState<S> {
        ServovalveControllerState { error: self.force_sensitivity * (command - force) }
    }
    /// Controllers of single rigs in lanes.
    pub fn pack<'a>(lane: &dyn Fn(usize) -> &'a ServovalveController<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            force_sensitivity: S::from_lanes(|i| lane(i).force_sensitivity),
            proportional_gain: S::from_lanes(|i| lane(i).proportional_gain),
            derivative_per_sample: S::from_lanes(|i| lane(i).derivative_per_sample),
        }
    }
}

impl<S: Scalar> ServovalveControllerState<S> {
    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        Self { error: S::select(mask, yes.error, no.error) }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl ServovalveController<$t> {
            /// No output.
            pub(crate) const NONE: Self =
                Self { force_sensitivity: 0.0, proportional_gain: 0.0, derivative_per_sample: 0.0 };

            /// From the rig's parameters.
            ///
            /// # Errors
            /// A gain that is not finite; `C_F`, `G_p` or the sample rate not positive.
            pub const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                let rate = check!(positive("sample_rate", p.sample_rate));
                let derivative = p.derivative_gain * rate;
                Ok(Self {
                    force_sensitivity: check!(positive("force_sensitivity", p.force_sensitivity)) as $t,
                    proportional_gain: check!(positive("proportional_gain", p.proportional_gain)) as $t,
                    derivative_per_sample: check!(within("derivative_gain", derivative, -LARGEST, LARGEST))
                        as $t,
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
