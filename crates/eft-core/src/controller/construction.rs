//! A controller from the rig's parameters.

use crate::compensation::{Compensation, Feedforward, Friction, OverlapStep};
use crate::controller::{Controller, gap};
use crate::error::{ConfigError, check};
use crate::force_loop::{Integral, Limiter, ServovalveController};
use crate::parameters::{Parameters, Realization};

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> Controller<$t, N> {
            /// From the rig's parameters.
            ///
            /// # Errors
            /// A parameter that is not finite or out of its range, by name.
            pub const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                let mut controller = Self::EMPTY;
                check!(controller.fill(p));
                Ok(controller)
            }

            pub(crate) const EMPTY: Self = Self {
                compensation: Compensation::<$t, N>::EMPTY,
                feedforward: Feedforward::<$t>::OFF,
                friction: Friction::<$t>::NONE,
                overlap: OverlapStep::<$t>::NONE,
                servovalve: ServovalveController::<$t>::NONE,
                limiter: Limiter::<$t>::CLOSED,
                per_supply_pressure: 0.0,
                measures_supply: false,
                looks_ahead: false,
                gap: 0,
                feeds_forward: false,
                realization: Realization::Digital,
                integral: Integral::<$t>::NONE,
            };

            /// As [`new`](Self::new), in place.
            pub(crate) const fn fill(&mut self, p: &Parameters) -> Result<(), ConfigError> {
                check!(self.compensation.fill(p));
                if p.feedforward {
                    self.feedforward = check!(Feedforward::<$t>::new(p));
                }
                self.friction = check!(Friction::<$t>::new(p));
                self.overlap = check!(OverlapStep::<$t>::new(p));
                self.servovalve = check!(ServovalveController::<$t>::new(p));
                self.limiter =
                    check!(Limiter::<$t>::new(p.valve_command, p.valve_command_rate, p.sample_rate));
                self.per_supply_pressure = (1.0 / p.supply_pressure) as $t;
                self.measures_supply = p.supply_correction;
                self.looks_ahead = p.feedforward && p.look_ahead;
                self.gap = check!(gap(p));
                self.feeds_forward = p.feedforward;
                self.realization = p.realization;
                self.integral = check!(Integral::<$t>::new(p));
                Ok(())
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
