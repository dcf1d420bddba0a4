//! The effect of a lap and a null that the controller does not know, of friction, and of a flow curve that the scheme
//! does not compensate for, to first order.
//!
//! Lap and friction follow the sign of a signal of the linear loop. An unknown overlap `Δ` takes the opening `Δ` from an open
//! valve. Friction takes its force from a moving piston. The compensation is assumed to supply the flow of the motion.

use crate::analysis::linear::{Complex, DMatrix, Disturbance, StateSpace, valve_response};
use crate::analysis::prediction::curve::Curve;
use crate::analysis::prediction::signals::{Faded, Signals, Spectrum, outputs};
use crate::config::{Mode, Realization, RigConfig};
use crate::error::Result;

/// Power beside that of an error that raises the error by a tenth (1).
pub(super) const NOTICED: f64 = 0.21;
/// Highest frequency (Hz) of the effects.
const HIGHEST: f64 = 100.0;
/// Lap over root-mean-square opening beyond which the predicted force error is more than a tenth too small.
const LARGE: f64 = 0.02;
/// Force error over the ratio of a known underlap to the root-mean-square opening: valve and lead network follow the kinks
/// of the opening too slowly.
const KINKS: f64 = 2.0;
/// Opening of the learned curve's first node over the largest one.
const FIRST_NODE: f64 = 1.0 / 7.0;

/// The lap and the null that are not known, and the friction. A known friction improves the learning, but hardly the force, because the
/// loop must still compress the oil at each reversal.
#[derive(Debug, Clone)]
pub(super) struct Unknown {
    /// True overlap less the known one (1).
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
    /// The configured level over the one to which a guard reduces it (1).
    reduced: Option<f64>,
    learned: Learned,
}

/// What self-calibration compensates for of an unknown lap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Learned {
    Nothing,
    /// The flow gain: the part that is proportional to the opening.
    FlowGain,
    /// The flow curve, which is linear up to its first node.
    Curve,
}

impl Unknown {
    /// Of a rig, and of the same one as its controller has tuned it.
    pub(super) fn of(rig: &RigConfig, judged: &RigConfig) -> Result<Self> {
        let plant = rig.plant();
        let valve = &plant.servovalve;
        let learns = rig.compensation.adaptive && rig.compensation.mode != Mode::Off;
        let (guards, whole) = (rig.compensation.guard && !learns, rig.compensation.level);
        Ok(Self {
            curve: Curve::of(rig)?,
            reduced: (guards && whole > judged.compensation.level).then(|| whole / judged.compensation.level),
            overlap: valve.overlap - rig.servovalve.overlap,
            null: rig.opening_at_rest(0) - valve.null_bias,
            underlap: (-rig.servovalve.overlap).max(0.0),
            friction: plant.actuator.friction,
            friction_velocity: plant.actuator.friction_velocity,
            learned: match (learns, rig.compensation.corrects_curve()) {
                (false, _) => Learned::Nothing,
                (true, false) => Learned::FlowGain,
                (true, true) => Learned::Curve,
            },
        })
    }

    pub(super) fn any(&self) -> bool {
        self.overlap != 0.0 || self.null != 0.0 || self.friction != 0.0 || self.curve.is_some()
    }

    /// Whether the lap is too large beside the root-mean-square opening (1): an unknown one for a first order, a known one
    /// for no effect beside a force error (1).
    pub(super) fn is_large(&self, opening: f64, error: f64) -> bool {
        let kinks = KINKS * self.underlap / opening;
        self.overlap.abs() > LARGE * opening || kinks * kinks > NOTICED * error * error
    }

    /// Adds the effects on force and motion to the signals of a rig with this model.
    pub(super) fn disturb(
        &self,
        rig: &RigConfig,
        model: &StateSpace,
        faded: &Faded,
        signals: &mut [Signals],
    ) -> Result<()> {
        let (wide, count) = (faded.up_to(HIGHEST), signals.len());
        let lost = signals.iter().map(|own| self.lost(own, faded, &wide)).collect::<Result<Vec<_>>>()?;
        let responses = outputs(model, &["force", "displacement"]);
        let null = wide.spectrum(std::iter::repeat_n(self.null, wide.samples))?;
        let input = |of: Disturbance| (0..count).map(|i| of.input(i, count)).collect::<Vec<_>>();
        let (valve, cell) = (input(Disturbance::Converter), input(Disturbance::Force));
        for (bin, null) in null.into_iter().enumerate() {
            let all = wide.responses(&responses, bin)?;
            let per_volt = volts_per_opening(rig, wide.frequency(bin));
            let opening = DMatrix::from_fn(count, 1, |i, _| lost[i].opening[bin] * per_volt);
            let friction = DMatrix::from_fn(count, 1, |i, _| lost[i].force[bin]);
            let by_valve = all.select_columns(&valve);
            let by_lap = &by_valve * opening;
            let by_null = by_valve * DMatrix::from_element(count, 1, null * per_volt);
            // The loop opposes a change of the force as a change of its reading.
            let force = &friction + all.select_columns(&cell).rows(0, count) * &friction;
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

    /// Opening and force that an actuator loses.
    fn lost(&self, own: &Signals, faded: &Faded, wide: &Faded) -> Result<Lost> {
        let opening: Vec<f64> = faded.signal(own.opening.clone())?.collect();
        let (overlap, most) = (self.overlap, self.overlap.abs());
        let lap = |x: f64| overlap.signum() * x.clamp(-most, most);
        let square: f64 = opening.iter().map(|x| x * x).sum();
        let share = opening.iter().map(|x| lap(*x) * x).sum::<f64>() / square;
        let node = FIRST_NODE * opening.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let compensated = |x: f64| match self.learned {
            Learned::Nothing => 0.0,
            Learned::FlowGain => share * x,
            Learned::Curve => overlap * (x / node).clamp(-1.0, 1.0),
        };
        let mut lost: Vec<f64> = opening.iter().map(|x| compensated(*x) - lap(*x)).collect();
        if let Some(curve) = &self.curve {
            let forces = faded.signal(own.command.clone())?;
            let beyond: Vec<f64> =
                opening.iter().zip(forces).map(|(x, f)| curve.beyond_linear(*x, f)).collect();
            let share = opening.iter().zip(&beyond).map(|(x, beyond)| x * beyond).sum::<f64>() / square;
            let learned = match (self.learned, self.reduced) {
                // The guard raises the level again, up to the configured one.
                (Learned::Nothing, Some(reduced)) => share - (reduced * (1.0 + share) - 1.0).min(0.0),
                (Learned::Nothing, None) => 0.0,
                _ => share,
            };
            for ((lost, x), beyond) in lost.iter_mut().zip(&opening).zip(beyond) {
                *lost += beyond - learned * x;
            }
        }
        let rub = |v: f64| -self.friction * v / v.hypot(self.friction_velocity);
        Ok(Lost {
            opening: wide.spectrum(lost)?,
            force: wide.spectrum(faded.signal(own.velocity.clone())?.map(rub))?,
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
