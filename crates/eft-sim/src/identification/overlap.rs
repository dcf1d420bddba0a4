//! Overlap or underlap of the spool's lands, from spool opening and displacement near null without load.
//!
//! Near null the flow curve is straight on both sides: `A·x(t) = A·x₀ + ∫(s₊·max(x_v − a, 0) + s₋·min(x_v −
//! c, 0))dt`. The two knees lie at `a = b + o` and `c = b − o`, with the null bias `b` and the overlap `o`,
//! negative for an underlap. Least squares fit knees and slopes to the displacement, without differentiation.
//! Unlike the fit of the flow curve this has no drift, which would be indistinguishable from a null bias.

use nalgebra::{DVector, Matrix2, Matrix4, Vector2, Vector4};

use super::flow_curve::{Stretch, check_opening, finite_stretches};
use super::{Estimate, Recording};
use crate::{Error, Result, checks, interruption};

/// Least number of samples beyond a knee.
const LEAST_SAMPLES_BEYOND: usize = 50;
/// Largest opening of the test, because the flow curve of a valve bends at larger openings.
const NEAR_NULL: f64 = 0.2;
/// Knees of the first, coarse search on either side of null, as shares of the largest opening there.
const GRID: [f64; 13] = [-0.6, -0.4, -0.2, -0.1, -0.05, -0.02, 0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.6];
const ITERATIONS: usize = 60;

/// The estimates of a valve near null.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverlapEstimate {
    /// Overlap of the lands (1), negative for an underlap.
    pub overlap: Estimate,
    /// Opening (1) at which the valve passes nothing.
    pub null_bias: Estimate,
    /// Slopes (m³/s per unit opening) beyond the knees, on the negative and on the positive side.
    pub flow_gains: [Estimate; 2],
}

/// The overlap from recordings at a rate (Hz) with a piston of an area (m²), without load.
///
/// # Errors
/// No recordings, unequal or too short ones, openings beyond ±0.2, too few samples beyond the knees, or a
/// flow that does not rise with the opening.
pub fn identify_overlap(
    recordings: &[Recording<'_>],
    sample_rate: f64,
    piston_area: f64,
) -> Result<OverlapEstimate> {
    checks::sample_rate("sample_rate", sample_rate)?;
    checks::positive("piston_area", piston_area, "m²")?;
    let parts = finite_stretches(recordings, check_near_null)?;
    let test = Test { parts, step: 1.0 / sample_rate, area: piston_area };
    let [lowest, highest] = test.reach()?;
    let knees = test.refine(test.grid_search(lowest, highest)?);
    let (slopes, residual, jacobian) = test.fit_at(knees);
    let allowed = "must rise with the opening: check the signs, or take more data, less noise";
    checks::require(slopes.min() > 0.0, "flow", "does not rise with the opening", allowed)?;
    test.check_samples_beyond(knees)?;
    let covariance = covariance(&residual, &jacobian).ok_or_else(|| {
        Error::value("spool", "hardly moves about null", "must pass both knees for an overlap")
    })?;
    let combined = |weights: [f64; 2]| {
        let weights = Vector4::new(weights[0], weights[1], 0.0, 0.0);
        Estimate::new(
            weights[0] * knees[0] + weights[1] * knees[1],
            (covariance * weights).dot(&weights).max(0.0).sqrt(),
        )
    };
    let slope = |side: usize| Estimate::new(slopes[side], covariance[(2 + side, 2 + side)].max(0.0).sqrt());
    Ok(OverlapEstimate {
        overlap: combined([-0.5, 0.5]),
        null_bias: combined([0.5, 0.5]),
        flow_gains: [slope(0), slope(1)],
    })
}

/// Refuses an opening away from null.
fn check_near_null(opening: f64) -> Result<()> {
    check_opening(opening)?;
    if opening.abs() <= NEAR_NULL {
        return Ok(());
    }
    let allowed = format!("must stay near null, within ±{NEAR_NULL}, for an overlap");
    Err(Error::value("spool", opening, allowed))
}

/// Knees and slopes on the negative and on the positive side.
type Sides = Vector2<f64>;

struct Test {
    parts: Vec<Stretch>,
    step: f64,
    area: f64,
}

impl Test {
    fn spool(&self) -> impl Iterator<Item = f64> + '_ {
        self.parts.iter().flat_map(|(spool, _)| spool.iter().copied())
    }

    /// Least and greatest opening.
    fn reach(&self) -> Result<[f64; 2]> {
        let lowest = self.spool().fold(f64::INFINITY, f64::min);
        let highest = self.spool().fold(f64::NEG_INFINITY, f64::max);
        let found = format!("from {lowest:.4} to {highest:.4}");
        checks::require(lowest < 0.0 && highest > 0.0, "spool", found, "must move to both sides of null")?;
        Ok([lowest, highest])
    }

    /// The best knees of a grid.
    fn grid_search(&self, lowest: f64, highest: f64) -> Result<Sides> {
        let measured = self.measured();
        // Each column depends on one knee only.
        let below = GRID.map(|part| part * -lowest).map(|knee| (knee, self.negative(knee)));
        let above = GRID.map(|part| part * highest).map(|knee| (knee, self.positive(knee)));
        let mut best = (f64::INFINITY, None);
        for (below, negative) in &below {
            for (above, positive) in &above {
                interruption::check()?;
                let (slopes, residual) = fit(negative, positive, measured.clone());
                let squares = residual.dot(&residual);
                if slopes.min() > 0.0 && squares < best.0 {
                    best = (squares, Some(Sides::new(*below, *above)));
                }
            }
        }
        let allowed = "must rise with the opening on both sides of null: check the signs";
        best.1.ok_or_else(|| Error::value("flow", "does not rise with the opening", allowed))
    }

    /// The knees of the least squares, by damped Gauss-Newton steps.
    fn refine(&self, mut knees: Sides) -> Sides {
        let (_, mut residual, mut jacobian) = self.fit_at(knees);
        let mut damping = 1e-3;
        for _ in 0..ITERATIONS {
            let mut normal = product(&jacobian);
            for i in 0..4 {
                normal[(i, i)] *= 1.0 + damping;
            }
            let right = Vector4::from_fn(|i, _| jacobian[i].dot(&residual));
            let Some(step) = normal.cholesky().map(|factor| factor.solve(&right)) else {
                break;
            };
            let next = knees + Sides::new(step[0], step[1]);
            let (_, next_residual, next_jacobian) = self.fit_at(next);
            if next_residual.dot(&next_residual) < residual.dot(&residual) {
                let small = (next - knees).amax() < 1e-9;
                (knees, residual, jacobian, damping) = (next, next_residual, next_jacobian, 0.1 * damping);
                if small {
                    break;
                }
            } else {
                damping *= 10.0;
                if damping > 1e9 {
                    break;
                }
            }
        }
        knees
    }

    /// The best slopes with these knees, the residuals of displacement times area (m³), and the model's
    /// derivatives with respect to knees and slopes.
    fn fit_at(&self, knees: Sides) -> (Sides, DVector<f64>, [DVector<f64>; 4]) {
        let (negative, positive) = (self.negative(knees[0]), self.positive(knees[1]));
        let (slopes, residual) = fit(&negative, &positive, self.measured());
        // Whether the ports are open.
        let negative_open = self.integrated(|x| if x < knees[0] { 1.0 } else { 0.0 });
        let positive_open = self.integrated(|x| if x > knees[1] { 1.0 } else { 0.0 });
        (slopes, residual, [negative_open * -slopes[0], positive_open * -slopes[1], negative, positive])
    }

    /// The integral of the opening beyond the negative knee.
    fn negative(&self, knee: f64) -> DVector<f64> {
        self.integrated(|x| (x - knee).min(0.0))
    }

    /// The same beyond the positive knee.
    fn positive(&self, knee: f64) -> DVector<f64> {
        self.integrated(|x| (x - knee).max(0.0))
    }

    /// The integral of a function of the opening by the trapezoidal rule, without each stretch's mean.
    fn integrated(&self, of: impl Fn(f64) -> f64) -> DVector<f64> {
        let mut all = Vec::with_capacity(self.parts.iter().map(|(spool, _)| spool.len()).sum());
        for (spool, _) in &self.parts {
            let (mut sum, mut last) = (0.0, of(spool[0]));
            let integral = spool.iter().map(|x| {
                let now = of(*x);
                sum += 0.5 * self.step * (now + last);
                last = now;
                sum
            });
            push_centred(&mut all, integral);
        }
        DVector::from_vec(all)
    }

    fn measured(&self) -> DVector<f64> {
        let mut all = Vec::new();
        for (_, displacement) in &self.parts {
            push_centred(&mut all, displacement.iter().map(|x| self.area * x));
        }
        DVector::from_vec(all)
    }

    /// Refuses a spool signal with too few samples beyond the knees.
    fn check_samples_beyond(&self, knees: Sides) -> Result<()> {
        let below = self.spool().filter(|x| *x < knees[0].min(0.0)).count();
        let above = self.spool().filter(|x| *x > knees[1].max(0.0)).count();
        let found = format!("{} samples beyond the overlap on one side", below.min(above));
        let allowed = format!("must have at least {LEAST_SAMPLES_BEYOND} on either side");
        checks::require(below.min(above) >= LEAST_SAMPLES_BEYOND, "spool", found, allowed)
    }
}

/// The slopes of the least squares on either side, and the residuals.
fn fit(negative: &DVector<f64>, positive: &DVector<f64>, measured: DVector<f64>) -> (Sides, DVector<f64>) {
    let across = negative.dot(positive);
    let normal = Matrix2::new(negative.dot(negative), across, across, positive.dot(positive));
    let right = Sides::new(negative.dot(&measured), positive.dot(&measured));
    let slopes = normal.cholesky().map_or(Sides::zeros(), |factor| factor.solve(&right));
    (slopes, measured - negative * slopes[0] - positive * slopes[1])
}

/// Appends a stretch minus its mean.
fn push_centred(all: &mut Vec<f64>, stretch: impl Iterator<Item = f64>) {
    let from = all.len();
    all.extend(stretch);
    let mean = all[from..].iter().sum::<f64>() / (all.len() - from) as f64;
    all[from..].iter_mut().for_each(|value| *value -= mean);
}

fn product(columns: &[DVector<f64>; 4]) -> Matrix4<f64> {
    Matrix4::from_fn(|i, j| columns[i].dot(&columns[j]))
}

/// The covariance of knees and slopes. Correlated residuals count by the sum of their correlations, because
/// the integral of a noisy spool signal is correlated over many samples.
fn covariance(residual: &DVector<f64>, jacobian: &[DVector<f64>; 4]) -> Option<Matrix4<f64>> {
    let inverse = product(jacobian).try_inverse()?;
    // Scores of the least squares. Their covariance over blocks needs no model of the residuals' correlation.
    let count = residual.len();
    let block = (count / BLOCKS).max(1);
    let mut spread = Matrix4::zeros();
    for from in (0..count).step_by(block) {
        let until = (from + block).min(count);
        let score = Vector4::from_fn(|i, _| (from..until).map(|n| jacobian[i][n] * residual[n]).sum::<f64>());
        spread += score * score.transpose();
    }
    let blocks = count.div_ceil(block) as f64;
    Some(inverse * spread * inverse * (blocks / (blocks - 4.0).max(1.0)))
}

/// Blocks over which the residuals' correlation is summed: enough for a variance, each far longer than the correlation.
const BLOCKS: usize = 40;
