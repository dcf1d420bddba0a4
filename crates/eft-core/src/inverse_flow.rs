//! From the flow that is wanted to the spool opening that passes it.

use crate::error::{ConfigError, check, positive, within};
use crate::flow_table::FlowTable;
use crate::load_pressure::LoadPressure;
use crate::piecewise::PiecewiseLinear;
use crate::scalar::{Mask as _, Scalar};
use crate::status;

/// Which inverse turns flow into spool opening.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Inverse {
    /// `Q/K_v`: for openings up to 10 %.
    Linear = 1,
    /// The flow table's inverse with the load-pressure correction.
    Nonlinear = 2,
}

/// Where the sign of the spool opening in the load-pressure correction comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum SignFrom {
    /// The measured spool, as in the paper; it chatters near null.
    Spool = 0,
    /// The demanded flow, free of chatter and of the loop through the spool.
    Demand = 1,
}

/// The inverse of the servovalve's flow property.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct InverseFlow<S: Scalar, const N: usize> {
    /// From flow to required opening: level and stroke are in its values, and it ends where they end.
    table: PiecewiseLinear<S, N>,
    load_pressure: LoadPressure<S>,
    sign_from_demand: S::Mask,
}

impl<S: Scalar, const N: usize> InverseFlow<S, N> {
    /// Required spool opening (1, within ±1) for a flow (m³/s), given the measured force (N) and spool (1),
    /// and the flags [`status::DEMAND_SATURATED`] and [`status::LOAD_PRESSURE_FLOORED`].
    ///
    /// # NaN
    /// Finite and within ±1 for every input; a NaN flow gives an end of the range.
    #[inline(always)]
    pub fn required_opening(&self, flow: S, force: S, spool: S) -> (S, S::Flags) {
        self.required_opening_at(flow, force, spool, S::splat(1.0), |demand| demand)
    }

    /// As [`required_opening`](Self::required_opening), where the supply stands at a multiple `supply` (1) of its
    /// pressure, and the table is `corrected`: from the no-load flow (m³/s) that is demanded to the one that the table
    /// has for the opening that passes it.
    #[inline(always)]
    pub fn required_opening_at(
        &self,
        flow: S,
        force: S,
        spool: S,
        supply: S,
        corrected: impl FnOnce(S) -> S,
    ) -> (S, S::Flags) {
        let direction = S::select(self.sign_from_demand, flow, spool);
        let (root, floored) = self.load_pressure.root_at(force, direction, supply);
        let demand = corrected(flow / root);
        let (opening, saturated) = self.table.eval_flagged(demand);
        let flags =
            S::flag(floored, status::LOAD_PRESSURE_FLOORED) | S::flag(saturated, status::DEMAND_SATURATED);
        (opening, flags)
    }

    /// Inverses of single rigs side by side.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a InverseFlow<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            sign_from_demand: S::Mask::from_lanes(|i| lane(i).sign_from_demand),
            load_pressure: LoadPressure::pack(|i| &lane(i).load_pressure),
            table: PiecewiseLinear::pack(|i| &lane(i).table),
        }
    }
}

/// What an inverse is made from, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseFlowParameters {
    /// Which inverse.
    pub inverse: Inverse,
    /// Compensation level (1): 1 is full compensation, 1.02 is 2 % over.
    pub level: f64,
    /// Flow gain `K_v` (m³/s per unit opening) of the linear inverse.
    pub flow_gain: f64,
    /// Piston area `A` (m²).
    pub piston_area: f64,
    /// Supply pressure `P_s` (Pa).
    pub supply_pressure: f64,
    /// Where the correction's sign comes from.
    pub sign_from: SignFrom,
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> InverseFlow<$t, N> {
            /// From its parameters and the flow table.
            ///
            /// # Errors
            /// A gain, area or pressure not positive and finite; a level outside [0, 10]; fewer than three points of
            /// capacity for the linear inverse.
            pub const fn new(
                p: &InverseFlowParameters,
                table: &FlowTable<$t, N>,
            ) -> Result<Self, ConfigError> {
                let level = check!(within("level", p.level, 0.0, 10.0));
                let flow_gain = check!(positive("flow_gain", p.flow_gain));
                let load_pressure = check!(LoadPressure::<$t>::new(p.piston_area, p.supply_pressure));
                let (load_pressure, table) = match p.inverse {
                    Inverse::Linear => {
                        // The straight line, as far as the whole stroke is asked for.
                        let reach = if level > 1.0e-3 { 1.0 / level } else { 1.0e3 };
                        let (flow, opening) = (reach * flow_gain, reach);
                        let line = PiecewiseLinear::<$t, N>::new(
                            "flow_gain",
                            &[-flow, 0.0, flow],
                            "flow_gain",
                            &[-opening, 0.0, opening],
                        );
                        (LoadPressure::<$t>::NONE, check!(line))
                    }
                    Inverse::Nonlinear => (load_pressure, *table.inverse()),
                };
                Ok(Self {
                    sign_from_demand: matches!(p.sign_from, SignFrom::Demand),
                    load_pressure,
                    table: check!(table.scaled_to_limit(level)),
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
