//! Inverse valve dynamics: the phase-lead network, Eq. (8) of the paper.

use crate::error::{ConfigError, check, positive, within};
use crate::integrity::integrity;
use crate::number::Scalar;

/// `H(s) = gain · (T_ld·s + 1)/(α·T_ld·s + 1)`, `T_ld = T_d/(1 − α)`, discretised by Tustin.
///
/// Written as `gain · (1 + washout)`. At rest the washout is zero for any coefficients. The DC gain is therefore
/// exactly `gain`, and coefficients can change during the test without a bump.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct LeadNetwork<S> {
    pole: S,
    rate: S,
    gain: S,
}
integrity!(LeadNetwork<T>: pole, rate, gain);

/// The state of the lead network.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct LeadState<S> {
    input: S,
    washout: S,
}
integrity!(LeadState<T>: input, washout);

impl<S: Scalar> LeadNetwork<S> {
    /// One sample: output in V for a required spool opening (1).
    ///
    /// # Cost
    /// Three multiplications, three additions.
    #[inline(always)]
    pub fn step(&self, state: &mut LeadState<S>, input: S) -> S {
        let washout = self.pole * state.washout + self.rate * (input - state.input);
        *state = LeadState { input, washout };
        self.gain * (input + washout)
    }
    /// The steady state: a constant `input` then gives `gain · input` at once.
    #[inline(always)]
    pub fn at_rest(input: S) -> LeadState<S> {
        LeadState { input, washout: S::splat(0.0) }
    }
    /// From coefficients that a learner has computed.
    #[inline(always)]
    pub(crate) fn of(pole: S, rate: S, gain: S) -> Self {
        Self { pole, rate, gain }
    }
    /// The share of the washout that remains from sample to sample (1).
    pub(crate) const fn pole(&self) -> S {
        self.pole
    }
    /// The share of a change of the input that enters the washout (1).
    pub(crate) const fn rate(&self) -> S {
        self.rate
    }
    /// DC gain, V per unit opening.
    pub const fn gain(&self) -> S {
        self.gain
    }
    /// Networks of single rigs in lanes.
    #[inline(always)]
    pub fn pack<'a>(lane: &dyn Fn(usize) -> &'a LeadNetwork<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            pole: S::from_lanes(|i| lane(i).pole),
            rate: S::from_lanes(|i| lane(i).rate),
            gain: S::from_lanes(|i| lane(i).gain),
        }
    }
}

impl<S: Scalar> LeadState<S> {
    /// With another last input, and the same washout.
    #[inline(always)]
    pub(crate) fn resumed(self, input: S) -> Self {
        Self { input, ..self }
    }
    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        Self {
            input: S::select(mask, yes.input, no.input),
            washout: S::select(mask, yes.washout, no.washout),
        }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl LeadNetwork<$t> {
            /// No output.
            pub(crate) const NONE: Self = Self { pole: 0.0, rate: 0.0, gain: 0.0 };

            /// From DC gain (V), response delay `T_d` (s), `α` (1) and sample rate (Hz); coefficients are computed
            /// in `f64` and rounded once.
            ///
            /// # Errors
            /// `gain` or `sample_rate` not positive, `response_delay` outside [0, 1] s,
            /// `lead_alpha` outside [0.001, 0.999], a sample so short that the pole rounds to 1.
            pub const fn new(
                gain: f64,
                response_delay: f64,
                lead_alpha: f64,
                sample_rate: f64,
            ) -> Result<Self, ConfigError> {
                let gain = check!(positive("gain", gain)) as $t;
                let delay = check!(within("response_delay", response_delay, 0.0, 1.0));
                let alpha = check!(within("lead_alpha", lead_alpha, 0.001, 0.999));
                let period = 1.0 / check!(positive("sample_rate", sample_rate));
                let lag = 2.0 * alpha * delay / (1.0 - alpha);
                let (mut pole, mut rate) = ((lag - period) / (lag + period), 2.0 * delay / (lag + period));
                // Tustin's rule puts the pole of a vanishing lag at −1, where it would ring forever. Such a lag becomes
                // a backward difference with the same lead.
                if pole < -0.9999 {
                    (pole, rate) = (0.0, delay / period);
                }
                let (pole, rate) = (pole as $t, rate as $t);
                if pole >= 1.0 {
                    return Err(ConfigError::OutOfRange {
                        parameter: "sample_rate",
                        value: sample_rate,
                        lowest: 0.0,
                        highest: 1.0e6 / lag,
                    });
                }
                Ok(Self { pole, rate, gain })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
