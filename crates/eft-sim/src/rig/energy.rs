//! Where the energy goes: powers, and their integrals over a test.

use crate::rig::Num;
use crate::rig::runge_kutta::Vector;

/// Powers (W), or energies (J) since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Energy<S> {
    /// From the pump.
    pub(crate) supplied: S,
    /// By chambers that change their volume while under pressure, `½·K_a′·ẋ·P_L²`.
    pub(crate) swept: S,
    /// Lost by the droop of the supply.
    pub(crate) droop: S,
    /// Throttled in the main stage.
    pub(crate) valve: S,
    /// Lost by leakage, in the valve and across the piston.
    pub(crate) leakage: S,
    /// Lost in the seals.
    pub(crate) friction: S,
    /// Lost in the end stops.
    pub(crate) stops: S,
    /// Lost in the structure's dampers.
    pub(crate) damping: S,
    /// Taken by the part of the structure that yields.
    pub(crate) hysteresis: S,
}

impl<S: Num> Vector<S> for Energy<S> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(S, S) -> S) -> Self {
        Self {
            supplied: f(self.supplied, other.supplied),
            swept: f(self.swept, other.swept),
            droop: f(self.droop, other.droop),
            valve: f(self.valve, other.valve),
            leakage: f(self.leakage, other.leakage),
            friction: f(self.friction, other.friction),
            stops: f(self.stops, other.stops),
            damping: f(self.damping, other.damping),
            hysteresis: f(self.hysteresis, other.hysteresis),
        }
    }
}

/// Where the hydraulic work of a test went (J).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyBalance {
    /// Work of the pump.
    pub supplied: f64,
    /// Work of chambers that change their volume while under pressure, `½·K_a′·ẋ·P_L²`, which Eq. (7) leaves out.
    pub swept: f64,
    /// Lost by the droop of the supply.
    pub droop: f64,
    /// Throttled in the main stage.
    pub valve: f64,
    /// Lost by leakage, in the valve and across the piston.
    pub leakage: f64,
    /// Lost in the seals.
    pub friction: f64,
    /// Lost in the end stops.
    pub stops: f64,
    /// Lost in the structure's dampers.
    pub damping: f64,
    /// Taken by the part of the structure that yields, most of it for good.
    pub hysteresis: f64,
    /// What oil, accumulator, structure and stops hold more than at the start.
    pub stored: f64,
}

impl EnergyBalance {
    /// From the energies since the start and what is stored more than then (J).
    pub(crate) fn new(energy: &Energy<f64>, stored: f64) -> Self {
        Self {
            supplied: energy.supplied,
            swept: energy.swept,
            droop: energy.droop,
            valve: energy.valve,
            leakage: energy.leakage,
            friction: energy.friction,
            stops: energy.stops,
            damping: energy.damping,
            hysteresis: energy.hysteresis,
            stored,
        }
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
