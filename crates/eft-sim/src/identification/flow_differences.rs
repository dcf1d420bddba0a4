//! The flow curve by the paper's method: the mean of flows by central differences at each control point.
//!
//! The method is simple and accurate for a displacement without noise. It multiplies noise by the sample
//! rate, which the fit of [`identify_flow_curve`](super::identify_flow_curve) avoids.

use super::clipping::check_unclipped;
use super::flow_curve::{
    FlowCurveEstimate, LEAST_SAMPLES, Recording, check_opening, check_reach, check_rise, check_speed,
    control_points,
};
use super::gaps::check;
use crate::{Result, checks};

/// Samples within this share of the distance between two control points belong to a point.
const NEAR: f64 = 0.2;

/// The flow curve through `knots` evenly spaced control points, from recordings at a rate (Hz) with a piston
/// of an area (m²): velocity by central differences, flow `A·ẋ`, its mean over the samples near each control
/// point; beyond the last reached point, a straight line through the last two.
///
/// # Errors
/// As [`identify_flow_curve`](super::identify_flow_curve).
pub fn flow_curve_by_differences(
    recordings: &[Recording<'_>],
    sample_rate: f64,
    piston_area: f64,
    knots: usize,
) -> Result<FlowCurveEstimate> {
    checks::sample_rate("sample_rate", sample_rate)?;
    checks::positive("piston_area", piston_area, "m²")?;
    let openings = control_points(knots)?;
    checks::require(!recordings.is_empty(), "spool", "no recordings", "must have at least one")?;
    let half = (knots / 2) as f64;
    let mut sums = vec![(0_usize, 0.0, 0.0); knots];
    for recording in recordings {
        let (spool, displacement) = (recording.spool, recording.displacement);
        check([("spool", spool), ("displacement", displacement)], LEAST_SAMPLES)?;
        check_unclipped(&[("displacement", displacement)])?;
        for (opening, around) in spool.iter().skip(1).zip(displacement.windows(3)) {
            let flow = piston_area * (around[2] - around[0]) * 0.5 * sample_rate;
            if !(opening.is_finite() && flow.is_finite()) {
                continue;
            }
            check_opening(*opening)?;
            let place = (opening + 1.0) * half;
            let nearest = place.round();
            if (place - nearest).abs() <= NEAR
                && let Some((count, sum, squares)) = sums.get_mut(nearest.max(0.0) as usize)
            {
                *count += 1;
                *sum += flow;
                *squares += flow * flow;
            }
        }
    }
    let measured: Vec<bool> = sums.iter().map(|sum| sum.0 >= LEAST_SAMPLES).collect();
    check_reach(&openings, &measured)?;
    let mean = |i: usize| sums[i].1 / sums[i].0 as f64;
    let spread = |i: usize| {
        let count = sums[i].0 as f64;
        ((sums[i].2 / count - mean(i) * mean(i)).max(0.0) / count).sqrt()
    };
    let zero = knots / 2;
    let (mut flows, mut uncertainty) = (vec![0.0; knots], vec![0.0; knots]);
    for side in [-1_isize, 1] {
        let at = |k: usize| zero.saturating_add_signed(side * k as isize);
        let mut last = (0, 0);
        for k in 1..=zero {
            let knot = at(k);
            if measured[knot] {
                last = (last.1, k);
                (flows[knot], uncertainty[knot]) = (mean(knot), spread(knot));
                continue;
            }
            // A straight line through the last two reached points.
            let (inner, outer) = (at(last.0), at(last.1));
            let beyond = (k - last.1) as f64 / (last.1 - last.0) as f64;
            flows[knot] = flows[outer] + beyond * (flows[outer] - flows[inner]);
            uncertainty[knot] = ((1.0 + beyond) * uncertainty[outer]).hypot(beyond * uncertainty[inner]);
        }
    }
    check_rise(&openings, &flows)?;
    check_speed(flows[knots - 1], piston_area)?;
    Ok(FlowCurveEstimate { openings, flows, uncertainty, measured })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_without_a_flow_curve_are_refused() {
        let text = |spool: &[f64], displacement: &[f64]| {
            let recordings = [Recording { spool, displacement }];
            flow_curve_by_differences(&recordings, 100.0, 0.01, 21).unwrap_err().to_string()
        };
        let still = vec![0.0; 200];
        assert!(text(&still, &still).contains("must reach at least two"));
        assert!(text(&vec![30.0; 200], &still).starts_with("spool = 30"));
        assert!(text(&still[1..], &still).starts_with("displacement = 200 samples"));
    }
}
