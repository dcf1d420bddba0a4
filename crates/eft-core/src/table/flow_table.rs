//! The servovalve's flow curve (Table 2 of the paper) and its inverse.

use crate::error::ConfigError;
use crate::number::Scalar;
use crate::table::PiecewiseLinear;

/// Flow (m³/s) against normalised spool opening, piecewise linear through up to `N` points, both ways.
#[derive(Debug, Clone, Copy)]
pub struct FlowTable<S: Scalar, const N: usize> {
    forward: PiecewiseLinear<S, N>,
    inverse: PiecewiseLinear<S, N>,
}

impl<S: Scalar, const N: usize> FlowTable<S, N> {
    /// Flow in m³/s at no load for the spool opening `x` (1), held constant beyond the table.
    #[inline(always)]
    pub fn flow(&self, x: S) -> S {
        self.forward.eval(x)
    }
    /// As [`flow`](Self::flow), and the slope there (m³/s per unit opening).
    #[inline(always)]
    pub fn flow_and_slope(&self, x: S) -> (S, S) {
        let (flow, slope, _) = self.forward.eval_with_slope(x);
        (flow, slope)
    }
    /// Spool opening (1) that passes the flow `q` (m³/s) at no load, held constant beyond the table.
    #[inline(always)]
    pub fn opening(&self, q: S) -> S {
        self.inverse.eval(q)
    }
    /// The map from spool opening to flow.
    pub const fn forward(&self) -> &PiecewiseLinear<S, N> {
        &self.forward
    }
    /// The map from flow to spool opening.
    pub const fn inverse(&self) -> &PiecewiseLinear<S, N> {
        &self.inverse
    }
    /// Tables of single rigs in lanes.
    pub fn pack<'a>(lane: &dyn Fn(usize) -> &'a FlowTable<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            forward: PiecewiseLinear::pack(&|i| &lane(i).forward),
            inverse: PiecewiseLinear::pack(&|i| &lane(i).inverse),
        }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> FlowTable<$t, N> {
            /// A table through the points `(openings[i], flows[i])`, openings normalised, flows in m³/s.
            ///
            /// # Errors
            /// As [`PiecewiseLinear`]'s `new`: the table is named `openings` or `flows`. In a `const` each of them is
            /// a compile error:
            /// ```
            /// # use eft_core::FlowTable;
            #[doc = concat!("const TABLE: FlowTable<", stringify!($t), ", 3> = match FlowTable::<", stringify!($t), ", 3>::new(")]
            ///     &[-1.0, 0.0, 1.0], &[-8.0e-3, 0.0, 8.0e-3]) { Ok(table) => table, Err(_) => panic!("not increasing") };
            /// assert_eq!(TABLE.flow(0.5), 4.0e-3);
            /// ```
            /// The same with its last flow below the one before does not compile:
            /// ```compile_fail,E0080
            /// # use eft_core::FlowTable;
            #[doc = concat!("const TABLE: FlowTable<", stringify!($t), ", 3> = match FlowTable::<", stringify!($t), ", 3>::new(")]
            ///     &[-1.0, 0.0, 1.0], &[-8.0e-3, 0.0, -1.0e-3]) { Ok(table) => table, Err(_) => panic!("not increasing") };
            /// assert_eq!(TABLE.flow(0.5), 4.0e-3);
            /// ```
            pub const fn new(openings: &[f64], flows: &[f64]) -> Result<Self, ConfigError> {
                let forward = match PiecewiseLinear::<$t, N>::new("openings", openings, "flows", flows) {
                    Ok(map) => map,
                    Err(e) => return Err(e),
                };
                match PiecewiseLinear::<$t, N>::new("flows", flows, "openings", openings) {
                    Ok(inverse) => Ok(Self { forward, inverse }),
                    Err(e) => Err(e),
                }
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
