//! What is known of asymmetry, null offset and departures: their standard deviations, and sums that give known values.

use super::{CurveEvidence, CurveState, Direction, FIRST_ERRORS, FlowCurve, GAIN_DEVIATION, NULL_DEVIATION};
use crate::compensation::NODES;
use crate::learning::curve_nodes::{DEPARTURE, NODE_DEVIATION, node_variance};
use crate::learning::least_squares::BOUNDED;
use crate::learning::tuning::BISECTIONS;
use crate::number::Real;

impl<T: Real> FlowCurve<T> {
    /// Standard deviation of the asymmetry (1): half of the difference of two gains.
    pub(in crate::learning) fn asymmetry_deviation(&self, evidence: &CurveEvidence<T>) -> T {
        let variance = self.variance(evidence);
        let belief = variance * T::splat(1.0 / (GAIN_DEVIATION * GAIN_DEVIATION));
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
            let most =
                T::splat((DEPARTURE / NODE_DEVIATION) * (DEPARTURE / NODE_DEVIATION)) * node_variance(node);
            if all < most { all } else { most }
        })
    }

    /// The filters' variances that give these `stated` ones. The bend has at most the share `most` (1) of one.
    pub(in crate::learning) fn filter_variances(
        &self,
        stated: &[T; NODES],
        departures: &[T; NODES],
        most: T,
    ) -> [T; NODES] {
        core::array::from_fn(|node| {
            let all = stated.get(node).copied().unwrap_or_default();
            let (bend, most) = (bend(departures, node), most * all);
            self.filtered(all - if bend < most { bend } else { most }, node_variance(node))
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

    /// Sets the sums that give these values: the mean square of the errors (squared steps), an asymmetry (1) with its
    /// standard deviation (1), and a null offset (1) with its variance, at a flow gain (1). `gain_change` is the
    /// relative change (1) of the spool's gain during a test, and `slope` the table's (m³/s per unit opening).
    pub(in crate::learning) fn set_known(
        &self,
        (state, evidence): (&mut CurveState<T>, &mut CurveEvidence<T>),
        square: T,
        [asymmetry, deviation]: [T; 2],
        [null, null_variance, gain_change]: [T; 3],
        [flow_gain, slope]: [T; 2],
    ) {
        let ([first, windows], one) = (FIRST_ERRORS, T::splat(1.0));
        evidence.windows = one / self.average;
        let sum = square * (evidence.windows + T::splat(windows)) - T::splat(first * windows);
        evidence.squares = if sum > T::splat(0.0) { sum } else { T::splat(0.0) };
        let variance = self.variance(evidence);
        let excess = |all: T, belief: T| if all > belief { all - belief } else { T::splat(0.0) };
        let belief = variance * T::splat(1.0 / (GAIN_DEVIATION * GAIN_DEVIATION));
        let flows = excess(T::splat(0.5) * variance / (deviation * deviation), belief);
        (evidence.asymmetry, evidence.null) = (asymmetry, null);
        // The sums of the slopes, half of them in either direction. Their noise and the late gain give the variance.
        let half = T::splat(0.5);
        let belief_in_null = variance * T::splat(1.0 / (NULL_DEVIATION * NULL_DEVIATION));
        let slopes = |noise: T| excess(variance / noise, belief_in_null);
        let (mut low, mut high) = (T::splat(0.0), null_variance);
        for _ in 0..BISECTIONS {
            let noise = half * (low + high);
            let late = (null + self.known_null) * gain_change * self.lag_share(slopes(noise), slope);
            if noise + late * late < null_variance { low = noise } else { high = noise }
        }
        let (noise, slopes) = (high, slopes(high));
        let (slopes, slope_errors) = (half * slopes, half * (slopes + belief_in_null) * null);
        (state.offset, state.variance) = (null, noise);
        let of = |gain: T| {
            let flow_errors = (flows + belief) * (gain / flow_gain - one);
            Direction { flows, flow_errors, slopes, slope_errors, ..Direction::default() }
        };
        evidence.directions = [of(one - asymmetry), of(one + asymmetry)];
    }

    /// Sets the sums that give this share of the flow gain (1), from the sum of the squared openings (1) and the table's
    /// slope (m³/s per unit opening).
    pub(in crate::learning) fn set_share(
        &self,
        evidence: &mut CurveEvidence<T>,
        share: T,
        openings: T,
        slope: T,
    ) {
        let slope = slope * self.grid.per_flow;
        evidence.recent_flows = openings * slope * slope;
        evidence.recent_departures = share * evidence.recent_flows;
    }
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
