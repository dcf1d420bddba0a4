//! What is known of asymmetry, null offset and departures: their standard deviations.

use super::{CurveEvidence, CurveState, FlowCurve, GAIN_DEVIATION};
use crate::compensation::NODES;
use crate::learning::curve_nodes::{NODE_DEVIATION, node_variance};
use crate::learning::least_squares::BOUNDED;
use crate::learning::tuning::CURVE_DEPARTURE;
use crate::number::Real;

impl<T: Real> FlowCurve<T> {
    /// Standard deviation of the asymmetry (1): half of the difference of two gains.
    pub(in crate::learning) fn asymmetry_deviation(&self, evidence: &CurveEvidence<T>) -> T {
        let variance = self.variance(evidence);
        let belief = belief_in(variance, GAIN_DEVIATION);
        let [back, forth] = evidence.directions.each_ref().map(|d| variance / (d.flows + belief));
        T::splat(0.5) * (back + forth).sqrt()
    }

    /// Variances (squared steps) of the departures: of the filter's estimate, and of the curve's bend between the nodes. The
    /// filters have these `variances`.
    pub(in crate::learning) fn departure_variances(
        &self,
        variances: &[T; NODES],
        departures: &[T; NODES],
    ) -> [T; NODES] {
        core::array::from_fn(|node| {
            let variance = variances.get(node).copied().unwrap_or_default();
            let all = self.scatter(variance, node_variance(node)) + bend(departures, node);
            let most = T::splat((CURVE_DEPARTURE / NODE_DEVIATION) * (CURVE_DEPARTURE / NODE_DEVIATION))
                * node_variance(node);
            if all < most { all } else { most }
        })
    }

    /// The filters' variances that give these `stated` ones.
    pub(in crate::learning) fn filter_variances(
        &self,
        stated: &[T; NODES],
        departures: &[T; NODES],
    ) -> [T; NODES] {
        core::array::from_fn(|node| {
            let all = stated.get(node).copied().unwrap_or_default();
            self.filtered(excess(all, bend(departures, node)), node_variance(node))
        })
    }

    /// Variance of an estimate from the variance `P` and the prior `P₀` of its filter, which counts `n` windows as one. After
    /// `N` windows with independent errors of variance `r` it has `1/P = 1/P₀ + N/(n·r)`. Of the prior's error the share
    /// `P/P₀` remains. The windows add `N·r·(P/(n·r))²`, which is `(P - P²/P₀)/n`.
    fn scatter(&self, variance: T, prior: T) -> T {
        let left = if prior > T::splat(0.0) { variance * variance / prior } else { T::splat(0.0) };
        left + (variance - left) / self.correlation
    }

    /// The filter's variance for this variance of its estimate.
    fn filtered(&self, variance: T, prior: T) -> T {
        let (zero, one, two) = (T::splat(0.0), T::splat(1.0), T::splat(2.0));
        if !(prior > zero) {
            return zero;
        }
        let linear = one / self.correlation;
        let root = (linear * linear + two * two * (one - linear) / prior * variance).sqrt();
        let found = two * variance / (linear + root);
        if found < prior { found } else { prior }
    }

    /// Variance of the null offset in use (1) by noise, and the error (1) of the null offset per relative change of the
    /// spool's gain. `slope` is the table's (m³/s per unit opening).
    pub(in crate::learning) fn null_errors(
        &self,
        state: &CurveState<T>,
        evidence: &CurveEvidence<T>,
        slope: T,
    ) -> [T; 2] {
        let distance = state.offset - evidence.null;
        let [back, forth] = &evidence.directions;
        let null = evidence.null + self.known_null;
        [state.variance + distance * distance, null * self.lag_share(back.slopes + forth.slopes, slope)]
    }

    /// Time that averages the offset of the spool's sensor, over the memory of these sums of squared slopes (squared
    /// steps); at most 1. If the spool's gain changes during the memory, the offset of the sensor follows it late, and
    /// the error of the null offset is this share of the change. `slope` is the table's (m³/s per unit opening).
    fn lag_share(&self, sums: T, slope: T) -> T {
        let slope = slope * self.grid.per_flow;
        let all = self.average * sums;
        if all > slope * slope { slope * slope / all } else { T::splat(1.0) }
    }
}

/// Weight of a prior with this standard deviation, at this variance of the errors.
pub(super) fn belief_in<T: Real>(variance: T, deviation: f64) -> T {
    variance * T::splat(1.0 / (deviation * deviation))
}

/// What `all` is more than a part; at least 0.
pub(super) fn excess<T: Real>(all: T, part: T) -> T {
    if all > part { all - part } else { T::splat(0.0) }
}

/// Variance (squared steps) of the error by the curve's bend beside a node. With a given second difference of the nodes a
/// curve is farthest from the straight pieces if it bends at one flow midway, by a quarter of the difference. The variance of
/// what is only known to lie within this distance is a third of its square.
fn bend<T: Real>(departures: &[T; NODES], node: usize) -> T {
    match departures.get(node.wrapping_sub(1)..node.wrapping_add(2)) {
        Some([below, here, above]) => {
            let quarter = T::splat(0.25) * (*below + *above - *here - *here);
            T::splat(BOUNDED) * quarter * quarter
        }
        _ => T::splat(0.0),
    }
}
