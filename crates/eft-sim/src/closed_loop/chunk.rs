//! Some ticks of a test, of one rig or of several side by side.

use eft_core::{Mask, Scalar};

use crate::closed_loop::controller::Precision;
use crate::closed_loop::digital_side::Path;
use crate::closed_loop::fast::{FastLoop, LoopState};
use crate::closed_loop::method::Method;
use crate::closed_loop::tick::Recorder;
use crate::lanes::Num;
use crate::lanes::{Work, dispatch};

/// Runs up to `ticks` ticks of a test and returns how many began with a bounded state. `commands` may go on beyond
/// them; where it ends with them, the last one is held.
pub(crate) fn run<S: Num, C: Scalar>(
    test: &mut FastLoop<S, C>,
    state: &mut LoopState<S, C>,
    commands: &[S],
    ticks: usize,
    recorder: &mut impl Recorder<S>,
) -> usize
where
    C::Element: Precision,
{
    match (test.method(), test.path()) {
        (Method::RungeKutta, _) => {
            dispatch::<S, _>(Chunk::<S, C, _, false, false, false> { test, state, commands, ticks, recorder })
        }
        (Method::Exponential, Path::Ideal) => {
            dispatch::<S, _>(Chunk::<S, C, _, true, false, true> { test, state, commands, ticks, recorder })
        }
        (Method::Exponential, Path::IdealLearning) => {
            dispatch::<S, _>(Chunk::<S, C, _, true, true, true> { test, state, commands, ticks, recorder })
        }
        (Method::Exponential, Path::General) => {
            dispatch::<S, _>(Chunk::<S, C, _, false, false, true> { test, state, commands, ticks, recorder })
        }
    }
}

struct Chunk<'a, S: Num, C: Scalar, K, const IDEAL: bool, const LEARNS: bool, const EXPONENTIAL: bool>
where
    C::Element: Precision,
{
    test: &'a mut FastLoop<S, C>,
    state: &'a mut LoopState<S, C>,
    commands: &'a [S],
    ticks: usize,
    recorder: &'a mut K,
}

impl<S: Num, C: Scalar, K: Recorder<S>, const IDEAL: bool, const LEARNS: bool, const EXPONENTIAL: bool> Work
    for Chunk<'_, S, C, K, IDEAL, LEARNS, EXPONENTIAL>
where
    C::Element: Precision,
{
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        let mut state = *self.state;
        let mut done = 0;
        while done < self.ticks && FastLoop::<S, C>::is_bounded(&state).all() {
            let command = self.commands[done];
            let next = self.commands.get(done + 1).copied().unwrap_or(command);
            if !EXPONENTIAL {
                let tick = self.test.sample::<IDEAL, LEARNS>(&mut state, command, next);
                self.recorder.record(done, &tick, self.test.estimates());
                self.test.advance_by_runge_kutta(&mut state, &tick.decision.driver);
            } else if S::LANES == 1 {
                // What waits for the controller's root and division stays short, and the rest fills the time.
                let ahead = self.test.look_ahead(&state);
                let tick = self.test.sample::<IDEAL, LEARNS>(&mut state, command, next);
                self.test.advance(&mut state, ahead, &tick.decision.driver);
                self.recorder.record(done, &tick, self.test.estimates());
            } else {
                // Several side by side fill it alone, and then fewer numbers have to be kept at a time.
                let tick = self.test.sample::<IDEAL, LEARNS>(&mut state, command, next);
                self.recorder.record(done, &tick, self.test.estimates());
                let ahead = self.test.look_ahead(&state);
                self.test.advance(&mut state, ahead, &tick.decision.driver);
            }
            done += 1;
        }
        *self.state = state;
        done
    }
}
