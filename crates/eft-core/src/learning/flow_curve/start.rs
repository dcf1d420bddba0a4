//! The sums of a curve that starts from what is known of it.

use super::known::{belief_in, excess};
use super::{
    COMMON_WEIGHT, CurveEvidence, CurveState, Direction, FIRST_ERRORS, FlowCurve, GAIN_DEVIATION,
    NULL_DEVIATION,
};
use crate::learning::tuning::CURVE_AVERAGE;
use crate::number::Real;

/// What is known of a curve apart from its departures.
#[derive(Debug, Clone, Copy)]
pub(in crate::learning) struct Known<T> {
    /// Mean square (squared steps) of a window's residual.
    pub(in crate::learning) mean_square: T,
    /// The asymmetry and its standard deviation (1).
    pub(in crate::learning) asymmetry: [T; 2],
    /// Mean departure as a share of the flow (1).
    pub(in crate::learning) common: T,
    /// Share of the flow gain (1) that follows from the departures, and the sum of the squared openings in its memory.
    pub(in crate::learning) share: T,
    pub(in crate::learning) openings: T,
    /// Offset of the spool's sensor (1).
    pub(in crate::learning) sensor: T,
    /// The null offset in use, and the distance (1) of the one that was found.
    pub(in crate::learning) null: [T; 2],
    pub(in crate::learning) memory: Memory<T>,
}

/// How long a curve remembers.
#[derive(Debug, Clone, Copy)]
pub(in crate::learning) struct Memory<T> {
    /// Time (s) of the residuals and of the sensor's offset.
    pub(in crate::learning) time: T,
    /// Time (s) of the null offset, in which the table's slope squared counts as that at null.
    pub(in crate::learning) null_time: T,
    /// Share (1) of it in which an error of a direction's gain looks like a null offset.
    pub(in crate::learning) null_coupling: T,
}

impl<T: Real> FlowCurve<T> {
    /// The memory at this slope of the table at null (m³/s per unit opening).
    pub(in crate::learning) fn memory(
        &self,
        state: &CurveState<T>,
        evidence: &CurveEvidence<T>,
        slope: T,
    ) -> Memory<T> {
        let (zero, one, slope) = (T::splat(0.0), T::splat(1.0), slope * self.grid.per_flow);
        let [back, forth] = &evidence.directions;
        let slopes = back.slopes + forth.slopes;
        let variance = self.variance(evidence);
        let alone = variance / state.variance - belief_in(variance, NULL_DEVIATION);
        Memory {
            time: evidence.windows * self.period(),
            null_time: slopes * self.period() / (slope * slope),
            null_coupling: if slopes > zero { (one - alone / slopes).limit(zero, one) } else { zero },
        }
    }

    /// Sets the sums that give what is known, at a flow gain (1) and this slope of the table at null (m³/s per unit
    /// opening).
    pub(in crate::learning) fn start(
        &self,
        (state, evidence): (&mut CurveState<T>, &mut CurveEvidence<T>),
        known: &Known<T>,
        [flow_gain, slope]: [T; 2],
    ) {
        let [first, windows] = FIRST_ERRORS;
        let count = known.memory.time / self.period();
        let squares = known.mean_square * (count + T::splat(windows));
        (evidence.windows, evidence.squares) = (count, excess(squares, T::splat(first * windows)));
        (evidence.sensor, evidence.readings) = (known.sensor, count);
        let slope = slope * self.grid.per_flow;
        evidence.recent_flows = known.openings * slope * slope;
        evidence.recent_departures = known.share * evidence.recent_flows;
        self.start_directions((state, evidence), known, [flow_gain, slope]);
        let [back, forth] = &evidence.directions;
        evidence.common = known.common;
        evidence.instrument_departures =
            known.common * (back.flows + forth.flows + T::splat(COMMON_WEIGHT)) / flow_gain;
    }

    /// Sets asymmetry and null offset, and the sums whose solution they are. Either direction has half of the
    /// evidence. `slope` is in steps.
    fn start_directions(
        &self,
        (state, evidence): (&mut CurveState<T>, &mut CurveEvidence<T>),
        known: &Known<T>,
        [flow_gain, slope]: [T; 2],
    ) {
        let (one, half, variance) = (T::splat(1.0), T::splat(0.5), self.variance(evidence));
        let ([asymmetry, deviation], [null, distance]) = (known.asymmetry, known.null);
        let Memory { null_time, null_coupling, .. } = known.memory;
        let [gain_belief, null_belief] = [GAIN_DEVIATION, NULL_DEVIATION].map(|of| belief_in(variance, of));
        let flows = excess(half * variance / (deviation * deviation), gain_belief);
        let slopes = half * (null_time / self.period()) * (slope * slope);
        let alone = (one - null_coupling) * (slopes + slopes) + null_belief;
        // Sums with more coupling would contradict each other. A motion in one direction has more, because all of its
        // evidence is in one sum. A shorter time with less coupling then has the same variance.
        let most = flows / (flows + gain_belief);
        let [slopes, null_coupling] = if null_coupling > most {
            [slopes * (one - null_coupling) / (one - most), most]
        } else {
            [slopes, null_coupling]
        };
        (evidence.asymmetry, evidence.null) = (asymmetry, null);
        (state.offset, state.variance) = (null + distance, variance / alone);
        // Two roots, because the product of both sums may overflow.
        let coupled = (null_coupling * slopes).sqrt() * (flows + gain_belief).sqrt();
        // The normal equations of the offset and of this direction's gain over that of the flow.
        let of = |gain: T, slope_instruments: T| {
            let error = gain / flow_gain - one;
            Direction {
                flows,
                flow_errors: (flows + gain_belief) * error + slope_instruments * state.offset,
                slopes,
                slope_instruments,
                slope_errors: (slopes + half * null_belief) * state.offset + slope_instruments * error,
            }
        };
        evidence.directions = [of(one - asymmetry, -coupled), of(one + asymmetry, coupled)];
    }

    /// Period (s) of a window.
    fn period(&self) -> T {
        self.average * T::splat(CURVE_AVERAGE)
    }
}
