//! From the demanded flow to the spool opening that passes it.

use crate::compensation::{LoadPressure, null_bias, overlap};
use crate::error::{ConfigError, check, positive, within};
use crate::integrity::integrity;
use crate::number::{Mask as _, Scalar};
use crate::parameters::{Mode, Parameters, SignFrom};
use crate::table::PiecewiseLinear;

/// The inverse of the servovalve's flow property.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct InverseFlow<S: Scalar, const N: usize> {
    /// From flow to required opening, level and stroke included. The table ends where the step over the overlap reaches
    /// the stroke.
    table: PiecewiseLinear<S, N>,
    load_pressure: LoadPressure<S>,
    sign_from_demand: S::Mask,
    /// Spool opening (1) without flow, at which the sign of the spool's opening changes.
    null_bias: S,
}
integrity!(InverseFlow<T, N>: table, load_pressure, sign_from_demand, null_bias);

impl<S: Scalar, const N: usize> InverseFlow<S, N> {
    /// The no-load flow (m³/s) that the valve must pass for a flow (m³/s), and where the load pressure's root is at its
    /// floor. It depends on measured force (N) and spool (1), and on the supply over the configured one, `supply` (1).
    #[inline(always)]
    pub fn demand(&self, flow: S, force: S, spool: S, supply: S) -> (S, S::Mask) {
        let direction = S::select(self.sign_from_demand, flow, spool - self.null_bias);
        let (root, floored) = self.load_pressure.root(force, direction, supply);
        (flow / root, floored)
    }

    /// The spool opening (1, within ±1) that passes a no-load flow (m³/s), and where the flow exceeds the table.
    ///
    /// # NaN
    /// Finite and within ±1 for every flow; a NaN flow gives an end of the range.
    #[inline(always)]
    pub fn opening(&self, demand: S) -> (S, S::Mask) {
        self.table.eval_flagged(demand)
    }

    /// Inverses of single rigs in lanes.
    pub fn pack<'a>(lane: &dyn Fn(usize) -> &'a InverseFlow<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            sign_from_demand: S::Mask::from_lanes(|i| lane(i).sign_from_demand),
            null_bias: S::from_lanes(|i| lane(i).null_bias),
            load_pressure: LoadPressure::pack(&|i| &lane(i).load_pressure),
            table: PiecewiseLinear::pack(&|i| &lane(i).table),
        }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> InverseFlow<$t, N> {
            /// From the rig's parameters: the flow table's inverse with the load-pressure correction, or for
            /// [`Mode::Linear`] `Q/K_v`.
            ///
            /// # Errors
            /// A flow table that is refused; a gain, area or pressure not positive and finite; a level outside [0, 10];
            /// fewer than three points of capacity for the linear inverse.
            pub const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                let mut inverse = Self::EMPTY;
                check!(inverse.fill(p));
                Ok(inverse)
            }

            pub(crate) const EMPTY: Self = Self {
                table: PiecewiseLinear::<$t, N>::EMPTY,
                load_pressure: LoadPressure::<$t>::NONE,
                sign_from_demand: false,
                null_bias: 0.0,
            };

            /// As [`new`](Self::new), in place.
            pub(crate) const fn fill(&mut self, p: &Parameters) -> Result<(), ConfigError> {
                let level = check!(within("level", p.level, 0.0, 10.0));
                let flow_gain = check!(positive("flow_gain", p.flow_gain));
                self.load_pressure = check!(LoadPressure::<$t>::new(p.piston_area, p.supply_pressure));
                self.sign_from_demand = matches!(p.sign_from, SignFrom::Demand);
                self.null_bias = check!(null_bias(p)) as $t;
                // An error names the table's entries, whichever axis is the input.
                check!(self.table.fill("openings", p.openings, "flows", p.flows));
                if matches!(p.mode, Mode::Linear) {
                    // The straight line over the whole stroke.
                    let reach = if level > 1.0e-3 { 1.0 / level } else { 1.0e3 };
                    let (flow, opening) = (reach * flow_gain, reach);
                    let (flows, openings) = ([-flow, 0.0, flow], [-opening, 0.0, opening]);
                    check!(self.table.fill("flow_gain", &flows, "flow_gain", &openings));
                    self.load_pressure = LoadPressure::<$t>::NONE;
                } else {
                    check!(self.table.fill("flows", p.flows, "openings", p.openings));
                }
                // The step over the overlap reaches the rest of the stroke.
                self.table.scale_to_limit(level, 1.0 - check!(overlap(p)))
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
#[allow(clippy::indexing_slicing, reason = "a test may panic")]
mod tests {
    use super::*;

    /// At another supply and under load the valve passes its no-load flow times the root, in either direction.
    #[test]
    fn supply_and_load_scale_the_flow_in_both_directions() {
        let p = Parameters { sign_from: SignFrom::Spool, ..Parameters::ZHAO2005 };
        let inverse = InverseFlow::<f64, 21>::new(&p).unwrap();
        let opening =
            |flow, force, spool, supply| inverse.opening(inverse.demand(flow, force, spool, supply).0).0;
        let capacity = p.piston_area * p.supply_pressure;
        for supply in [0.64, 1.0, 1.21] {
            for (flow, spool) in [(3e-3, 0.3), (-3e-3, -0.3)] {
                for load in [-0.3, 0.0, 0.3] {
                    let root = libm::sqrt(supply - f64::signum(spool) * load);
                    let expected = opening(flow / root, 0.0, spool, 1.0);
                    let found = opening(flow, load * capacity, spool, supply);
                    assert!((found - expected).abs() < 1e-9, "{supply} {flow} {load}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn a_level_scales_every_segment_of_the_table_up_to_the_stroke() {
        let Parameters { openings, flows, .. } = Parameters::ZHAO2005;
        for level in [0.8, 1.0, 1.1, 1.7] {
            let p = Parameters { level, ..Parameters::ZHAO2005 };
            let inverse = InverseFlow::<f64, 21>::new(&p).unwrap();
            for (x, q) in openings.windows(2).zip(flows.windows(2)) {
                for share in [0.0, 0.05, 0.5, 0.95] {
                    let between = |ends: &[f64]| ends[0] + share * (ends[1] - ends[0]);
                    let expected = (level * between(x)).clamp(-1.0, 1.0);
                    let found = inverse.opening(between(q)).0;
                    assert!((found - expected).abs() < 1e-12, "{level} {x:?}: {found} {expected}");
                }
            }
        }
    }

    /// `level·Q/K_v`, whatever the load, up to the stroke.
    #[test]
    fn the_linear_inverse_is_a_straight_line_of_any_level() {
        for level in [0.0, 5e-4, 0.5, 1.0, 2.0] {
            let p = Parameters { mode: Mode::Linear, level, ..Parameters::ZHAO2005 };
            let inverse = InverseFlow::<f64, 21>::new(&p).unwrap();
            for flow in [-0.05, -1e-3, 0.0, 5e-3, 0.015, 0.05] {
                let expected = (level * flow / p.flow_gain).clamp(-1.0, 1.0);
                let found = inverse.opening(inverse.demand(flow, 5e4, 0.3, 1.0).0).0;
                assert!((found - expected).abs() < 1e-12, "{level} {flow}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_demand_beyond_the_table_is_flagged_in_both_directions() {
        let p = Parameters::ZHAO2005;
        let inverse = InverseFlow::<f64, 21>::new(&p).unwrap();
        for (most, sign) in [(p.flows.last(), 1.0), (p.flows.first(), -1.0)] {
            let most = most.copied().unwrap();
            let saturates = |share: f64| inverse.opening(inverse.demand(share * most, 0.0, sign, 1.0).0).1;
            assert!(!saturates(0.999) && saturates(1.001));
        }
    }
}
