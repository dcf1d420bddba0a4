//! Leakage of the main stage, the second part of Eq. (5).
//!
//! Oil seeps through the clearances of the closed ports, from the pressurised chamber to the return line and
//! from the supply to the other chamber. This reduces the load flow by `Q_lv = ½·G·(sgn(x_v)·P + P_L)`. The
//! laminar conductance `G` is that of the mean length of overlap; the paper's `1/x_v` is undefined at null.
//! The two parts have separate parameters. The proportional part `C_p·P_L` acts as damping. The constant part
//! `C_c·P·σ(x_v)` is proportional to the supply pressure, and in the load pressure it looks like motion. `σ`
//! is the sign of the spool opening, with a linear transition near null, where both pairs of clearances leak
//! equally.

use crate::config::RigConfig;
use crate::lanes::Num;

/// Clearances of the main stage.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ValveLeakage<S> {
    /// Whether any lane leaks.
    present: bool,
    proportional: S,
    constant: S,
    per_null_region: S,
}

/// The leakage flows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leak<S> {
    /// Taken from the load flow (m³/s).
    pub(crate) lost: S,
    /// Drawn from the supply on top of the load flow (m³/s).
    pub(crate) drawn: S,
}

impl<S: Num> ValveLeakage<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let leakage = |i: usize| &rig(i).servovalve.leakage;
        Self {
            present: (0..S::LANES).any(|i| leakage(i).proportional + leakage(i).constant > 0.0),
            proportional: S::from_lanes(|i| leakage(i).proportional),
            constant: S::from_lanes(|i| leakage(i).constant / rig(i).supply.pressure),
            per_null_region: S::from_lanes(|i| 1.0 / leakage(i).null_region),
        }
    }

    /// The leakage at a spool opening (1), a load pressure and a supply pressure (Pa).
    #[inline(always)]
    pub(crate) fn leak(&self, opening: S, load_pressure: S, supply_pressure: S) -> Leak<S> {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        if !self.present {
            return Leak { lost: zero, drawn: zero };
        }
        let side = (opening * self.per_null_region).limit(-one, one);
        let constant = self.constant * supply_pressure;
        Leak { lost: self.proportional * load_pressure + constant * side, drawn: constant * side.abs() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn equal_clearances_give_eq_5() {
        let conductance = 4e-12;
        let rig = changed(&[
            ("servovalve.leakage.proportional", (conductance / 2.0).into()),
            ("servovalve.leakage.constant", (conductance / 2.0 * 1.9e7).into()),
        ]);
        let leakage = ValveLeakage::<f64>::pack(&|_| &rig);
        for load in [-1.2e7, 0.0, 0.8e7] {
            for supply in [1.9e7, 1.5e7] {
                let open = leakage.leak(0.3, load, supply).lost;
                assert!((open - conductance * (supply + load) / 2.0).abs() < 1e-18, "{open}");
                let back = leakage.leak(-0.3, load, supply).lost;
                assert!((back + conductance * (supply - load) / 2.0).abs() < 1e-18, "{back}");
            }
        }
    }

    #[test]
    fn a_constant_leakage_is_zero_at_null() {
        let rig = changed(&[("servovalve.leakage.constant", 4e-5.into())]);
        let leak = ValveLeakage::<f64>::pack(&|_| &rig).leak(0.0, 0.0, 1.9e7);
        assert_eq!((leak.lost, leak.drawn), (0.0, 0.0));
    }
}
