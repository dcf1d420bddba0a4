//! The flow of the configured valve: the model of the inverse flow, in the forward direction.

use crate::compensation::{LoadPressure, overlap};
use crate::error::{ConfigError, check};
use crate::integrity::integrity;
use crate::number::Real;
use crate::parameters::{Mode, Parameters};
use crate::table::PiecewiseLinear;

/// Flow curve and load pressure, Eq. (6); a straight line and no load pressure for the linear scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlowModel<T: Real, const N: usize> {
    load_pressure: LoadPressure<T>,
    /// Overlap (1) of the spool's lands, and whether there is one.
    overlap: T,
    laps: bool,
    curve: PiecewiseLinear<T, N>,
}
integrity!(FlowModel<T, N>: load_pressure, overlap, laps, curve);

/// Flow through an opening, in parts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ModelFlow<T> {
    /// At no load (m³/s).
    pub(crate) at_no_load: T,
    /// Its slope (m³/s per unit opening).
    pub(crate) slope: T,
    /// The factor of the load pressure (1).
    pub(crate) root: T,
}

impl<T: Real, const N: usize> FlowModel<T, N> {
    /// The flow through a spool opening (1) at a force (N), with the supply at a multiple `supply` (1) of its pressure.
    /// `direction` has the sign of the opening.
    pub(crate) fn flow(&self, spool: T, direction: T, force: T, supply: T) -> ModelFlow<T> {
        let (root, _) = self.load_pressure.root(force, direction, supply);
        let (at_no_load, slope, _) = self.curve.eval_with_slope(self.beyond_lap(spool));
        ModelFlow { at_no_load, slope, root }
    }

    /// Flow (m³/s) through a spool opening (1) at no load.
    pub(crate) fn at_no_load(&self, spool: T) -> T {
        self.curve.eval(self.beyond_lap(spool))
    }

    /// The opening (1) of a valve without overlap that passes the same flow.
    #[inline(always)]
    fn beyond_lap(&self, spool: T) -> T {
        if self.laps { spool - spool.limit(-self.overlap, self.overlap) } else { spool }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> FlowModel<$t, N> {
            /// From the rig's parameters, in place.
            pub(crate) const fn fill(&mut self, p: &Parameters) -> Result<(), ConfigError> {
                if !matches!(p.mode, Mode::Linear) {
                    return self.fill_table(p);
                }
                let (openings, flows) = ([-1.0, 1.0], [-p.flow_gain, p.flow_gain]);
                self.curve.fill("flow_gain", &openings, "flow_gain", &flows)
            }

            /// With the flow table, for any scheme.
            pub(crate) const fn fill_table(&mut self, p: &Parameters) -> Result<(), ConfigError> {
                self.load_pressure = check!(LoadPressure::<$t>::new(p.piston_area, p.supply_pressure));
                let overlap = check!(overlap(p));
                (self.overlap, self.laps) = (overlap as $t, overlap > 0.0);
                self.curve.fill("openings", p.openings, "flows", p.flows)
            }

            pub(crate) const EMPTY: Self = Self {
                load_pressure: LoadPressure::<$t>::NONE,
                overlap: 0.0,
                laps: false,
                curve: PiecewiseLinear::<$t, N>::EMPTY,
            };
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    /// Lands that overlap by 2 % of the stroke pass nothing up to there. The flow table is that of the rest.
    #[test]
    fn an_overlap_is_subtracted_from_the_opening() {
        let rig = Parameters { overlap: 0.02, ..Parameters::ZHAO2005 };
        let mut model = FlowModel::<f64, 21>::EMPTY;
        model.fill(&rig).unwrap();
        let table = PiecewiseLinear::<f64, 21>::new("x", rig.openings, "y", rig.flows).unwrap();
        for (spool, beyond) in
            [(0.0, 0.0), (0.019, 0.0), (-0.02, 0.0), (0.03, 0.01), (0.42, 0.4), (-0.3, -0.28)]
        {
            let expected = table.eval(beyond);
            let found = [model.at_no_load(spool), model.flow(spool, spool, 0.0, 1.0).at_no_load];
            assert!(found.iter().all(|flow| (flow - expected).abs() < 1e-17), "{spool}: {found:?}");
        }
    }
}
