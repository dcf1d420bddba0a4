//! Flow feedforward: the flow that the command needs in addition to the piston's.
//!
//! To hold the force `F_c` the actuator takes `A·ẋ + (K_a/A)·Ḟ_c + (C_l/A)·F_c`, Eq. (7) solved for the load flow. The
//! paper demands the first term only and leaves the rest to the force error, which therefore never vanishes. The
//! inverse is taken of the sum, because the flow curve is concave and two inverses do not add up.

use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::integrity::integrity;
use crate::number::Scalar;
use crate::parameters::Parameters;

/// Flow per force and per change of force from one sample to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feedforward<S> {
    flow_per_force: S,
    flow_per_change: S,
}
integrity!(Feedforward<T>: flow_per_force, flow_per_change);

/// The last command and friction (N).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct FeedforwardState<S> {
    command: S,
    friction: S,
}
integrity!(FeedforwardState<T>: command, friction);

impl<S: Scalar> FeedforwardState<S> {
    /// The last valid command (N).
    #[inline(always)]
    pub(crate) fn command(&self) -> S {
        self.command
    }

    /// This friction (N) where the mask is true, the last one elsewhere.
    #[inline(always)]
    pub(crate) fn friction_where(&self, mask: S::Mask, friction: S) -> S {
        S::select(mask, friction, self.friction)
    }

    /// `yes` where the mask is true, `no` elsewhere.
    pub(crate) fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        Self {
            command: S::select(mask, yes.command, no.command),
            friction: S::select(mask, yes.friction, no.friction),
        }
    }
}

impl<S: Scalar> Feedforward<S> {
    /// One sample: the flow (m³/s) that the force command (N) and the friction (N) of the seals need, their rate taken
    /// from the last sample to this one. Without a friction the last one stays. If the command is known in advance,
    /// pass a later one. One sample ahead compensates for the delays of this difference and of the hold of the output.
    ///
    /// # NaN
    /// A command that is not finite, or beyond [`LARGEST`], counts as the last one: finite for every input.
    ///
    /// # Cost
    /// Two multiplications, two additions; three more with a friction.
    #[inline(always)]
    pub fn step(&self, state: &mut FeedforwardState<S>, command: S, friction: Option<S>) -> S {
        let command = S::select(command.abs().le(S::splat(LARGEST)), command, state.command);
        let (mut force, mut change) = (command, command - state.command);
        state.command = command;
        if let Some(friction) = friction {
            force = force + friction;
            change = change + (friction - state.friction);
            state.friction = friction;
        }
        self.flow_per_change * change + self.flow_per_force * force
    }
    /// The steady state at this command (N) and friction (N), so that the next step does not see a jump of either.
    #[inline(always)]
    pub fn at_rest(&self, command: S, friction: Option<S>) -> FeedforwardState<S> {
        let (valid, zero) = (command.abs().le(S::splat(LARGEST)), S::splat(0.0));
        FeedforwardState { command: S::select(valid, command, zero), friction: friction.unwrap_or(zero) }
    }
    /// Feedforwards of single rigs in lanes.
    pub fn pack<'a>(lane: &dyn Fn(usize) -> &'a Feedforward<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            flow_per_force: S::from_lanes(|i| lane(i).flow_per_force),
            flow_per_change: S::from_lanes(|i| lane(i).flow_per_change),
        }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl Feedforward<$t> {
            /// No feedforward: the flow is zero for any command.
            pub const OFF: Self = Self { flow_per_force: 0.0, flow_per_change: 0.0 };

            /// From the rig's parameters.
            ///
            /// # Errors
            /// An area, compressibility or rate that is not positive, a leakage that is negative, or any not finite.
            pub const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                let area = check!(positive("piston_area", p.piston_area));
                let volume = check!(positive("compressibility", p.compressibility));
                let leakage = check!(within("leakage", p.leakage, 0.0, LARGEST));
                let rate = check!(positive("sample_rate", p.sample_rate));
                let flow_per_force = check!(within("leakage", leakage / area, 0.0, LARGEST));
                let flow_per_change = check!(within("compressibility", volume / area * rate, 0.0, LARGEST));
                Ok(Self { flow_per_force: flow_per_force as $t, flow_per_change: flow_per_change as $t })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flow_is_what_the_actuator_takes() {
        let Parameters { piston_area: area, compressibility: volume, leakage, sample_rate: rate, .. } =
            Parameters::ZHAO2005;
        let feedforward = Feedforward::<f64>::new(&Parameters::ZHAO2005).unwrap();
        let mut state = feedforward.at_rest(1000.0, None);
        assert!((feedforward.step(&mut state, 1000.0, None) - leakage / area * 1000.0).abs() < 1e-20);
        let expected = volume / area * 2.0 * rate + leakage / area * 1002.0;
        assert!((feedforward.step(&mut state, 1002.0, None) - expected).abs() < 1e-18);
    }

    #[test]
    fn friction_takes_the_flow_of_an_equal_force_and_stays_where_none_is_given() {
        let feedforward = Feedforward::<f64>::new(&Parameters::ZHAO2005).unwrap();
        let mut state = feedforward.at_rest(1000.0, Some(-80.0));
        let mut combined = feedforward.at_rest(920.0, None);
        let reversed = feedforward.step(&mut state, 1010.0, Some(80.0));
        assert!((reversed - feedforward.step(&mut combined, 1090.0, None)).abs() < 1e-18);
        feedforward.step(&mut state, 1010.0, None);
        let held = feedforward.step(&mut state, 1010.0, Some(80.0));
        let rest = feedforward.step(&mut combined, 1090.0, None);
        assert!((held - rest).abs() < 1e-18, "{held} {rest}");
    }

    #[test]
    fn a_command_that_is_not_finite_counts_as_the_last_one() {
        let feedforward = Feedforward::<f32>::new(&Parameters::ZHAO2005).unwrap();
        let mut state = feedforward.at_rest(500.0, None);
        let rest = feedforward.step(&mut state, 500.0, None);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(feedforward.step(&mut state, bad, None).to_bits(), rest.to_bits());
        }
        assert_eq!(state, feedforward.at_rest(500.0, None));
        assert_eq!(feedforward.at_rest(f32::NAN, None), FeedforwardState::default());
    }

    #[test]
    fn refused_by_name() {
        const RIG: Parameters = Parameters::ZHAO2005;
        for (name, parameters) in [
            ("piston_area", Parameters { piston_area: 0.0, ..RIG }),
            ("compressibility", Parameters { compressibility: f64::NAN, ..RIG }),
            ("leakage", Parameters { leakage: -1.0, ..RIG }),
            ("sample_rate", Parameters { sample_rate: f64::INFINITY, ..RIG }),
        ] {
            match Feedforward::<f64>::new(&parameters).unwrap_err() {
                ConfigError::NotFinite { parameter }
                | ConfigError::NotPositive { parameter, .. }
                | ConfigError::OutOfRange { parameter, .. } => assert_eq!(parameter, name),
                other => panic!("{other:?}"),
            }
        }
    }
}
