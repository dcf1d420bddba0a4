//! The flow curve (Fig. 4b and Table 2 of the paper), from spool opening and displacement without load.
//!
//! Without load the piston's motion is the flow: `A·x(t) = A·x(0) + ∫f(x_v)dt`. For a piecewise linear `f`
//! this is linear in the slopes. Nothing is differentiated, so noise on the displacement is not amplified.

use nalgebra::{DMatrix, DVector, DVectorView, SMatrix, SVector};

use super::Estimate;
use super::clipping::check_unclipped;
use super::gaps::{bridged, check, stretches};
use super::integrated_noise::{MOST_MEMORY, Part, clustering, memory_of, whitened};
use crate::{Error, Result, checks, interruption};

/// Least number of samples within a cell or beyond a point.
pub(super) const LEAST_SAMPLES: usize = 20;
/// Least number of samples of a stretch between gaps. Each stretch has its own offset and drift.
const LEAST_STRETCH: usize = 100;
/// Longest gap (samples) that is bridged by a straight line.
pub(super) const BRIDGED: usize = 3;
/// Largest change of the flow from the middle to an end of a recording, as a share.
const LARGEST_CHANGE: f64 = 0.05;
/// Number of fits, each with the noise that the one before left.
const ROUNDS: usize = 3;
/// Largest speed (m/s) of a piston. Those of test actuators reach a few.
const FASTEST: f64 = 20.0;
/// Largest opening that can still be a fraction of the stroke.
const LARGEST_OPENING: f64 = 1.2;

/// One test: spool opening (1) and displacement (m), sample by sample.
#[derive(Debug, Clone, Copy)]
pub struct Recording<'a> {
    /// Spool opening (1).
    pub spool: &'a [f64],
    /// Displacement (m).
    pub displacement: &'a [f64],
}

/// A flow curve with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowCurveEstimate {
    /// Spool openings (1) of the control points.
    pub openings: Vec<f64>,
    /// Flow (m³/s) at the control points.
    pub flows: Vec<f64>,
    /// Standard uncertainty (m³/s) at the control points; extrapolated points have that of the line.
    pub uncertainty: Vec<f64>,
    /// Whether the spool reached the point; the others are extrapolated.
    pub measured: Vec<bool>,
}

/// The flow curve through `knots` evenly spaced control points from −1 to 1, from recordings at a rate (Hz)
/// with a piston of an area (m²). Control points that the spool did not reach lie on the line through the
/// last two reached ones.
///
/// # Errors
/// No recordings, unequal or too short ones, openings that are not fractions of the stroke, fewer than two
/// reached points on a side, a flow that does not rise with the opening, one that changes by more than 10 % in a
/// recording, or a piston faster than 20 m/s.
pub fn identify_flow_curve(
    recordings: &[Recording<'_>],
    sample_rate: f64,
    piston_area: f64,
    knots: usize,
) -> Result<FlowCurveEstimate> {
    Fit::new(recordings, sample_rate, piston_area, control_points(knots)?)?.curve()
}

/// Evenly spaced openings (1) from −1 to 1, 0 among them.
pub(super) fn control_points(knots: usize) -> Result<Vec<f64>> {
    let allowed = "must be an odd number from 5 to 63, so that 0 is one of them";
    checks::require((5..=63).contains(&knots) && !knots.is_multiple_of(2), "knots", knots, allowed)?;
    let half = (knots / 2) as f64;
    Ok((0..knots).map(|i| (i as f64 - half) / half).collect())
}

/// Refuses a spool signal that is not a fraction of the stroke.
pub(super) fn check_opening(opening: f64) -> Result<()> {
    let allowed = "must be a fraction of the spool's stroke, within ±1";
    checks::require(opening.abs() <= LARGEST_OPENING, "spool", opening, allowed)
}

/// Spool and displacement of a stretch without a gap.
pub(super) type Stretch = (Vec<f64>, Vec<f64>);

/// The stretches of all recordings, with short gaps bridged, if their openings are accepted.
pub(super) fn finite_stretches(
    recordings: &[Recording<'_>],
    accept: impl Fn(f64) -> Result<()>,
) -> Result<Vec<Stretch>> {
    checks::require(!recordings.is_empty(), "spool", "no recordings", "must have at least one")?;
    let mut parts = Vec::new();
    for Recording { spool, displacement } in recordings {
        check([("spool", spool), ("displacement", displacement)], LEAST_STRETCH)?;
        check_unclipped(&[("displacement", displacement)])?;
        let (spool, displacement) = (bridged(spool, BRIDGED), bridged(displacement, BRIDGED));
        let has_sample = |i: usize| spool[i].is_finite() && displacement[i].is_finite();
        for part in stretches(spool.len(), LEAST_STRETCH, has_sample) {
            spool[part.clone()].iter().try_for_each(|opening| accept(*opening))?;
            parts.push((spool[part.clone()].to_vec(), displacement[part].to_vec()));
        }
    }
    let allowed = format!("must have {LEAST_STRETCH} samples without a gap of more than {BRIDGED}");
    checks::require(!parts.is_empty(), "spool and displacement", "gaps throughout", allowed)?;
    Ok(parts)
}

/// Refuses a curve with fewer than two reached points on a side.
pub(super) fn check_reach(openings: &[f64], measured: &[bool]) -> Result<()> {
    let zero = openings.len() / 2;
    for side in [-1_i32, 1] {
        let near = |k: i32| measured[zero.saturating_add_signed((k * side) as isize)];
        let reached = openings.iter().zip(measured).filter(|(x, m)| **m && x.signum() == f64::from(side));
        let found = format!("{} control points on the side of {side}", reached.count());
        checks::require(near(1) && near(2), "spool", found, "must reach at least two on either side")?;
    }
    Ok(())
}

/// Refuses a curve that does not rise.
pub(super) fn check_rise(openings: &[f64], flows: &[f64]) -> Result<()> {
    let Some(i) = (1..flows.len()).find(|&i| flows[i] <= flows[i - 1] || flows[i].is_nan()) else {
        return Ok(());
    };
    let found = format!("does not rise from opening {:.3} to {:.3}", openings[i - 1], openings[i]);
    let allowed = "must rise with the opening: check the signs, or take more data, less noise, fewer knots";
    Err(Error::value("flow", found, allowed))
}

/// Refuses a flow (m³/s) at the full opening that would move the piston faster than any.
pub(super) fn check_speed(flow: f64, piston_area: f64) -> Result<()> {
    let (speed, allowed) =
        (flow.abs() / piston_area, "must be at most 20 at the full opening: check the unit of the times");
    let name = "speed of the displacement";
    checks::require(speed <= FASTEST, name, format!("{speed:.3} m/s"), allowed)
}

/// Refuses a flow (m³/s) that is more uncertain than it is large.
fn check_certain(name: &str, found: Estimate) -> Result<()> {
    let Estimate { value, uncertainty } = found;
    let allowed = "must exceed its uncertainty: add tests with smaller strokes";
    checks::require(uncertainty < value, name, format!("{value:.3e} ± {uncertainty:.1e} m³/s"), allowed)
}

/// The flow gain `K_v` (m³/s) at the origin: one slope for all openings within ±`limit`.
///
/// # Errors
/// As [`identify_flow_curve`]; a limit outside 0.01 to 0.5.
pub fn identify_flow_gain(
    recordings: &[Recording<'_>],
    sample_rate: f64,
    piston_area: f64,
    limit: f64,
) -> Result<Estimate> {
    checks::require((0.01..=0.5).contains(&limit), "limit", limit, "must be an opening from 0.01 to 0.5")?;
    let cells = (0.9 / limit).floor().clamp(1.0, 9.0) as usize;
    let outer = |i: usize| limit + (1.0 - limit) * i as f64 / cells as f64;
    let negative = (0..=cells).rev().map(|i| -outer(i));
    let openings: Vec<f64> = negative.chain((0..=cells).map(outer)).collect();
    Fit::new(recordings, sample_rate, piston_area, openings)?.slope(cells)
}

/// Share by which the flow at the end of a recording exceeds that in its middle, from the fitted displacement times the
/// area and its residuals (m³): least squares on `∫Q·t dt`, `∫Q dt`, 1, `t` and `t²`. Zero within three deviations.
fn flow_change(fitted: &[f64], residuals: &[f64]) -> f64 {
    let count = residuals.len();
    let time = |i: usize| 2.0 * i as f64 / (count - 1) as f64 - 1.0;
    let mut moment = 0.0;
    let rows: Vec<_> = (0..count)
        .map(|i| {
            let before = i.saturating_sub(1);
            moment += 0.5 * (time(i) + time(before)) * (fitted[i] - fitted[before]);
            SVector::<f64, 5>::from([moment, fitted[i], 1.0, time(i), time(i).powi(2)])
        })
        .collect();
    let normal: SMatrix<f64, 5, 5> = rows.iter().map(|row| row * row.transpose()).sum();
    let right: SVector<f64, 5> = rows.iter().zip(residuals).map(|(row, residual)| row * *residual).sum();
    // The flows (m³) are small compared with the other columns.
    let scale = normal.diagonal().map(|d| d.sqrt().recip());
    let scaled = SMatrix::<f64, 5, 5>::from_fn(|i, j| normal[(i, j)] * scale[i] * scale[j]);
    let Some(inverse) = scaled.try_inverse() else { return 0.0 };
    let found = (inverse * right.component_mul(&scale)).component_mul(&scale);
    let remaining: Vec<f64> =
        rows.iter().zip(residuals).map(|(row, residual)| residual - row.dot(&found)).collect();
    let square: f64 = remaining.iter().map(|v| v * v).sum();
    let product: f64 = remaining.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let deviation = (inverse[(0, 0)] * inflation(square, product) * square / count as f64).sqrt() * scale[0];
    // NaN, of a spool at rest, is no change.
    if found[0].abs() > 3.0 * deviation { found[0] } else { 0.0 }
}

/// Factor on a variance by the correlation of the residuals, which reduces the effective number of samples.
fn inflation(square: f64, product: f64) -> f64 {
    let correlation = if square > 0.0 { (product / square).clamp(0.0, 0.9999) } else { 0.0 };
    (1.0 + correlation) / (1.0 - correlation)
}

/// Flow (m³) of a row by a solution, and the measured one, which is the last of the row.
fn fitted_and_measured(row: &[f64], solution: &DVector<f64>) -> (f64, f64) {
    let n = solution.len();
    (DVectorView::from_slice(row, n).dot(solution), row[n])
}

/// Flows (m³) less those of a solution.
fn residuals(part: &Part, solution: &DVector<f64>) -> Vec<f64> {
    let residual = |row| {
        let (fitted, measured) = fitted_and_measured(row, solution);
        measured - fitted
    };
    part.rows().map(residual).collect()
}

struct Fit {
    knots: Vec<f64>,
    /// Area (m²) of the piston.
    area: f64,
    /// Slope (m³/s) of each cell; zero without measurements.
    slopes: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Share by which the flow leaves its mean in the recordings, as when the supply pressure falls (1).
    flow_change: f64,
    /// Samples within each cell.
    inside: Vec<usize>,
    /// Samples at or beyond each knot, outwards.
    beyond: Vec<usize>,
}

impl Fit {
    fn new(recordings: &[Recording<'_>], sample_rate: f64, area: f64, knots: Vec<f64>) -> Result<Self> {
        checks::sample_rate("sample_rate", sample_rate)?;
        checks::positive("piston_area", area, "m²")?;
        let parts = finite_stretches(recordings, check_opening)?;
        let cells = knots.len() - 1;
        let mut inside = vec![0; cells];
        let mut beyond = vec![0; knots.len()];
        for opening in parts.iter().flat_map(|(spool, _)| spool) {
            let cell = knots[1..cells].iter().filter(|knot| **knot <= *opening).count();
            inside[cell] += 1;
            for (count, knot) in beyond.iter_mut().zip(&knots) {
                *count += usize::from(opening * knot.signum() >= knot.abs() - 1e-3);
            }
        }
        let mut fit = Self {
            knots,
            area,
            slopes: DVector::zeros(cells),
            covariance: DMatrix::zeros(cells, cells),
            flow_change: 0.0,
            inside,
            beyond,
        };
        fit.solve(&parts, sample_rate)?;
        Ok(fit)
    }

    /// Least squares on `A·x = Σ slope·∫ramp dt + offset + drift·t`, with a separate offset and drift for
    /// each stretch. Noise of the spool is integrated and that of the displacement is not, so the rows are whitened.
    fn solve(&mut self, stretches: &[Stretch], sample_rate: f64) -> Result<()> {
        let used: Vec<usize> = (0..self.inside.len()).filter(|c| self.inside[*c] >= LEAST_SAMPLES).collect();
        let n = used.len();
        let step = 1.0 / sample_rate;
        let refused = || {
            Error::value("spool", format!("{n} cells reached"), "must move enough to separate their slopes")
        };
        if n < 2 {
            return Err(refused());
        }
        // The outermost cells are unbounded, because a noisy sensor may read beyond the stroke.
        let bounds = used.iter().map(|&cell| {
            let low = if cell == 0 { f64::NEG_INFINITY } else { self.knots[cell] };
            (low, if cell + 2 == self.knots.len() { f64::INFINITY } else { self.knots[cell + 1] })
        });
        let bounds: Vec<(f64, f64)> = bounds.collect();
        let ramp =
            |opening: f64, (low, high): (f64, f64)| opening.clamp(low, high) - 0.0_f64.clamp(low, high);
        // The integral of each ramp, and the flow.
        let rows = |spool: &[f64], displacement: &[f64]| {
            let mut row = vec![0.0; n + 1];
            let mut values = Vec::with_capacity(spool.len() * row.len());
            let mut last = spool[0];
            for (opening, x) in spool.iter().zip(displacement) {
                if !values.is_empty() {
                    for (integral, bounds) in row.iter_mut().zip(&bounds) {
                        *integral += (ramp(last, *bounds) + ramp(*opening, *bounds)) * (0.5 * step);
                    }
                }
                last = *opening;
                row[n] = self.area * (x - displacement[0]);
                values.extend_from_slice(&row);
            }
            Part { width: n + 1, values }
        };
        let mut parts = Vec::with_capacity(stretches.len());
        for (spool, displacement) in stretches {
            interruption::check()?;
            parts.push(rows(spool, displacement));
        }
        let mut memory = MOST_MEMORY;
        let mut fit = || {
            let white: Vec<Part> = parts.iter().map(|part| whitened(part, memory)).collect::<Result<_>>()?;
            let (mut normal, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
            for row in white.iter().flat_map(Part::rows) {
                // The lower triangle, because the factorization reads no other.
                for (j, column) in normal.as_mut_slice().chunks_exact_mut(n).enumerate() {
                    column[j..].iter_mut().zip(&row[j..]).for_each(|(sum, value)| *sum += row[j] * value);
                }
                right.iter_mut().zip(row).for_each(|(sum, value)| *sum += row[n] * value);
            }
            let factor = normal.cholesky().ok_or_else(refused)?;
            let solution = factor.solve(&right);
            memory = memory_of(parts.iter().map(|part| residuals(part, &solution)))?;
            Ok::<_, Error>((white, factor, solution))
        };
        for _ in 1..ROUNDS {
            fit()?;
        }
        let (white, factor, solution) = fit()?;
        let remaining: Vec<Vec<f64>> = white.iter().map(|part| residuals(part, &solution)).collect();
        let variance: f64 = remaining.iter().flatten().map(|residual| residual * residual).sum();
        let samples = remaining.iter().map(Vec::len).sum::<usize>();
        let change_of = |part: &Part| {
            let fitted: Vec<f64> = part.rows().map(|row| fitted_and_measured(row, &solution).0).collect();
            flow_change(&fitted, &residuals(part, &solution))
        };
        let changes: Vec<f64> = parts.iter().map(change_of).collect();
        self.flow_change = (changes.iter().map(|one| one * one).sum::<f64>() / changes.len() as f64).sqrt();
        if let Some(flow_change) = changes.iter().find(|one| one.abs() > LARGEST_CHANGE) {
            let found = format!("{:+.0} % from the first to the last sample", 200.0 * flow_change);
            let allowed = "must change by at most 10 % in a recording: keep the supply pressure";
            return Err(Error::value("flow", found, allowed));
        }
        let free = samples.saturating_sub(n + 2 * stretches.len()).max(1);
        let covariance = factor.inverse() * (variance / free as f64 * clustering(&remaining));
        for (i, &cell) in used.iter().enumerate() {
            self.slopes[cell] = solution[i];
            for (j, &other) in used.iter().enumerate() {
                self.covariance[(cell, other)] = covariance[(i, j)];
            }
        }
        Ok(())
    }

    fn slope(&self, cell: usize) -> Result<Estimate> {
        let value = self.slopes[cell];
        let allowed = "must pass the origin for a flow gain";
        checks::require(self.inside[cell] >= LEAST_SAMPLES, "spool", "hardly moves about null", allowed)?;
        let allowed = "must rise with the opening: check the signs, or take more data, less noise";
        checks::require(value > 0.0, "flow", "does not rise with the opening", allowed)?;
        let uncertainty = self.covariance[(cell, cell)].sqrt().hypot(self.flow_change * value);
        let found = Estimate { value, uncertainty };
        check_speed(value, self.area)?;
        check_certain("flow_gain", found)?;
        Ok(found)
    }

    fn curve(self) -> Result<FlowCurveEstimate> {
        let openings = self.knots;
        let zero = openings.len() / 2;
        let measured: Vec<bool> = self.beyond.iter().map(|count| *count >= LEAST_SAMPLES).collect();
        check_reach(&openings, &measured)?;
        let mut flows = vec![0.0; openings.len()];
        let mut uncertainty = vec![0.0; openings.len()];
        // From the origin outwards, the flow is the sum of slopes times widths; beyond the data the last
        // slope continues.
        for side in [-1_isize, 1] {
            let mut widths = DVector::zeros(self.slopes.len());
            let mut last_cell = zero;
            for k in 1..=zero {
                let knot = zero.saturating_add_signed(side * k as isize);
                let cell = if side > 0 { knot - 1 } else { knot };
                if measured[knot] {
                    last_cell = cell;
                }
                widths[last_cell] += openings[knot] - openings[knot.saturating_add_signed(-side)];
                flows[knot] = self.slopes.dot(&widths);
                let scatter = (&self.covariance * &widths).dot(&widths).max(0.0).sqrt();
                uncertainty[knot] = scatter.hypot(self.flow_change * flows[knot]);
            }
        }
        check_rise(&openings, &flows)?;
        check_speed(flows[2 * zero], self.area)?;
        for k in (0..flows.len()).filter(|k| measured[*k] && *k != zero) {
            let name = format!("flow at the opening {:.3}", openings[k]);
            check_certain(&name, Estimate::new(flows[k].abs(), uncertainty[k]))?;
        }
        Ok(FlowCurveEstimate { openings, flows, uncertainty, measured })
    }
}

#[cfg(test)]
mod tests;
