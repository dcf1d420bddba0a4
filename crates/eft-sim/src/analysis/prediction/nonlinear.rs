//! The effect of a lap and a null that the controller does not know, of friction, and of a flow curve that the scheme
//! does not compensate for. Lap and curve change the loop's gain to the one that is nearest to their flow at the openings of the
//! test. The rest of their flow, null and friction disturb this loop to first order.
//!
//! Lap and friction follow the sign of a signal of the linear loop. An unknown overlap `Δ` takes the opening `Δ` from an open
//! valve. Friction takes its force from a moving piston. The compensation is assumed to supply the flow of the motion.

use crate::Result;
use crate::analysis::linear::{Complex, DMatrix, Disturbance, StateSpace, valve_response};
use crate::analysis::prediction::curve::Curve;
use crate::analysis::prediction::signals::{Signals, Spectrum, Transform, responses};
use crate::config::{Mode, Realization, RigConfig};

/// Power beside that of an error that raises the error by a tenth (1).
pub(super) const NOTICED: f64 = 0.21;
/// Highest frequency (Hz) of the effects.
const HIGHEST: f64 = 100.0;
/// Lap over root-mean-square opening beyond which the predicted force error is uncertain by more than a tenth.
const LARGE: f64 = 0.02;
/// Force error over the ratio of a known underlap to the root-mean-square opening: valve and lead network follow the kinks
/// of the opening too slowly.
const KINKS: f64 = 2.0;
/// Steps of the learned curve from no flow to the table's largest.
const STEPS: f64 = 7.0;
/// Least gain (1) of a lap, whose dead zone may be larger than the whole motion.
const LEAST: f64 = 0.05;

/// The lap and the null that are not known, and the friction. A known friction improves the learning, but hardly the force, because the
/// loop must still compress the oil at each reversal.
#[derive(Debug, Clone)]
pub(super) struct Unknown {
    /// True overlap less the one for which the controller compensates (1).
    overlap: f64,
    /// Opening (1) by which the controller misses the null at rest. An integral part finds it during the test.
    pub(super) null: f64,
    /// The known underlap (1).
    underlap: f64,
    /// Friction (N), and the velocity (m/s) beyond which it is complete.
    friction: f64,
    friction_velocity: f64,
    /// The valve, unless the scheme compensates for it.
    curve: Option<Curve>,
    /// Opening (1) of the first node of a learned flow curve, which is straight up to there.
    node: Option<f64>,
}

impl Unknown {
    pub(super) fn of(rig: &RigConfig, sample_rate: f64) -> Result<Self> {
        let plant = rig.plant();
        let valve = &plant.servovalve;
        let learns = rig.compensation.adaptive && rig.compensation.mode != Mode::Off;
        let table = rig.servovalve.flow_table.table()?;
        Ok(Self {
            // The slopes about rest are those of the loop with the known lap.
            curve: Curve::of(&rig.with_known_lap(sample_rate)?)?,
            overlap: valve.overlap - rig.compensated_lap(),
            null: rig.opening_at_rest(0) - valve.null_bias,
            underlap: (-rig.compensated_lap()).max(0.0),
            friction: plant.actuator.friction,
            friction_velocity: plant.actuator.friction_velocity,
            node: (learns && rig.compensation.corrects_curve())
                .then(|| table.opening(table.flow(1.0) / STEPS)),
        })
    }

    /// Whether the gain of the valve contains its curve.
    pub(super) fn has_curve(&self) -> bool {
        self.curve.is_some()
    }

    /// The underlap (1) that is not known.
    pub(super) fn underlap(&self) -> f64 {
        (-self.overlap).max(0.0)
    }

    pub(super) fn any(&self) -> bool {
        self.overlap != 0.0 || self.null != 0.0 || self.friction != 0.0 || self.curve.is_some()
    }

    /// Whether the lap is too large beside the root-mean-square opening (1): an unknown one for a sure error, a known one
    /// for no effect beside a force error (1).
    pub(super) fn is_large(&self, opening: f64, error: f64) -> bool {
        let kinks = KINKS * self.underlap / opening;
        self.overlap.abs() > LARGE * opening || kinks * kinks > NOTICED * error * error
    }

    /// Gain (1) of the valve's flow that is nearest to its true one at these openings, over that about rest.
    pub(super) fn gain(&self, signals: &[Signals], transform: &Transform) -> Result<f64> {
        if self.overlap == 0.0 && self.curve.is_none() {
            return Ok(1.0);
        }
        let (mut beyond, mut squares) = (0.0, 0.0);
        for own in signals {
            for [x, more] in self.beyond_linear(own, transform)? {
                beyond += x * more;
                squares += x * x;
            }
        }
        Ok(if squares > 0.0 { (1.0 + beyond / squares).max(LEAST) } else { 1.0 })
    }

    /// The openings (1) of an actuator, and those which would pass about rest what each passes more.
    fn beyond_linear(&self, own: &Signals, transform: &Transform) -> Result<impl Iterator<Item = [f64; 2]>> {
        let opening = transform.signal(own.opening.clone())?;
        let forces = self.curve.as_ref().map(|_| transform.signal(own.command.clone())).transpose()?;
        // Without a curve no force is used.
        let forces = forces.into_iter().flatten().chain(std::iter::repeat(0.0));
        let most = self.overlap.abs();
        let lap = move |x: f64| {
            let learned = self.node.map_or(0.0, |node| self.overlap * (x / node).clamp(-1.0, 1.0));
            self.overlap.signum() * x.clamp(-most, most) - learned
        };
        let curve = move |x, force| self.curve.as_ref().map_or(0.0, |curve| curve.beyond_linear(x, force));
        Ok(opening.zip(forces).map(move |(x, force)| [x, curve(x, force) - lap(x)]))
    }

    /// Adds the effects on force and motion to the signals of a rig with this model and this gain (1) of
    /// the valve's flow.
    pub(super) fn disturb(
        &self,
        rig: &RigConfig,
        model: &StateSpace,
        gain: f64,
        transform: &Transform,
        signals: &mut [Signals],
    ) -> Result<()> {
        let (wide, count) = (transform.up_to(HIGHEST), signals.len());
        let lost =
            signals.iter().map(|own| self.lost(own, gain, transform, &wide)).collect::<Result<Vec<_>>>()?;
        let of_valve = (0..count).map(|i| Disturbance::Converter.input(i, count));
        let of_cell = (0..count).map(|i| Disturbance::Force.input(i, count));
        let inputs: Vec<usize> = of_valve.chain(of_cell).collect();
        let responses = responses(model, &["force", "displacement"], &inputs);
        let null = wide.spectrum(std::iter::repeat_n(self.null, wide.samples))?;
        for (bin, null) in null.into_iter().enumerate() {
            let all = wide.responses(&responses, bin)?;
            let per_volt = volts_per_opening(rig, wide.frequency(bin));
            let opening = DMatrix::from_fn(count, 1, |i, _| lost[i].opening[bin] * per_volt);
            let friction = DMatrix::from_fn(count, 1, |i, _| lost[i].force[bin]);
            let (by_valve, by_cell) = (all.columns(0, count), all.columns(count, count));
            let by_lap = by_valve * opening;
            let by_null = by_valve * DMatrix::from_element(count, 1, null * per_volt);
            // The loop opposes a change of the force as a change of its reading.
            let force = &friction + by_cell.rows(0, count) * &friction;
            for (i, own) in signals.iter_mut().enumerate() {
                own.missed_force.resize(wide.last + 1, Complex::ZERO);
                own.missed_motion.resize(wide.last + 1, Complex::ZERO);
                own.missed_force[bin] += by_lap[i] + by_null[i] + force[i];
                // Friction also damps the motion, so a first order is much too large there.
                own.missed_motion[bin] += by_lap[count + i] + by_null[count + i];
                own.by_null[0].push(by_null[i]);
                own.by_null[1].push(by_null[count + i]);
            }
        }
        Ok(())
    }

    /// Opening and force that an actuator loses, where the valve's flow has this gain (1).
    fn lost(&self, own: &Signals, gain: f64, transform: &Transform, wide: &Transform) -> Result<Lost> {
        let beyond = self.beyond_linear(own, transform)?;
        let lost: Vec<f64> = beyond.map(|[x, more]| (x + more) / gain - x).collect();
        let rub = |v: f64| -self.friction * v / v.hypot(self.friction_velocity);
        Ok(Lost {
            opening: wide.spectrum(lost)?,
            force: wide.spectrum(transform.signal(own.velocity.clone())?.map(rub))?,
        })
    }
}

/// Spectra of an opening (1) and a force (N).
struct Lost {
    opening: Spectrum,
    force: Spectrum,
}

/// Valve command (V) for an opening of the spool at a frequency (Hz), as the loop's converter adds it.
fn volts_per_opening(rig: &RigConfig, frequency: f64) -> Complex<f64> {
    let amplified = match rig.controller.realization {
        Realization::Analog => rig.controller.proportional_gain,
        Realization::Digital => 1.0,
    };
    (valve_response(rig, frequency) * amplified).inv()
}
