//! A saved calibration: the estimates as plain data, and a learner that starts from them.
//!
//! The data have SI units, and are independent of sample rate and precision. A learner that starts from them has the same
//! estimates and standard deviations. New windows replace this evidence like any other.

use crate::compensation::{Deviations, FIRST_NODE, NODES, PIECES};
use crate::error::{ConfigError, LARGEST, positive, within};
use crate::learning::checkpoint::Checkpoints;
use crate::learning::curve_nodes::DEPARTURE;
use crate::learning::deviation::{Deviation, attenuation, gain_change};
use crate::learning::flow_curve::{FlowCurve, LARGEST_ASYMMETRY, LARGEST_NULL, NULL_DEVIATION};
use crate::learning::learner::{Learner, LearnerState};
use crate::learning::least_squares::{Estimate, GainAndDelay, LeastSquares, Priors};
use crate::number::Real;

/// A calibration to keep over a restart, made by [`Learner::saved`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct SavedCalibration {
    /// [`SavedCalibration::VERSION`] of the library that saved it (1).
    pub version: u32,
    /// Greatest flow (m³/s) of the flow table, to which flow gain and curve refer.
    pub greatest_flow: f64,
    /// True flow over the table's, `θ` (1).
    pub flow_gain: f64,
    /// The spool's gain over the configured one (1).
    pub valve_gain: f64,
    /// Delay (s) of the measured spool after its command.
    pub response_delay: f64,
    /// Delay (s) of the measured velocity after the measured spool.
    pub velocity_delay: f64,
    /// Commanded opening (1) at which the valve passes nothing at no load.
    pub null_offset: f64,
    /// Standard deviations of these five; infinite where nothing was learned.
    pub deviations: Deviations<f64>,
    /// Evidence (s) of the estimates: the integral of the squared opening over the remembered time. If it is 0, nothing
    /// was learned.
    pub excitation: f64,
    /// The correction of the flow table.
    pub curve: SavedCurve,
}

/// The correction of the flow table by direction and band of flow.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct SavedCurve {
    /// Table flow per flow of the forward direction over the mean of both directions, minus 1 (1). It is negative if
    /// the valve passes more forwards than the table.
    pub asymmetry: f64,
    /// Its standard deviation (1).
    pub asymmetry_deviation: f64,
    /// Table flow (m³/s) minus that by the direction's gain, at 17 no-load flows from -8/7 to 8/7 of the greatest one.
    /// The first, the middle and the last are 0.
    pub departures: [f64; NODES],
    /// Their standard deviations (m³/s).
    pub departure_deviations: [f64; NODES],
    /// Root mean square (m³/s) of the residual of a window's flow after the correction.
    pub error: f64,
    /// Share of the flow gain (1) that follows from the departures. The table without the correction would have the flow
    /// gain over 1 plus this share. The standard deviation of the flow gain contains it.
    pub flow_gain_share: f64,
}

impl SavedCalibration {
    /// Version of these data (1); any other is refused.
    pub const VERSION: u32 = 3;
}

/// Share of a range by which rounding may put a value beyond it.
const ROUNDING: f64 = 1.0e-6;

/// Largest share of a variance that may come from the models' systematic errors. The rest is noise.
const LARGEST_SYSTEMATIC: f64 = 0.98;

/// Number of iterations after which a frequency no longer changes.
const ITERATIONS: u32 = 60;

/// Time (s) for which the saved mean errors count.
const ERROR_TIME: f64 = 1.0;

impl<T: Real, const N: usize> Learner<T, N> {
    /// The calibration, for [`start_from`](Self::start_from) later.
    ///
    /// # Cost
    /// Call it after a test, not in a tick.
    pub fn saved(&self, state: &LearnerState<T>) -> SavedCalibration {
        let of = T::to_f64;
        let (flow, valve) = (&state.flow, &state.valve.found);
        let found = &state.deviations;
        let step = of(self.curve.grid.step);
        let curve = &state.evidence.curve;
        SavedCalibration {
            version: SavedCalibration::VERSION,
            greatest_flow: self.greatest_flow(),
            flow_gain: of(flow.gain.value),
            valve_gain: of(valve.gain.value),
            response_delay: of(valve.delay.value),
            velocity_delay: of(flow.delay.value),
            null_offset: of(curve.null) + self.known_null(),
            deviations: Deviations {
                flow_gain: of(found.flow_gain),
                valve_gain: of(found.valve_gain),
                response_delay: of(found.response_delay),
                velocity_delay: of(found.velocity_delay),
                null_offset: if self.corrects { of(found.null_offset) } else { NULL_DEVIATION },
            },
            excitation: of(state.evidence.amount),
            curve: SavedCurve {
                asymmetry: of(curve.asymmetry),
                asymmetry_deviation: of(self.curve.asymmetry_deviation(curve)),
                departures: curve.departures.map(|departure| of(departure) * step),
                departure_deviations: self
                    .curve
                    .departure_variances(&state.curve.nodes.variances, &curve.departures)
                    .map(|variance| of(variance.sqrt()) * step),
                error: of(self.curve.mean_square(curve).sqrt()) * step,
                flow_gain_share: of(FlowCurve::share(curve)),
            },
        }
    }

    /// A learner at rest with the saved estimates. A channel that begins
    /// [with its first calibration](crate::Channel::at_rest_with) uses them from the first tick. Otherwise they take
    /// effect at the first tick of the third window. A learner that does not adapt, and data without evidence, give
    /// [`at_rest`](Self::at_rest).
    ///
    /// # Errors
    /// Another version; a flow table with another greatest flow; an estimate beyond the learner's bounds; a standard
    /// deviation that is not positive; a departure of more than a fifth of its flow. Each by name.
    pub fn start_from(&self, saved: &SavedCalibration) -> Result<LearnerState<T>, ConfigError> {
        let mut state = self.at_rest();
        self.check(saved)?;
        if !self.adapts || saved.excitation <= 0.0 {
            return Ok(state);
        }
        let (of, zero, one) = (T::from_f64, T::splat(0.0), T::splat(1.0));
        let (d, excitation) = (&saved.deviations, of(saved.excitation));
        let (flow, valve) = (&self.flow.priors, &self.valve.priors);
        state.flow = flow.at(of(saved.flow_gain), of(saved.velocity_delay));
        state.valve.found = valve.at(of(saved.valve_gain), of(saved.response_delay));

        // Squares of the regressors and of the errors. Together with the systematic errors they give these deviations.
        let known = |priors: &Priors<T>, squares: T, variance: T| {
            let [prior, _] = priors.weights;
            (if variance > zero { variance } else { zero }).sqrt() * (squares + prior) / excitation.sqrt()
        };
        let [flow_gain_variance, valve_gain_variance, response_variance, velocity_variance] =
            [d.flow_gain, d.valve_gain, d.response_delay, d.velocity_delay].map(|deviation| {
                let deviation = of(deviation);
                deviation * deviation
            });
        // The departures' part of the flow gain is no noise.
        let most = (T::splat(LARGEST_SYSTEMATIC) * flow_gain_variance).sqrt() / state.flow.gain.value;
        let share = if self.corrects { of(saved.curve.flow_gain_share).limit(-most, most) } else { zero };
        let share_error = share * state.flow.gain.value;
        let flow_gain_variance = flow_gain_variance - share_error * share_error;
        let systematic = |share_square, square| {
            self.deviation.systematic(share_square, square, &state.flow, &state.valve.found, valve.period)
        };
        let square = frequency([valve_gain_variance, response_variance], |square| {
            systematic(zero, square).response_delay
        });
        // The systematic part of the flow's deviations. The rest of both must follow from the same noise.
        let unit = systematic(one, square);
        let most = T::splat(LARGEST_SYSTEMATIC)
            * least(velocity_variance / unit.velocity_delay, flow_gain_variance / unit.flow_gain);
        let found = (square * velocity_variance - flow_gain_variance)
            / (square * unit.velocity_delay - unit.flow_gain);
        // These flows are parts of the flow. Without a delay they are no error, so nothing else bounds their share.
        let share_square = if found > zero { least(least(found, most), one) } else { zero };
        let systematic = systematic(share_square, square);

        let per_flow = self.deviation.per_square_flow.sqrt();
        let flows = excitation / per_flow;
        let changes = square * excitation * valve.period * valve.period;
        let spool_error = known(valve, excitation, valve_gain_variance);
        let flow_error = known(flow, flows, flow_gain_variance - systematic.flow_gain);
        let rest = (velocity_variance - systematic.velocity_delay).sqrt();
        let late = flow_error * changes.sqrt() * flow.period / rest;
        let evidence = &mut state.evidence;
        evidence.compressed = share_square * excitation / self.deviation.per_square_flow;
        evidence.valve = LeastSquares::of(valve, [excitation, changes], &state.valve.found);
        evidence.flow = LeastSquares::of(flow, [flows, late], &state.flow);
        (evidence.amount, evidence.newer_openings) = (excitation, excitation);
        evidence.time = of(ERROR_TIME);
        // The prior reduces the frequency at which the deviations are made.
        let stated = self.valve.mean_square_frequency(&evidence.valve);
        let gain_increase = self.valve.gain_increase(&state.valve.found, stated);
        let attenuation = attenuation(stated);
        let per_square = evidence.time * (attenuation * attenuation) / self.deviation.correlation;
        evidence.flow_errors = per_square * flow_error * flow_error;
        evidence.spool_errors = per_square * spool_error * spool_error;

        if self.corrects {
            let curve = &saved.curve;
            let per_step = 1.0 / self.curve.grid.step.to_f64();
            let inner = |n: usize| n > 0 && n < PIECES;
            let steps = |of_node: &[f64; NODES]| {
                core::array::from_fn(|n| match of_node.get(n) {
                    Some(value) if inner(n) => of(value * per_step),
                    _ => zero,
                })
            };
            evidence.curve.departures = steps(&curve.departures);
            let stated = steps(&curve.departure_deviations).map(|deviation: T| deviation * deviation);
            let most = T::splat(LARGEST_SYSTEMATIC);
            state.curve.nodes.variances =
                self.curve.filter_variances(&stated, &evidence.curve.departures, most);
            let error = of(curve.error * per_step);
            let asymmetry = [of(curve.asymmetry), of(curve.asymmetry_deviation)];
            let null_variance = of(d.null_offset * d.null_offset);
            let rest = null_variance - Deviation::mean_variance(evidence);
            let least = T::splat(1.0 - LARGEST_SYSTEMATIC) * null_variance;
            let rest = if rest > least { rest } else { least };
            let null = [
                of(saved.null_offset - self.known_null()),
                rest,
                gain_change(of(d.valve_gain), gain_increase, &state.valve.found).sqrt(),
            ];
            let known = (&mut state.curve, &mut evidence.curve);
            let gains = [state.flow.gain.value, self.flow_gain];
            self.curve.set_known(known, error * error, asymmetry, null, gains);
            self.curve.set_share(&mut evidence.curve, share, excitation * flow.per_period, self.flow_gain);
            let step = self.curve.grid.step;
            // The map increases after every step of the construction.
            for _ in 0..NODES * NODES {
                state.curve.nodes.refresh_next(&evidence.curve.departures, evidence.curve.asymmetry, step);
            }
        }
        state.checkpoints = Checkpoints::of(evidence);
        state.deviations = self.deviations(&state, stated, gain_increase);
        Ok(state)
    }

    /// The known null bias (1).
    fn known_null(&self) -> f64 {
        self.curve.known_null.to_f64()
    }

    fn greatest_flow(&self) -> f64 {
        self.curve.grid.step.to_f64() * (PIECES / 2 - 1) as f64
    }

    /// Refuses data that this learner cannot have saved.
    fn check(&self, saved: &SavedCalibration) -> Result<(), ConfigError> {
        let near = |parameter, value: f64, lowest: f64, highest: f64| {
            let slack = ROUNDING * (lowest.abs() + highest.abs());
            within(parameter, value, lowest - slack, highest + slack)
        };
        let version = f64::from(SavedCalibration::VERSION);
        within("calibration.version", f64::from(saved.version), version, version)?;
        let greatest = self.greatest_flow();
        near("calibration.greatest_flow", saved.greatest_flow, greatest, greatest)?;
        within("calibration.excitation", saved.excitation, 0.0, LARGEST)?;
        if saved.excitation <= 0.0 {
            return Ok(());
        }
        let (flow, valve) = (&self.flow.priors, &self.valve.priors);
        let estimates = [
            ("calibration.flow_gain", saved.flow_gain, flow.gain.bounds),
            ("calibration.valve_gain", saved.valve_gain, valve.gain.bounds),
            ("calibration.response_delay", saved.response_delay, valve.delay.bounds),
            ("calibration.velocity_delay", saved.velocity_delay, flow.delay.bounds),
        ];
        for (name, value, [lowest, highest]) in estimates {
            near(name, value, lowest.to_f64(), highest.to_f64())?;
        }
        let known = self.known_null();
        near("calibration.null_offset", saved.null_offset, known - LARGEST_NULL, known + LARGEST_NULL)?;
        let Deviations { flow_gain, valve_gain, response_delay, velocity_delay, null_offset } =
            saved.deviations;
        for deviation in [flow_gain, valve_gain, response_delay, velocity_delay, null_offset] {
            positive("calibration.deviations", deviation)?;
        }
        let curve = &saved.curve;
        near("calibration.asymmetry", curve.asymmetry, -LARGEST_ASYMMETRY, LARGEST_ASYMMETRY)?;
        positive("calibration.asymmetry_deviation", curve.asymmetry_deviation)?;
        positive("calibration.curve_error", curve.error)?;
        near("calibration.flow_gain_share", curve.flow_gain_share, -DEPARTURE, DEPARTURE)?;
        let nodes = curve.departures.iter().zip(&curve.departure_deviations);
        for (n, (departure, deviation)) in nodes.enumerate() {
            let reach = DEPARTURE * (n as f64 + FIRST_NODE).abs() * greatest / (PIECES / 2 - 1) as f64;
            near("calibration.departures", *departure, -reach, reach)?;
            near("calibration.departure_deviations", *deviation, 0.0, reach)?;
        }
        Ok(())
    }
}

fn least<T: Real>(one: T, other: T) -> T {
    if one < other { one } else { other }
}

/// Mean-square frequency (1/s²) of the motion from which the variances of a gain (1) and of a delay (s²) were learned.
/// At this frequency both variances, without the delay's systematic part, follow from the same noise. If this part is more than a
/// third, a lower frequency explains them as well, and is the result.
fn frequency<T: Real>([gain, delay]: [T; 2], systematic: impl Fn(T) -> T) -> T {
    let (most, mut square) = (T::splat(1.0 / 3.0) * delay, gain / delay);
    for _ in 0..ITERATIONS {
        square = gain / (delay - least(systematic(square), most));
    }
    square
}

impl<T: Real> Priors<T> {
    /// A gain (1) and a delay (s), within their bounds.
    fn at(&self, gain: T, delay: T) -> GainAndDelay<T> {
        let ([lowest, highest], [shortest, longest]) = (self.gain.bounds, self.delay.bounds);
        GainAndDelay {
            gain: Estimate::at(gain.limit(lowest, highest)),
            delay: Estimate::at(delay.limit(shortest, longest)),
        }
    }
}

impl<T: Real> LeastSquares<T> {
    /// Sums that give this gain and this delay, from the squares of their regressors.
    fn of(priors: &Priors<T>, squares: [T; 2], found: &GainAndDelay<T>) -> Self {
        let ([a, d], [gain_prior, delay_prior]) = (squares, priors.weights);
        let zero = T::splat(0.0);
        let late = (found.delay.value - priors.nominal_delay) * priors.per_period;
        Self {
            matrix: [[a, zero], [zero, d]],
            right: [(a + gain_prior) * (found.gain.value - T::splat(1.0)), (d + delay_prior) * late],
        }
    }
}
