//! The load cell between piston rod and structure: `F_s` follows `F − m_p·ẍ` with its bandwidth.
//!
//! The force through the cell accelerates the structure. The mass `m_p` between cell and piston is part of
//! `structure.mass` and takes its share of the actuator's force before the cell.

use std::f64::consts::TAU;

use eft_core::Mask;

use crate::config::RigConfig;
use crate::lanes::Num;

/// Mass between cell and piston, and the cell's bandwidth.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LoadCell<S: Num> {
    /// Whether any lane's cell has a lag.
    present: bool,
    mass: S,
    lags: S::Mask,
    corner: S,
}

impl<S: Num> LoadCell<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        Self {
            present: (0..S::LANES).any(|i| rig(i).sensors.force.bandwidth.is_some()),
            mass: S::from_lanes(|i| rig(i).sensors.cell_mass.unwrap_or(0.0)),
            lags: S::Mask::from_lanes(|i| rig(i).sensors.force.bandwidth.is_some()),
            corner: S::from_lanes(|i| TAU * rig(i).sensors.force.bandwidth.unwrap_or(0.0)),
        }
    }

    /// Rate (N/s) of the cell's reading, from the actuator's force (N), the acceleration (m/s²) and the
    /// reading (N).
    #[inline(always)]
    pub(crate) fn rate(&self, force: S, acceleration: S, reading: S) -> S {
        if self.present { self.corner * (force - self.mass * acceleration - reading) } else { S::splat(0.0) }
    }

    /// The cell's analog output: its state in lanes with a lag, the force in the others.
    #[inline(always)]
    pub(crate) fn select(&self, reading: S, force: S) -> S {
        if self.present { S::select(self.lags, reading, force) } else { force }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn a_cell_in_steady_motion_shows_the_force_less_the_inertia_before_it() {
        let rig = changed(&[("sensors.cell_mass", 50.0.into()), ("sensors.force.bandwidth", 500.0.into())]);
        let cell = LoadCell::<f64>::pack(&|_| &rig);
        assert_eq!(cell.rate(9e3, 2.0, 9e3 - 100.0), 0.0);
        // A step decays to 1/e after the time constant of the bandwidth.
        assert!((cell.rate(1.0, 0.0, 0.0) - TAU * 500.0).abs() < 1e-9);
        assert_eq!((cell.select(1.0, 2.0)), 1.0);
        let plain = changed(&[]);
        assert_eq!(LoadCell::<f64>::pack(&|_| &plain).select(1.0, 2.0), 2.0);
    }
}
