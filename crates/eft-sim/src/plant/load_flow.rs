//! The main stage's load flow, Eq. (6) with Table 2: `Q_L = f(x_v)·√(1 − sgn(x_v)·P_L/P_s)`.

use eft_core::FlowTable;

use crate::config::RigConfig;
use crate::error::Result;
use crate::lanes::Num;
use crate::plant::TABLE_CAPACITY;

/// Flow through the main stage into the actuator.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LoadFlow<S: Num> {
    curve: FlowTable<S, TABLE_CAPACITY>,
    scale: S,
    supply_pressure: S,
    per_supply_pressure: S,
    /// Whether the lands of any lane overlap.
    overlaps: bool,
    overlap: S,
}

impl<S: Num> LoadFlow<S> {
    pub(crate) fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig) -> Result<Self> {
        let curves = (0..S::LANES).map(|i| flow_table(rig(i))).collect::<Result<Vec<_>>>()?;
        Ok(Self {
            curve: FlowTable::pack(|i| &curves[i]),
            scale: S::from_lanes(|i| rig(i).servovalve.flow_gain_scale),
            supply_pressure: S::from_lanes(|i| rig(i).supply.pressure),
            per_supply_pressure: S::from_lanes(|i| 1.0 / rig(i).supply.pressure),
            overlaps: (0..S::LANES).any(|i| rig(i).servovalve.overlap > 0.0),
            overlap: S::from_lanes(|i| rig(i).servovalve.overlap),
        })
    }

    /// Load flow (m³/s) at a spool opening (1), a load pressure (Pa) and a supply pressure over the one at which the
    /// curve was measured (1), and its slope over the opening (m³/s per unit opening). Where the load pressure exceeds
    /// the supply the flow runs backwards: the root keeps the sign of its radicand.
    #[inline(always)]
    pub(crate) fn flow_and_gain(&self, opening: S, load_pressure: S, supplied: S) -> (S, S) {
        let ratio = (load_pressure * self.per_supply_pressure).times_sign_of(opening);
        let radicand = supplied - ratio;
        let root = radicand.abs().sqrt().times_sign_of(radicand);
        let (flow, slope) = self.curve.flow_and_slope(opening);
        (self.scale * flow * root, self.scale * slope * root)
    }

    /// Load flow (m³/s) at a supply pressure (Pa) and behind an overlap of the lands:
    /// `Q_L = f(x_v − sat(x_v, overlap))·√(P/P_s − sgn(x_v)·P_L/P_s)`. Also the flow (m³/s) drawn from the supply.
    #[inline(always)]
    pub(crate) fn flow_at(&self, opening: S, load_pressure: S, supply_pressure: S) -> (S, S) {
        let open = if self.overlaps { opening - opening.limit(-self.overlap, self.overlap) } else { opening };
        let (flow, _) = self.flow_and_gain(open, load_pressure, supply_pressure / self.supply_pressure);
        (flow, flow.times_sign_of(open))
    }
}

/// The true valve's flow curve in double precision.
///
/// # Errors
/// What the core refuses, with the configuration's key.
fn flow_table(rig: &RigConfig) -> Result<FlowTable<f64, TABLE_CAPACITY>> {
    let table = rig.servovalve.true_curve();
    Ok(FlowTable::<f64, TABLE_CAPACITY>::new(&table.openings, &table.flows)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn at_the_measured_pressure_the_flow_is_eq_6() {
        let rig = changed(&[]);
        let valve = LoadFlow::<f64>::pack(|_| &rig).unwrap();
        for opening in [-0.8, -0.13, 0.0, 0.05, 0.6] {
            for load in [-2.2e7, -9e6, 0.0, 5e6, 2.5e7] {
                let (flow, drawn) = valve.flow_at(opening, load, 1.9e7);
                let part = 1.0 - load * f64::signum(opening) / 1.9e7;
                let eq_6 = valve.curve.flow(opening) * part.signum() * part.abs().sqrt();
                assert!((flow - eq_6).abs() <= 1e-14 * eq_6.abs().max(1e-3));
                assert_eq!(drawn, if opening < 0.0 { -flow } else { flow });
            }
        }
    }

    #[test]
    fn flow_follows_the_root_of_the_pressure_and_the_overlap_passes_nothing() {
        let rig = changed(&[("servovalve.overlap", 0.03.into())]);
        let valve = LoadFlow::<f64>::pack(|_| &rig).unwrap();
        let no_load = |opening, pressure| valve.flow_at(opening, 0.0, pressure).0;
        assert!((no_load(0.5, 0.81 * 1.9e7) / no_load(0.5, 1.9e7) - 0.9).abs() < 1e-12);
        assert_eq!(no_load(0.03, 1.9e7), 0.0);
        assert_eq!(no_load(-0.02, 1.9e7), 0.0);
        // 0.13 − 0.03 is the table's first point.
        assert!((no_load(0.13, 1.9e7) - 102.2 * 1.6387064e-5).abs() < 1e-15);
        assert!((no_load(-0.13, 1.9e7) + 101.0 * 1.6387064e-5).abs() < 1e-15);
    }
}
