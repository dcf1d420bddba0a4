//! From the flow that is wanted to the spool opening that passes it.

use crate::error::{ConfigError, check, positive, within};
use crate::flow_table::FlowTable;
use crate::load_pressure::LoadPressure;
use crate::piecewise::PiecewiseLinear;
use crate::scalar::{Mask, Scalar};
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
#[derive(Debug, Clone, Copy)]
pub struct InverseFlow<S: Scalar, const N: usize> {
    linear: S::Mask,
    sign_from_demand: S::Mask,
    level: S,
    opening_per_flow: S,
    load_pressure: LoadPressure<S>,
    table: PiecewiseLinear<S, N>,
}

impl<S: Scalar, const N: usize> InverseFlow<S, N> {
    /// Required spool opening (1, within ±1) for a flow (m³/s), given the measured force (N) and spool (1),
    /// and the flags [`status::DEMAND_SATURATED`] and [`status::LOAD_PRESSURE_FLOORED`].
    ///
    /// # NaN
    /// Finite and within ±1 for every input; a NaN flow gives an end of the range.
    #[inline(always)]
    pub fn required_opening(&self, flow: S, force: S, spool: S) -> (S, S::Flags) {
        let direction = S::select(self.sign_from_demand, flow, spool);
        let (factor, floored) = self.load_pressure.factor(force, direction);
        let demand = flow * factor;
        let required =
            S::select(self.linear, self.opening_per_flow * flow, self.level * self.table.eval(demand));
        let opening = required.limit(S::splat(-1.0), S::splat(1.0));
        let saturated = required.abs().gt(S::splat(1.0)) | (!self.linear & self.table.beyond(demand));
        let flags = S::flag(saturated, status::DEMAND_SATURATED)
            | S::flag(floored & !self.linear, status::LOAD_PRESSURE_FLOORED);
        (opening, flags)
    }

    /// Inverses of single rigs side by side.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a InverseFlow<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            linear: S::Mask::from_lanes(|i| lane(i).linear),
            sign_from_demand: S::Mask::from_lanes(|i| lane(i).sign_from_demand),
            level: S::from_lanes(|i| lane(i).level),
            opening_per_flow: S::from_lanes(|i| lane(i).opening_per_flow),
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
            /// A gain, area or pressure not positive and finite; a level outside [0, 10].
            pub const fn new(
                p: &InverseFlowParameters,
                table: &FlowTable<$t, N>,
            ) -> Result<Self, ConfigError> {
                let level = check!(within("level", p.level, 0.0, 10.0));
                Ok(Self {
                    linear: matches!(p.inverse, Inverse::Linear),
                    sign_from_demand: matches!(p.sign_from, SignFrom::Demand),
                    level: level as $t,
                    opening_per_flow: (level / check!(positive("flow_gain", p.flow_gain))) as $t,
                    load_pressure: check!(LoadPressure::<$t>::new(p.piston_area, p.supply_pressure)),
                    table: *table.inverse(),
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
