//! The learner's estimates as traces: its lines of the table of traces.

use eft_core::Calibration;

use crate::closed_loop::Precision;
use crate::config::RigConfig;
use crate::lanes::Num;

/// Passes its lines, `name: unit, description, value of a calibration => value of a rig that does not learn`,
/// to a macro, before the macro's other arguments.
macro_rules! estimates {
    ($then:ident! { $($more:tt)* }) => {
        $then! {
            learner |calibration| {
                flow_gain_estimate: "", "Flow gain in use over that of the table",
                    calibration.flow_gain => |_| 1.0;
                response_delay_estimate: "s", "Delay of the spool for which the controller compensates",
                    calibration.response_delay => |rig| rig.compensation.response_delay;
                velocity_delay_estimate: "s", "Delay of the velocity after the spool for which the controller also compensates",
                    calibration.velocity_delay => |rig| rig.compensation.velocity_delay;
                valve_gain_estimate: "", "Spool's gain in use over the configured one",
                    calibration.valve_gain => |_| 1.0;
                null_offset_estimate: "", "Commanded opening at which the valve passes nothing, which the controller adds",
                    calibration.null_offset => |rig| rig.servovalve.null_bias;
                level: "", "Factor of the overcompensation guard on the compensation level; 1 without its action",
                    calibration.level => |_| 1.0;
                flow_gain_deviation: "", "Standard deviation of the flow gain, by noise and errors of the models; infinite before anything is learned",
                    calibration.deviations.flow_gain => |_| f64::INFINITY;
                response_delay_deviation: "s", "Standard deviation of the spool's delay, as that of the flow gain; infinite before anything is learned",
                    calibration.deviations.response_delay => |_| f64::INFINITY;
                velocity_delay_deviation: "s", "Standard deviation of the velocity's delay, as that of the flow gain; infinite before anything is learned",
                    calibration.deviations.velocity_delay => |_| f64::INFINITY;
                valve_gain_deviation: "", "Standard deviation of the spool's gain, as that of the flow gain; infinite before anything is learned",
                    calibration.deviations.valve_gain => |_| f64::INFINITY;
                null_offset_deviation: "", "Standard deviation of the null offset, as that of the flow gain; infinite before anything is learned",
                    calibration.deviations.null_offset => |_| f64::INFINITY;
                test_ratio: "", "Test ratio of the gate in the last window; above 1 nothing is learned from it",
                    calibration.test_ratio => |_| 0.0;
            }
            $($more)*
        }
    };
}
pub(crate) use estimates;

macro_rules! define {
    (learner |$calibration:ident| {
        $($learned:ident: $learned_unit:literal, $learned_doc:literal, $found:expr => $nominal:expr;)*
    }) => {
        /// The learner's estimates as the controller uses them.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub(crate) struct Estimates<S> {
            $(pub(crate) $learned: S,)*
        }

        /// The fields of [`Estimates`] by name.
        pub(crate) const FIELDS: &[(&str, fn(&Estimates<f64>) -> f64)] =
            &[$((stringify!($learned), |estimates| estimates.$learned),)*];

        impl<S: Num> Estimates<S> {
            /// The values of rigs that do not learn, one per lane.
            pub(crate) fn nominal<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
                let of = |nominal: fn(&RigConfig) -> f64| S::from_lanes(|lane| nominal(rig(lane)));
                Self { $($learned: of($nominal),)* }
            }

            /// The estimates of the calibrations in use; `self` for lanes without one.
            #[inline(always)]
            pub(crate) fn or<'a, P: Precision>(self, of: impl Fn(usize) -> Option<&'a Calibration<P>>) -> Self {
                Self {
                    $($learned: S::from_lanes(|lane| match of(lane) {
                        Some($calibration) => $found.to_f64(),
                        None => self.$learned.lane(lane),
                    }),)*
                }
            }

            /// The estimates of one lane.
            pub(crate) fn lane(&self, lane: usize) -> Estimates<f64> {
                Estimates { $($learned: self.$learned.lane(lane),)* }
            }

            /// Whether every bit is equal.
            #[inline(always)]
            pub(crate) fn same_bits(&self, other: &Self) -> bool {
                let same = |a: S, b: S| (0..S::LANES).all(|i| a.lane(i).to_bits() == b.lane(i).to_bits());
                $(same(self.$learned, other.$learned))&&*
            }

            /// The estimates of an external controller, which are unknown.
            pub(crate) fn unknown() -> Self {
                Self { $($learned: S::splat(f64::NAN),)* }
            }
        }
    };
}
estimates!(define! {});

impl Estimates<f64> {
    /// Name and value of each.
    pub(crate) fn named(&self) -> Vec<(&'static str, f64)> {
        FIELDS.iter().map(|(name, of)| (*name, of(self))).collect()
    }

    /// Of several floors, name and value of each estimate at the floor where it differs most from `self`.
    pub(crate) fn farthest(&self, floors: &[Self]) -> Vec<(&'static str, f64)> {
        let value = |of: fn(&Self) -> f64| {
            let start = if of(self).is_finite() { of(self) } else { 0.0 };
            floors.iter().map(of).fold(of(self), |most, value| {
                let farther = (value - start).abs() > (most - start).abs();
                if farther || !most.is_finite() { value } else { most }
            })
        };
        FIELDS.iter().map(|(name, of)| (*name, value(*of))).collect()
    }
}

/// Estimates that a controller uses until they change.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EstimatesInUse<S> {
    pub(crate) estimates: Estimates<S>,
    /// Number of changes since the start.
    pub(crate) changes: u32,
}

impl<S: Num> EstimatesInUse<S> {
    pub(crate) fn new(estimates: Estimates<S>) -> Self {
        Self { estimates, changes: 0 }
    }

    /// Unknown estimates, before any others.
    pub(crate) fn none() -> Self {
        Self { estimates: Estimates::unknown(), changes: u32::MAX }
    }

    /// Uses these estimates from now on, which may be the same.
    pub(crate) fn update(&mut self, estimates: Estimates<S>) {
        if !self.estimates.same_bits(&estimates) {
            self.replace(estimates);
        }
    }

    /// Uses other estimates from now on.
    #[inline(always)]
    pub(crate) fn replace(&mut self, estimates: Estimates<S>) {
        *self = Self { estimates, changes: self.changes.wrapping_add(1) };
    }
}
