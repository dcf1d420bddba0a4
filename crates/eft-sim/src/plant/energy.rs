//! The energy balance: powers, and their integrals over a test.

use crate::lanes::Num;

/// The energy balance of a test (J), for all actuators together.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EnergyBalance<S = f64> {
    /// Work of the pump.
    pub supplied: S,
    /// Work of chambers that change their volume under pressure, `½·K_a′·ẋ·P_L²`, which Eq. (7) does not
    /// contain.
    pub swept: S,
    /// Lost by the droop of the supply.
    pub droop: S,
    /// Throttled in the main stages.
    pub valve: S,
    /// Lost by leakage, in the valves and across the pistons.
    pub leakage: S,
    /// Lost in the seals.
    pub friction: S,
    /// Lost in the end stops.
    pub stops: S,
    /// Lost in the structure's dampers.
    pub damping: S,
    /// Energy of the yielding part of the structure, most of it dissipated.
    pub hysteresis: S,
    /// Increase of the energy in oil, accumulator, structure and stops.
    pub stored: S,
}

/// Number of values that are integrals of powers: all but the last.
pub(crate) const POWERS: usize = 9;

impl<S: Num> EnergyBalance<S> {
    /// The integrals, or the powers (W).
    #[inline(always)]
    pub(crate) fn to_array(self) -> [S; POWERS] {
        let Self { supplied, swept, droop, valve, leakage, friction, stops, damping, hysteresis, stored: _ } =
            self;
        [supplied, swept, droop, valve, leakage, friction, stops, damping, hysteresis]
    }
}

impl EnergyBalance {
    /// A balance from the integrals and the increase of the stored energy (J).
    pub(crate) fn new(integrals: [f64; POWERS], stored: f64) -> Self {
        let [supplied, swept, droop, valve, leakage, friction, stops, damping, hysteresis] = integrals;
        Self { supplied, swept, droop, valve, leakage, friction, stops, damping, hysteresis, stored }
    }

    /// Dissipated energy (J).
    pub fn dissipated(&self) -> f64 {
        self.droop + self.valve + self.leakage + self.friction + self.stops + self.damping + self.hysteresis
    }

    /// Imbalance relative to the supplied work (1), which is the error of the integration.
    pub fn gap(&self) -> f64 {
        (self.supplied + self.swept - self.dissipated() - self.stored) / self.supplied.abs()
    }
}
