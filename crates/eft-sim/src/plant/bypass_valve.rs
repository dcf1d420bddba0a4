//! A bypass valve across the piston: `Q_b = C·P_L/(P_L² + P_0²)^¼`, an orifice with laminar flow below `P_0`.
//!
//! It is closed during a test. After a trip its own spring opens it, without controller and supply.

use crate::config::RigConfig;
use crate::lanes::Num;

/// Load pressure (Pa) of the configured flow.
const RATED: f64 = 1.0e6;
/// Load pressure (Pa) below which the flow is laminar.
const LAMINAR: f64 = 2.0e5;

/// One valve across each piston; all valves open together.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BypassValve<S> {
    /// Whether any lane has a valve.
    present: bool,
    coefficient: S,
    /// Opening rate (1/s).
    rate: S,
    /// Opening (1).
    pub(crate) opening: S,
}

impl<S: Num> BypassValve<S> {
    /// Closed.
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let coefficient = |i: usize| rig(i).actuator.bypass_flow / RATED.sqrt();
        Self {
            present: (0..S::LANES).any(|i| coefficient(i) > 0.0),
            coefficient: S::from_lanes(coefficient),
            rate: S::from_lanes(|i| 1.0 / rig(i).actuator.bypass_time),
            opening: S::splat(0.0),
        }
    }

    /// Opens further for a time (s) in the lanes of `at`.
    pub(crate) fn open(&mut self, time: f64, at: S::Mask) {
        let further = (self.opening + self.rate * S::splat(time)).limit(S::splat(0.0), S::splat(1.0));
        self.opening = S::select(at, further, self.opening);
    }

    /// Closes at once in the lanes of `at`, for a new test.
    pub(crate) fn close(&mut self, at: S::Mask) {
        self.opening = S::select(at, S::splat(0.0), self.opening);
    }

    /// Flow (m³/s) between the chambers at a load pressure (Pa).
    #[inline(always)]
    pub(crate) fn flow(&self, load_pressure: S) -> S {
        if !self.present {
            return S::splat(0.0);
        }
        let squared = load_pressure * load_pressure + S::splat(LAMINAR * LAMINAR);
        self.opening * self.coefficient * load_pressure / squared.sqrt().sqrt()
    }
}

/// Fastest rate (1/s) at which an open valve relieves the pressure of a locked piston.
pub(crate) fn fastest_rate(rig: &RigConfig) -> f64 {
    rig.actuator.bypass_flow / (RATED.sqrt() * LAMINAR.sqrt() * rig.actuator.compressibility)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn the_bypass_opens_in_its_time_and_passes_the_flow_of_an_orifice() {
        let rig = changed(&[("actuator.bypass_flow", 4e-3.into()), ("actuator.bypass_time", 0.02.into())]);
        let mut valve = BypassValve::<f64>::pack(&|_| &rig);
        assert!(valve.flow(1e6).abs() < 1e-15);
        valve.open(0.01, true);
        let half = valve.flow(4e6);
        valve.open(0.02, true);
        valve.close(false);
        assert!((valve.flow(4e6) / half - 2.0).abs() < 1e-12);
        // Four times the pressure gives twice the flow.
        assert!((valve.flow(1.6e7) / valve.flow(4e6) - 2.0).abs() < 1e-2);
        assert!((valve.flow(4e6) / 4e-6 / 2e3 - 1.0).abs() < 1e-2);
        assert!((valve.flow(-4e6) + valve.flow(4e6)).abs() < 1e-18);
        valve.close(true);
        assert!(valve.flow(4e6).abs() < 1e-15);
    }
}
