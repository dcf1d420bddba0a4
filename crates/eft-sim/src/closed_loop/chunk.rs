//! The fast path for a number of ticks of a test, for one rig or several side by side.

use std::slice;

use eft_core::{Mask, Scalar};

use crate::closed_loop::digital_side::{DigitalSide, Path};
use crate::closed_loop::{ClosedLoop, FastLoop, Method, Precision, Recorder};
use crate::lanes::{Num, Work};

impl<S: Num, C: Scalar<Element: Precision>> ClosedLoop<S, C> for FastLoop<S, C> {
    fn run(&mut self, commands: &[&[S]], ticks: usize, recorders: &mut [impl Recorder<S>]) -> usize {
        let path = match self.method {
            Method::RungeKutta => Path::General,
            Method::Exponential => self.digital.path(),
        };
        let (Some(commands), Some(recorder)) = (commands.first(), recorders.first_mut()) else { return 0 };
        match path {
            Path::Ideal => {
                S::dispatch(Chunk::<S, C, _, true, false> { test: self, commands, ticks, recorder })
            }
            Path::IdealLearning => {
                S::dispatch(Chunk::<S, C, _, true, true> { test: self, commands, ticks, recorder })
            }
            Path::General => {
                S::dispatch(Chunk::<S, C, _, false, false> { test: self, commands, ticks, recorder })
            }
        }
    }
    fn is_bounded(&self) -> S::Mask {
        self.state.is_bounded()
    }
    fn restart(&mut self, at: S::Mask) {
        self.state.restart(at);
    }
    fn digital_sides(&self) -> &[DigitalSide<S, C>] {
        slice::from_ref(&self.digital)
    }
    fn digital_sides_mut(&mut self) -> &mut [DigitalSide<S, C>] {
        slice::from_mut(&mut self.digital)
    }
}

/// Some ticks of a test.
struct Chunk<'a, S: Num, C: Scalar<Element: Precision>, K, const IDEAL: bool, const LEARNS: bool> {
    test: &'a mut FastLoop<S, C>,
    commands: &'a [S],
    ticks: usize,
    recorder: &'a mut K,
}

impl<S: Num, C: Scalar<Element: Precision>, K: Recorder<S>, const IDEAL: bool, const LEARNS: bool> Work
    for Chunk<'_, S, C, K, IDEAL, LEARNS>
{
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        let mut state = self.test.state;
        let mut done = 0;
        while done < self.ticks && state.is_bounded().all() {
            let command = self.commands[done];
            let next = self.commands.get(done + 1).copied().unwrap_or(command);
            let by_runge_kutta = !IDEAL && self.test.method == Method::RungeKutta;
            let mut ahead = None;
            if S::LANES == 1 && !by_runge_kutta {
                // Only a short chain of operations waits for the controller's root and division; the other
                // work runs meanwhile.
                ahead = Some(self.test.look_ahead(&state));
            }
            let truth = self.test.signals::<IDEAL>(&state);
            let output = self.test.sample::<IDEAL, LEARNS>(&mut state, [command, next], &truth);
            let tick = self.test.tick(&state, command, &truth, &output);
            self.recorder.record(done, &tick, self.test.estimates());
            if by_runge_kutta {
                self.test.advance_by_runge_kutta(&mut state, &output.driver);
            } else {
                // Several rigs side by side fill that time anyway; in this order they need fewer registers.
                let ahead = match ahead {
                    Some(ahead) => ahead,
                    None => self.test.look_ahead(&state),
                };
                self.test.advance(&mut state, &ahead, &output.driver);
            }
            done += 1;
        }
        self.test.state = state;
        done
    }
}
