//! The flow that the configured valve would pass: the inverse flow's own model, forwards.

use crate::load_pressure::LoadPressure;
use crate::piecewise::PiecewiseLinear;
use crate::scalar::Scalar;

/// Flow curve and load pressure, Eq. (6); a straight line and none for the linear scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlowPrediction<S: Scalar, const N: usize> {
    pub(crate) load_pressure: LoadPressure<S>,
    pub(crate) curve: PiecewiseLinear<S, N>,
}

impl<S: Scalar, const N: usize> FlowPrediction<S, N> {
    /// Flow (m³/s) through a spool opening (1) at no load, its slope there (m³/s per unit opening), and the root (1) that
    /// it is multiplied by at a force (N), the supply at a multiple `supply` (1) of its pressure.
    #[inline(always)]
    pub(crate) fn parts(&self, spool: S, force: S, supply: S) -> (S, S, S) {
        let (root, _) = self.load_pressure.root_at(force, spool, supply);
        let (flow, slope, _) = self.curve.eval_with_slope(spool);
        (flow, slope, root)
    }

    pub(crate) fn pack<'a>(lane: impl Fn(usize) -> &'a FlowPrediction<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            load_pressure: LoadPressure::pack(|i| &lane(i).load_pressure),
            curve: PiecewiseLinear::pack(|i| &lane(i).curve),
        }
    }
}
