//! Where the energy goes: powers, and their integrals over a test.

use crate::lanes::Num;

/// Where the hydraulic work of a test went (J), all actuators together.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EnergyBalance<S = f64> {
    /// Work of the pump.
    pub supplied: S,
    /// Work of chambers that change their volume while under pressure, `½·K_a′·ẋ·P_L²`, which Eq. (7) leaves out.
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
    /// Taken by the part of the structure that yields, most of it for good.
    pub hysteresis: S,
    /// What oil, accumulator, structure and stops hold more than at the start.
    pub stored: S,
}

/// How many of the numbers are integrals of powers: all but the last.
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
    /// From the integrals, and what is stored more than at the start (J).
    pub(crate) fn new(integrals: [f64; POWERS], stored: f64) -> Self {
        let [supplied, swept, droop, valve, leakage, friction, stops, damping, hysteresis] = integrals;
        Self { supplied, swept, droop, valve, leakage, friction, stops, damping, hysteresis, stored }
    }

    /// What was lost on the way (J).
    pub fn dissipated(&self) -> f64 {
        self.droop + self.valve + self.leakage + self.friction + self.stops + self.damping + self.hysteresis
    }

    /// What the books leave open, relative to the work supplied (1); zero but for the error of the integration.
    pub fn gap(&self) -> f64 {
        (self.supplied + self.swept - self.dissipated() - self.stored) / self.supplied.abs()
    }
}
