//! Several tests side by side, judged as they run.

use eft_core::{Flags, Mask, status};

use crate::batch::{BatchOptions, Outcome, Test};
use crate::closed_loop::chunk;
use crate::closed_loop::fast::FastLoop;
use crate::closed_loop::tick::{Recorder, Tick};
use crate::error::{Error, Result};
use crate::lanes::Num;
use crate::lanes::{WideWork, Work, dispatch, dispatch_wide};
use crate::metrics::{BLOCK, Norms, Sums};
use crate::plant::TimeGrid;

/// Tests of one kind, as many as fit side by side or fewer.
pub(super) struct SideBySide<'a> {
    pub(super) tests: &'a [Test<'a>],
    pub(super) grid: TimeGrid,
    pub(super) options: &'a BatchOptions,
    pub(super) stopped: &'a dyn Fn() -> bool,
}

impl WideWork for SideBySide<'_> {
    type Output = Result<Vec<Result<Outcome>>>;

    fn run<S: Num>(self) -> Self::Output {
        self.run_on::<S>()
    }
}

impl SideBySide<'_> {
    /// The outcome of each, in order.
    ///
    /// # Errors
    /// As [`run_on`](Self::run_on).
    // Not generic, so that it is compiled here once.
    pub(super) fn run_widest(self) -> Result<Vec<Result<Outcome>>> {
        dispatch_wide(self)
    }

    /// # Errors
    /// A controller that the core refuses, or an interruption.
    fn run_on<S: Num>(&self) -> Result<Vec<Result<Outcome>>> {
        // Lanes that are left over run the last test once more.
        let test_of = |lane: usize| &self.tests[lane.min(self.tests.len() - 1)];
        let mut test = FastLoop::<S, S>::new(|lane| test_of(lane).rig, self.grid)?;
        let mut state = test.at_rest();
        let total = self.tests[0].command.values.len();
        let mut lanes: Vec<Option<Ended>> = (0..S::LANES).map(|_| None).collect();
        let mut totals = Totals::new(if self.options.fft { self.tests.len() } else { 0 });
        let mut start = 0;
        while start < total && lanes.iter().any(Option::is_none) {
            if (self.stopped)() {
                return Err(Error::Interrupted);
            }
            let ticks = BLOCK.min(total - start);
            dispatch::<S, _>(Gather {
                // A test that ended stays at rest.
                values: |lane: usize| lanes[lane].is_none().then(|| test_of(lane).command.values.as_slice()),
                start,
                commands: &mut totals.commands,
            });
            let mut done = 0;
            while done < ticks {
                let recorder = Judged {
                    forces: &mut totals.forces[done..],
                    displacements: &mut totals.displacements[done..],
                    drift: &mut totals.drift,
                    spool: &mut totals.spool,
                    status: &mut totals.status,
                };
                done += chunk::run(&mut test, &mut state, &totals.commands[done..], ticks - done, recorder);
                if done < ticks {
                    let lost = !test.is_bounded(&state);
                    for (lane, ended) in lanes.iter_mut().enumerate().filter(|(lane, _)| lost.lane(*lane)) {
                        if ended.is_none() {
                            *ended = Some(totals.end(lane, done, start + done, status::DIVERGED));
                        }
                    }
                    test.restart(&mut state, lost);
                }
            }
            totals.add(ticks);
            start += ticks;
        }
        let ended = lanes
            .into_iter()
            .enumerate()
            .map(|(lane, ended)| ended.unwrap_or_else(|| totals.end(lane, 0, total, 0)));
        let ended: Vec<_> = ended.collect();
        let whole = totals.traces.into_iter().map(Some).chain(std::iter::repeat_with(|| None));
        let judged = self.tests.iter().zip(ended).zip(whole);
        Ok(judged.map(|((test, ended), whole)| ended.outcome(test, whole.as_ref())).collect())
    }
}

/// One lane's test at its end.
struct Ended {
    norms: Norms<f64>,
    spool: f64,
    drift: f64,
    status: u32,
    samples: usize,
}

impl Ended {
    fn outcome(self, test: &Test<'_>, whole: Option<&[Vec<f64>; 2]>) -> Result<Outcome> {
        let command = &test.command.values[..self.samples];
        let whole = whole.map(|signals| signals.each_ref().map(|signal| &signal[..self.samples]));
        let sums = Sums {
            norms: self.norms,
            max_spool: self.spool,
            drift: self.drift,
            min_supply_pressure: test.rig.plant().supply.pressure,
        };
        Outcome::judged(test.rig, command, test.command.sample_rate, &sums, whole, self.status)
    }
}

/// What stays of the ticks.
struct Totals<S: Num> {
    norms: Norms<S>,
    spool: S,
    drift: S,
    status: S::Flags,
    /// Of one block, and the command behind it.
    commands: Vec<S>,
    forces: Vec<S>,
    displacements: Vec<S>,
    /// Whole forces (N) and displacements (m), a test each, where the costly metrics will need them.
    traces: Vec<[Vec<f64>; 2]>,
}

impl<S: Num> Totals<S> {
    fn new(traces: usize) -> Self {
        Self {
            norms: Norms::new(),
            spool: S::splat(0.0),
            drift: S::splat(0.0),
            status: S::Flags::default(),
            commands: vec![S::splat(0.0); BLOCK + 1],
            forces: vec![S::splat(0.0); BLOCK],
            displacements: vec![S::splat(0.0); BLOCK],
            traces: vec![[Vec::new(), Vec::new()]; traces],
        }
    }

    /// Takes a finished block of `ticks` in.
    fn add(&mut self, ticks: usize) {
        dispatch::<S, _>(Add {
            norms: &mut self.norms,
            commands: &self.commands[..ticks],
            forces: &self.forces[..ticks],
        });
        for (lane, [force, displacement]) in self.traces.iter_mut().enumerate() {
            force.extend(self.forces[..ticks].iter().map(|value| value.lane(lane)));
            displacement.extend(self.displacements[..ticks].iter().map(|value| value.lane(lane)));
        }
    }

    /// A lane's test, `ticks` into the block and `samples` from its beginning.
    fn end(&self, lane: usize, ticks: usize, samples: usize, flag: u32) -> Ended {
        let mut norms = self.norms.lane(lane);
        if ticks > 0 {
            let of = |values: &[S]| values[..ticks].iter().map(|value| value.lane(lane)).collect::<Vec<_>>();
            norms.add(&of(&self.commands), &of(&self.forces));
        }
        Ended {
            norms,
            spool: self.spool.lane(lane),
            drift: self.drift.lane(lane),
            status: self.status.lane(lane) | flag,
            samples,
        }
    }
}

struct Judged<'a, S: Num> {
    forces: &'a mut [S],
    displacements: &'a mut [S],
    spool: &'a mut S,
    drift: &'a mut S,
    status: &'a mut S::Flags,
}

impl<S: Num> Recorder<S> for Judged<'_, S> {
    #[inline(always)]
    fn record(&mut self, i: usize, tick: &Tick<S>) {
        let larger = |a: S, b: S| S::select(b.gt(a), b, a);
        self.forces[i] = tick.force;
        self.displacements[i] = tick.plant.displacement;
        *self.spool = larger(*self.spool, tick.plant.spool.abs());
        *self.drift = larger(*self.drift, tick.plant.displacement.abs());
        *self.status = *self.status | tick.status;
    }
}

/// Puts the commands of a block side by side, and the one behind it.
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
        let mut lanes = [none; 16];
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

struct Add<'a, S> {
    norms: &'a mut Norms<S>,
    commands: &'a [S],
    forces: &'a [S],
}

impl<S: Num> Work for Add<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.norms.add(self.commands, self.forces);
    }
}
