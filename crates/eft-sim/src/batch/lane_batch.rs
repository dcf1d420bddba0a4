//! Several tests side by side; their metrics are summed while they run.

use eft_core::{Mask, Scalar, status};

use crate::batch::actuator_recorder::{ActuatorRecorder, LaneResult};
use crate::batch::chunks::TestKind;
use crate::batch::{BatchOptions, Outcome, Test};
use crate::closed_loop::{BLOCK_TICKS, ClosedLoop, FastLoop, GeneralLoop, Precision, Width};
use crate::lanes::{Num, WideWork, Work, dispatch_wide};
use crate::metrics::BLOCK;
use crate::{Error, Result};

/// Tests of one kind, at most as many as there are lanes.
#[derive(Clone, Copy)]
pub(super) struct LaneBatch<'a> {
    pub(super) tests: &'a [Test<'a>],
    pub(super) kind: TestKind,
    pub(super) options: &'a BatchOptions,
    pub(super) stopped: &'a dyn Fn() -> bool,
}

/// The same with controllers in one precision.
struct InPrecision<'a, P>(LaneBatch<'a>, std::marker::PhantomData<P>);

impl<P: Precision> WideWork for InPrecision<'_, P> {
    type Output = Result<Vec<Result<Outcome>>>;

    fn run<S: Num>(self) -> Self::Output {
        let Self(work, _) = self;
        // Unused lanes repeat the last test.
        let rig = |lane: usize| work.tests[lane.min(work.tests.len() - 1)].rig;
        let grid = work.kind.grid();
        if work.kind.detailed {
            let test = GeneralLoop::<S, P::Lanes<S>>::new(&rig, grid)?;
            work.run_on(&mut if work.options.traces { test } else { test.without_traces() })
        } else {
            let test = FastLoop::<S, P::Lanes<S>>::new(&rig, grid, work.options.simulate.method)?;
            work.run_on(&mut if work.options.traces { test } else { test.without_traces() })
        }
    }
}

impl LaneBatch<'_> {
    /// The outcome of each test, in order; `None` on a processor without vector instructions for it.
    ///
    /// # Errors
    /// Parameters that the core refuses, or an interruption.
    // Not generic, so that it is compiled here once.
    pub(super) fn run_in_widest_lanes(self, width: Width) -> Option<Result<Vec<Result<Outcome>>>> {
        match width {
            Width::Single => dispatch_wide(InPrecision::<f32>(self, std::marker::PhantomData)),
            Width::Double => dispatch_wide(InPrecision::<f64>(self, std::marker::PhantomData)),
        }
    }

    fn run_on<S: Num, C: Scalar<Element: Precision>>(
        &self,
        test: &mut impl ClosedLoop<S, C>,
    ) -> Result<Vec<Result<Outcome>>> {
        let TestKind { samples, actuators, soft_end, .. } = self.kind;
        let mut recorders: Vec<_> =
            (0..actuators).map(|_| ActuatorRecorder::<S>::new(self.tests, samples, self.options)).collect();
        let mut commands = vec![vec![S::splat(0.0); BLOCK + 1]; actuators];
        let mut lanes: Vec<Option<Vec<LaneResult>>> = (0..S::LANES).map(|_| None).collect();
        let longest = if self.options.traces { BLOCK_TICKS } else { BLOCK };
        let mut start = 0;
        while start < samples && lanes.iter().any(Option::is_none) {
            if (self.stopped)() {
                return Err(Error::Interrupted);
            }
            let ticks = BLOCK.min(samples - start);
            for (actuator, commands) in commands.iter_mut().enumerate() {
                let values = |lane: usize| {
                    let test = &self.tests[lane.min(self.tests.len() - 1)];
                    // A test that ended stays at rest.
                    lanes[lane].is_none().then(|| test.commands[actuator].values.as_slice())
                };
                S::dispatch(Gather { values, start, commands });
            }
            let mut done = 0;
            while done < ticks {
                if soft_end == Some(start + done) {
                    test.end();
                }
                let end = soft_end.filter(|end| (start + done + 1..start + ticks).contains(end));
                let segment = (end.map_or(ticks, |end| end - start) - done).min(longest);
                let rest: Vec<_> = commands.iter().map(|commands| &commands[done..]).collect();
                recorders.iter_mut().for_each(|recorder| recorder.offset = done);
                let ran = test.run(&rest, segment, &mut recorders);
                done += ran;
                recorders.iter_mut().for_each(|recorder| recorder.store(ran));
                if ran < segment {
                    let lost = !test.is_bounded();
                    for (lane, ended) in lanes.iter_mut().enumerate().filter(|(lane, _)| lost.lane(*lane)) {
                        if ended.is_none() {
                            let all = LaneResult::of(&mut recorders, lane, &commands, done, test);
                            *ended = Some(with_flag(all, status::DIVERGED));
                        }
                    }
                    test.restart(lost);
                }
            }
            ActuatorRecorder::add_block(&mut recorders, &commands, ticks);
            start += ticks;
        }
        let mut outcomes = Vec::with_capacity(self.tests.len());
        for (lane, test_of_lane) in self.tests.iter().enumerate() {
            let ended = lanes[lane].take();
            let ended = ended.unwrap_or_else(|| LaneResult::of(&mut recorders, lane, &commands, 0, test));
            outcomes.push(LaneResult::outcome(ended, test_of_lane, self.options.fft));
        }
        Ok(outcomes)
    }
}

/// Sets a flag in the last tick of a test that has ended.
fn with_flag(mut recorders: Vec<LaneResult>, flag: u32) -> Vec<LaneResult> {
    for floor in &mut recorders {
        floor.status |= flag;
        if let Some(run) = &mut floor.run {
            run.flag_end(flag);
        }
    }
    recorders
}

/// Gathers the commands of a block, and the first one after it, into lanes.
struct Gather<'a, S, F> {
    values: F,
    start: usize,
    commands: &'a mut [S],
}

impl<'v, S: Num, F: Fn(usize) -> Option<&'v [f64]>> Work for Gather<'_, S, F> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let none: &[f64] = &[];
        let mut lanes = [none; crate::lanes::WIDEST];
        for (lane, values) in lanes.iter_mut().enumerate().take(S::LANES) {
            *values = (self.values)(lane).unwrap_or(none);
        }
        let at =
            |values: &[f64], i: usize| values.get(self.start + i).or(values.last()).copied().unwrap_or(0.0);
        if lanes[..S::LANES].iter().all(|values| std::ptr::eq(*values, lanes[0])) {
            for (i, command) in self.commands.iter_mut().enumerate() {
                *command = S::splat(at(lanes[0], i));
            }
            return;
        }
        for (i, command) in self.commands.iter_mut().enumerate() {
            *command = S::from_lanes(|lane| at(lanes[lane], i));
        }
    }
}
