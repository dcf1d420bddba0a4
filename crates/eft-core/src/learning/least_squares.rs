//! A gain and a delay by least squares with forgetting, with bounds and limited rates of the estimates.

use crate::integrity::integrity;
use crate::number::Real;

/// Variance of what is only known to lie within ±1, by a rectangular distribution.
pub(super) const BOUNDED: f64 = 1.0 / 3.0;

/// How much a window counts for in a sum with forgetting. The alignment keeps it in memory: in two registers of a
/// Cortex-M4F it costs an update 24 instructions.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(8))]
pub(crate) struct Weight<T> {
    /// Time (s) of the window; 0 if it does not count.
    pub(crate) time: T,
    /// Share (1) of the older sum that remains.
    pub(crate) forgetting: T,
}

/// Sums over the accepted windows: instruments × regressors, and instruments × measured signal.
///
/// Instruments without the noise of the regressors avoid a bias of the estimate. Regressors without noise are their own
/// instruments.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct LeastSquares<T> {
    pub(crate) matrix: [[T; 2]; 2],
    pub(super) right: [T; 2],
}
integrity!(LeastSquares<T>: matrix, right);

impl<T: Real> LeastSquares<T> {
    /// Adds one window's instruments, regressors and measured signal.
    pub(crate) fn add(&mut self, [z, w]: [T; 2], [x, y]: [T; 2], signal: T, weight: Weight<T>) {
        let Weight { time, forgetting } = weight;
        let (zero, z, w) = (T::splat(0.0), time * z, time * w);
        let [[a, b], [c, d]] = self.matrix;
        let (a, d) = (forgetting * a + z * x, forgetting * d + w * y);
        // Instrument and regressor have the same sign, except with a sensor of wrong sign.
        let (a, d) = (if a > zero { a } else { zero }, if d > zero { d } else { zero });
        self.matrix = [[a, forgetting * b + z * y], [forgetting * c + w * x, d]];
        let [on_first, on_second] = self.right;
        self.right = [forgetting * on_first + z * signal, forgetting * on_second + w * signal];
    }

    /// The inverse with the priors; `None` if nothing is known.
    fn inverse(&self, [first, second]: [T; 2]) -> Option<[[T; 2]; 2]> {
        let [[a, b], [c, d]] = self.matrix;
        let (a, d) = (a + first, d + second);
        let determinant = a * d - b * c;
        let per = T::splat(1.0) / determinant;
        // With the priors the determinant is positive, except for rounding.
        (determinant > T::splat(0.0)).then(|| [[d * per, -b * per], [-c * per, a * per]])
    }
}

/// The range and the rate of an estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range<T> {
    pub(crate) bounds: [T; 2],
    /// Largest change in a step.
    pub(crate) change: T,
}
integrity!(Range<T>: bounds, change);

/// An estimate in use.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Estimate<T> {
    pub(crate) value: T,
    /// Distance of the last result beyond the bounds.
    pub(crate) beyond: T,
    /// Distance of the last result from the value.
    pub(crate) away: T,
}
integrity!(Estimate<T>: value, beyond, away);

impl<T: Real> Estimate<T> {
    pub(super) fn at(value: T) -> Self {
        Self { value, beyond: T::splat(0.0), away: T::splat(0.0) }
    }

    /// Moves towards a result, within the bounds, at a limited rate.
    fn approach(&mut self, range: &Range<T>, result: T) {
        let [least, most] = range.bounds;
        let target = result.limit(least, most);
        self.value = target.limit(self.value - range.change, self.value + range.change);
        (self.beyond, self.away) = ((result - target).abs(), result - self.value);
    }
}

/// Constants of the estimate of a gain and a delay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Priors<T> {
    /// Period of the estimator (s), and its reciprocal.
    pub(crate) period: T,
    pub(crate) per_period: T,
    /// Configured delay (s).
    pub(crate) nominal_delay: T,
    /// Weights of the priors: a gain of 1, and the configured delay (per square of the period).
    pub(crate) weights: [T; 2],
    /// Their variances, by rectangular distributions over the ranges: of the gain (1), and of the delay (per square of the
    /// period).
    pub(crate) spread: [T; 2],
    /// Range of the gain (1).
    pub(crate) gain: Range<T>,
    /// Range of the delay (s).
    pub(crate) delay: Range<T>,
}
integrity!(Priors<T>: period, per_period, nominal_delay, weights, spread, gain, delay);

/// The estimate of a gain (1) and a delay (s).
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct GainAndDelay<T> {
    pub(crate) gain: Estimate<T>,
    pub(crate) delay: Estimate<T>,
}
integrity!(GainAndDelay<T>: gain, delay);

impl<T: Real> Priors<T> {
    /// The configured values.
    pub(crate) fn at_rest(&self) -> GainAndDelay<T> {
        GainAndDelay { gain: Estimate::at(T::splat(1.0)), delay: Estimate::at(self.nominal_delay) }
    }

    /// Moves towards the gain and the delay that explain the sums.
    pub(crate) fn solve(&self, state: &mut GainAndDelay<T>, sums: &LeastSquares<T>) {
        let Some([[a, b], [c, d]]) = sums.inverse(self.weights) else { return };
        let [on_gain, on_delay] = sums.right;
        state.gain.approach(&self.gain, T::splat(1.0) + (a * on_gain + b * on_delay));
        let further = c * on_gain + d * on_delay;
        state.delay.approach(&self.delay, self.nominal_delay + self.period * further);
    }

    /// Variances of gain (1) and delay (s²): by errors with this variance times their correlation time, and by the share of
    /// the priors in the result. `squares` are those of the instruments.
    pub(crate) fn variances(&self, sums: &LeastSquares<T>, squares: &[[T; 2]; 2], errors: T) -> [T; 2] {
        let [[zz, zw], [_, ww]] = *squares;
        let ([first, second], [on_gain, on_delay]) = (self.weights, self.spread);
        let [gain, delay] = sums.inverse(self.weights).map_or(self.spread, |rows| {
            rows.map(|[a, b]| {
                // Rounding may change the sign of a small sum.
                let scatter = (a * a * zz + T::splat(2.0) * a * b * zw + b * b * ww).abs();
                let (a, b) = (a * first, b * second);
                errors * scatter + (a * a * on_gain + b * b * on_delay)
            })
        });
        [gain, delay * (self.period * self.period)]
    }
}
