//! The sizes of the signals of a test.

use crate::analysis::linear::{AboutRest, Complex};
use crate::analysis::prediction::signals::{Signals, Spectrum, Transform};
use crate::analysis::prediction::underlap::Oscillation;
use crate::ground_motion::excitation::Command;
use crate::metrics::OIL_COLUMN;
use crate::{Error, Result};

/// One predicted error and its parts, rms over rms (1).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PredictedError {
    /// All parts together.
    pub whole: f64,
    /// The part that noise of the sensors and resolution of the converters cause.
    pub noise: f64,
    /// The part of constant causes: biases, and a null that the controller does not know.
    pub constant: f64,
}

/// Errors and sizes, each of the actuator with the largest.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sizes {
    pub(super) force: PredictedError,
    /// Of the force without the part of the command that no actuator follows.
    pub(super) followed: PredictedError,
    pub(super) displacement: PredictedError,
    /// Of the force where the oil column oscillates.
    pub(super) oscillation: PredictedError,
    /// Root mean square of the opening (1).
    pub(super) opening: f64,
    /// Root mean square of the force (N) by an unknown null.
    pub(super) null: f64,
}

impl Sizes {
    /// Of signals with what happens about rest and about null.
    pub(super) fn of(
        signals: Vec<Signals>,
        (at_rest, about_null): (&AboutRest, Option<&Oscillation>),
        commands: &[Command],
        transform: &Transform,
    ) -> Result<Self> {
        let mut sizes = Self::default();
        for (i, own) in signals.into_iter().enumerate() {
            let [null, _] = &own.by_null;
            sizes.null = sizes.null.max(transform.rms(null.clone(), 0.0)?);
            let (swings, rings) = match about_null {
                Some(found) => (found.sizes(i, &own, transform)?, within_oil(found.frequency)),
                None => ([0.0; 2], false),
            };
            let error = |which: usize, missed: Spectrum, wanted: f64| {
                let held = at_rest.constants.iter().map(|(_, all)| all[i][which]).sum();
                let noise = at_rest.deviations[i][which];
                let whole = transform.rms(missed, held)?.hypot(noise).hypot(swings[which]);
                let constant = transform.rms(own.by_null[which].clone(), held)?;
                Ok::<_, Error>([whole, noise, constant].map(|part| part / wanted))
            };
            let (command, ideal) = (transform.rms(own.command, 0.0)?, transform.rms(own.ideal_motion, 0.0)?);
            let (oil, noise) =
                (transform.rms(fast(&own.missed_force, transform), 0.0)?, at_rest.oscillations[i]);
            let oil = oil.hypot(noise).hypot(if rings { swings[0] } else { 0.0 });
            sizes.oscillation.enlarge([oil, noise, 0.0].map(|part| part / command));
            let [whole, noise, constant] = error(0, own.missed_force, command)?;
            sizes.followed.enlarge([whole, noise, constant]);
            sizes.force.enlarge([whole.hypot(transform.unfollowed(&commands[i])?), noise, constant]);
            sizes.displacement.enlarge(error(1, own.missed_motion, ideal)?);
            sizes.opening = sizes.opening.max(transform.rms(own.opening, 0.0)?);
        }
        Ok(sizes)
    }
}

impl PredictedError {
    /// To the larger of each part. An actuator without a command has no error.
    fn enlarge(&mut self, [whole, noise, constant]: [f64; 3]) {
        if whole.is_finite() {
            self.whole = self.whole.max(whole);
            self.noise = self.noise.max(noise);
            self.constant = self.constant.max(constant);
        }
    }
}

/// The part of a force where the oil column oscillates.
fn fast(force: &Spectrum, transform: &Transform) -> Spectrum {
    let mut fast = force.clone();
    let slow = (0..fast.len()).take_while(|bin| transform.frequency(*bin) < OIL_COLUMN.0).count();
    fast[..slow].fill(Complex::ZERO);
    fast
}

/// Whether a frequency (Hz) is one at which the oil column oscillates.
fn within_oil(frequency: f64) -> bool {
    (OIL_COLUMN.0..OIL_COLUMN.1).contains(&frequency)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_actuator_without_a_command_has_no_error() {
        let mut error = PredictedError::default();
        error.enlarge([f64::NAN, 1.0, 2.0]);
        assert_eq!(error, PredictedError::default());
        error.enlarge([0.2, 0.1, 0.0]);
        error.enlarge([0.1, 0.05, 0.1]);
        assert_eq!(error, PredictedError { whole: 0.2, noise: 0.1, constant: 0.1 });
    }
}
