//! The signals of a test until self-calibration or guard have changed the loop. It changes from block to block.

use nalgebra::DVector;

use crate::analysis::Adaptation;
use crate::analysis::linear::{DMatrix, FlowGain, StateSpace, Time, linearize};
use crate::analysis::prediction::guard::Guard;
use crate::analysis::prediction::signals::{Signals, Transform, responses, rows};
use crate::ground_motion::excitation::Command;
use crate::{Result, RigConfig};

/// Time (s) in which the loop stays the same.
const BLOCK: f64 = 0.05;
/// Difference (1) of the level from the last one that ends the transition.
const REACHED: f64 = 1e-2;
/// Opening (1) far beyond the stops, at which a growing loop counts as the last one. Its errors are large already.
const GROWN: f64 = 10.0;

/// Adds to the signals of the last loop, with its rig and its model, the difference by the loops before it.
pub(super) fn add(
    adaptation: &Adaptation,
    (rig, model): (&RigConfig, &StateSpace),
    commands: &[Command],
    transform: &Transform,
    signals: &mut [Signals],
) -> Result<()> {
    let (rate, count) = (transform.sample_rate, commands.len());
    let (last, level) = (Linear::of(model, count), rig.compensation.level);
    let mut guard = Guard::at_rest(count);
    let (mut state, mut last_state) = (DVector::zeros(model.a.nrows()), DVector::zeros(model.a.nrows()));
    let mut differences = vec![Vec::new(); 2 * count];
    let (mut time, mut sample) = (0.0, 0);
    'blocks: while sample < transform.samples {
        let now = adaptation.after(time).varied(|values| values.compensation.level *= guard.level);
        let left = now.compensation.level / level;
        if time >= adaptation.duration() && (left - 1.0).abs() <= REACHED {
            break;
        }
        let now = linearize(&now, FlowGain::Mean, Time::Sampled(rate))?;
        let now = Linear::of(&now, count);
        let mut opening = 0.0_f64;
        for _ in 0..((BLOCK * rate) as usize).clamp(1, transform.samples - sample) {
            let command = DVector::from_fn(count, |i, _| commands[i].values[sample]);
            let (own, of_last) = (now.outputs(&state, &command), last.outputs(&last_state, &command));
            for (i, signal) in differences.iter_mut().enumerate() {
                signal.push(own[i] - of_last[i]);
            }
            opening = opening.max(own.rows(2 * count, count).amax());
            guard.observe(own.rows(3 * count, count).iter(), adaptation.small_gain * left - 1.0, 1.0 / rate);
            (state, last_state) = (now.next(&state, &command), last.next(&last_state, &command));
            sample += 1;
            if opening > GROWN {
                break 'blocks;
            }
        }
        guard.act(BLOCK);
        if opening > rig.compensation.learning.excitation {
            time += BLOCK;
        }
    }
    // The difference of the states decays in the last loop.
    let ringing = responses(&last.alone(&(state - last_state)), &["force", "displacement"], &[0]);
    let differences =
        differences.into_iter().map(|signal| transform.spectrum(signal)).collect::<Result<Vec<_>>>()?;
    let ringing = (0..=transform.last).map(|bin| {
        let turned = transform.turn(bin).powi(1 - sample as i32);
        Ok(transform.responses(&ringing, bin)? * turned)
    });
    let ringing = ringing.collect::<Result<Vec<_>>>()?;
    for (i, own) in signals.iter_mut().enumerate() {
        for (row, missed) in [(i, &mut own.missed_force), (count + i, &mut own.missed_motion)] {
            for ((missed, difference), ringing) in missed.iter_mut().zip(&differences[row]).zip(&ringing) {
                *missed += difference + ringing[row];
            }
        }
    }
    Ok(())
}

/// A sampled loop from the commands to force, displacement, opening and velocity of each actuator.
struct Linear<'a> {
    model: &'a StateSpace,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
}

impl<'a> Linear<'a> {
    fn of(model: &'a StateSpace, commands: usize) -> Self {
        let rows = rows(model, &["force", "displacement", "spool", "velocity"]);
        let [b, d] = [&model.b, &model.d].map(|matrix| matrix.columns(0, commands));
        Self { model, b: b.into_owned(), c: model.c.select_rows(&rows), d: d.select_rows(&rows) }
    }

    fn outputs(&self, state: &DVector<f64>, command: &DVector<f64>) -> DVector<f64> {
        &self.c * state + &self.d * command
    }

    fn next(&self, state: &DVector<f64>, command: &DVector<f64>) -> DVector<f64> {
        &self.model.a * state + &self.b * command
    }

    /// The loop with an impulse to this state as its only input.
    fn alone(&self, state: &DVector<f64>) -> StateSpace {
        StateSpace {
            b: DMatrix::from_column_slice(state.len(), 1, state.as_slice()),
            d: DMatrix::zeros(self.model.outputs.len(), 1),
            ..self.model.clone()
        }
    }
}
