//! Sums, flags and traces of one actuator, for several tests side by side.

use eft_core::{Flags, Scalar};

use crate::Result;
use crate::batch::{BatchOptions, Outcome, Test};
use crate::closed_loop::{
    Block, ClosedLoop, Estimates, EstimatesInUse, Precision, Recorder, TestRun, Tick, adapts, supply_varies,
};
use crate::lanes::{Num, Work};
use crate::metrics::{BLOCK, Norms, Summed, Sums};

/// One actuator, or one floor of buildings, of every lane.
pub(super) struct ActuatorRecorder<S: Num> {
    norms: Norms<S>,
    /// Largest spool opening (1) and smallest supply pressure (Pa).
    max_spool: S,
    min_supply_pressure: S,
    drift: S,
    /// Whether the supply pressure of any test varies.
    supply_varies: bool,
    /// Whether any test learns.
    learns: bool,
    estimates: EstimatesInUse<S>,
    status: S::Flags,
    /// The tick of the block from which on the next ticks are recorded.
    pub(super) offset: usize,
    /// Forces (N) and displacements (m) of one block.
    forces: Vec<S>,
    displacements: Vec<S>,
    /// The runs of the tests that keep traces, until each test ends.
    runs: Vec<Option<TestRun>>,
    /// The ticks that are not yet in the runs.
    block: Option<Box<Block<S>>>,
    /// Whole forces (N) and displacements (m) of each test, if only the costly metrics need them.
    signals: Vec<[Vec<f64>; 2]>,
}

impl<S: Num> ActuatorRecorder<S> {
    pub(super) fn new(tests: &[Test<'_>], samples: usize, options: &BatchOptions) -> Self {
        let zero = S::splat(0.0);
        let supply_varies = tests.iter().any(|test| supply_varies(test.rig));
        let pressure = |lane: usize| tests[lane.min(tests.len() - 1)].rig.plant().supply.pressure;
        let highest = S::splat(f64::INFINITY);
        let signals = if options.fft && !options.traces { tests.len() } else { 0 };
        let recorded = if options.traces { tests } else { &[] };
        let run =
            |test: &Test<'_>| Some(TestRun::with_capacity(test.rig, test.commands[0].sample_rate, samples));
        Self {
            norms: Norms::default(),
            max_spool: zero,
            min_supply_pressure: if supply_varies { highest } else { S::from_lanes(pressure) },
            drift: zero,
            supply_varies,
            learns: tests.iter().any(|test| adapts(test.rig)),
            estimates: EstimatesInUse::none(),
            status: S::Flags::default(),
            offset: 0,
            forces: vec![zero; BLOCK],
            displacements: vec![zero; BLOCK],
            runs: recorded.iter().map(run).collect(),
            block: options.traces.then(|| Block::new(recorded.iter().map(|test| test.rig))),
            signals: vec![[Vec::with_capacity(samples), Vec::with_capacity(samples)]; signals],
        }
    }

    /// Moves the first recorded ticks into the tests' traces.
    pub(super) fn store(&mut self, ticks: usize) {
        if let Some(block) = &self.block {
            let runs = self.runs.iter_mut().enumerate();
            let mut to: Vec<_> =
                runs.filter_map(|(lane, run)| Some((lane, &mut run.as_mut()?.traces))).collect();
            block.append_to(ticks, &mut to);
        }
    }

    /// Adds a finished block of `ticks` to every floor.
    pub(super) fn add_block(floors: &mut [Self], commands: &[Vec<S>], ticks: usize) {
        let mut below: Option<&[S]> = None;
        for (floor, commands) in floors.iter_mut().zip(commands) {
            let (forces, displacements) = (&floor.forces[..ticks], &floor.displacements[..ticks]);
            let (norms, drift) = (&mut floor.norms, &mut floor.drift);
            S::dispatch(AddSums { norms, drift, commands: &commands[..ticks], forces, displacements, below });
            for (lane, [force, displacement]) in floor.signals.iter_mut().enumerate() {
                force.extend(forces.iter().map(|value| value.lane(lane)));
                displacement.extend(displacements.iter().map(|value| value.lane(lane)));
            }
            below = Some(&floor.displacements);
        }
    }
}

impl<S: Num> Recorder<S> for ActuatorRecorder<S> {
    #[inline(always)]
    fn record(&mut self, i: usize, tick: &Tick<'_, S>, estimates: &EstimatesInUse<S>) {
        self.forces[self.offset + i] = tick.force;
        self.displacements[self.offset + i] = tick.plant.displacement;
        self.max_spool = tick.plant.spool.abs().larger(self.max_spool);
        if self.supply_varies {
            self.min_supply_pressure = tick.supply_pressure.smaller(self.min_supply_pressure);
        }
        if self.learns && estimates.changes != self.estimates.changes {
            self.estimates = *estimates;
        }
        self.status = self.status | tick.status;
        if let Some(block) = &mut self.block {
            block.record(i, tick, estimates);
        }
    }
}

struct AddSums<'a, S> {
    norms: &'a mut Norms<S>,
    drift: &'a mut S,
    commands: &'a [S],
    forces: &'a [S],
    displacements: &'a [S],
    below: Option<&'a [S]>,
}

impl<S: Num> Work for AddSums<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.norms.add(self.commands, self.forces);
        let mut most = *self.drift;
        for (i, &displacement) in self.displacements.iter().enumerate() {
            most = self.below.map_or(displacement, |below| displacement - below[i]).abs().larger(most);
        }
        *self.drift = most;
    }
}

/// One lane's test at one actuator, at its end.
pub(super) struct LaneResult {
    sums: Sums,
    estimates: Estimates<f64>,
    pub(super) status: u32,
    samples: usize,
    pub(super) run: Option<TestRun>,
    signals: Option<[Vec<f64>; 2]>,
}

impl LaneResult {
    /// The result of one lane at every actuator, `ticks` into a block that is not yet added.
    pub(super) fn of<S: Num, C: Scalar<Element: Precision>>(
        floors: &mut [ActuatorRecorder<S>],
        lane: usize,
        commands: &[Vec<S>],
        ticks: usize,
        test: &mut impl ClosedLoop<S, C>,
    ) -> Vec<Self> {
        let samples = |values: &[S]| values[..ticks].iter().map(|value| value.lane(lane)).collect::<Vec<_>>();
        let mut below: Option<Vec<f64>> = None;
        let floors = floors.iter_mut().zip(commands).enumerate();
        let end = |(actuator, (floor, commands)): (usize, (&mut ActuatorRecorder<S>, &Vec<S>))| {
            let (command, force) = (samples(commands), samples(&floor.forces));
            let displacement = samples(&floor.displacements);
            let (mut norms, mut drift) = (floor.norms.lane(lane), floor.drift.lane(lane));
            if ticks > 0 {
                let (commands, forces, displacements) = (&command[..], &force[..], &displacement[..]);
                let below = below.as_deref();
                AddSums { norms: &mut norms, drift: &mut drift, commands, forces, displacements, below }
                    .run();
            }
            let run = floor.runs.get_mut(lane).and_then(Option::take).map(|mut run| {
                test.complete(&mut run, actuator, lane);
                run
            });
            let signals = floor.signals.get(lane).map(|[forces, displacements]| {
                [[forces.as_slice(), &force].concat(), [displacements.as_slice(), &displacement].concat()]
            });
            below = Some(displacement);
            Self {
                samples: norms.samples(),
                sums: Sums {
                    norms,
                    max_spool: floor.max_spool.lane(lane),
                    drift,
                    min_supply_pressure: floor.min_supply_pressure.lane(lane),
                },
                estimates: floor.estimates.estimates.lane(lane),
                status: floor.status.lane(lane),
                run,
                signals,
            }
        };
        floors.map(end).collect()
    }

    /// The outcome of a test, from all its actuators.
    pub(super) fn outcome(mut floors: Vec<Self>, test: &Test<'_>, fft: bool) -> Result<Outcome> {
        let runs: Vec<_> = floors.iter_mut().filter_map(|floor| floor.run.take()).collect();
        let samples = floors.first().map_or(0, |floor| floor.samples);
        let mut summed = Vec::with_capacity(floors.len());
        for (i, floor) in floors.iter().enumerate() {
            let signals: [&[f64]; 2] = match (&floor.signals, runs.get(i)) {
                (Some([force, displacement]), _) => [force, displacement],
                (None, Some(run)) => [&run.force, &run.displacement],
                (None, None) => [&[], &[]],
            };
            let command = &test.commands[i].values[..samples];
            summed.push(Summed { command, sums: floor.sums, whole: signals });
        }
        let estimates: Vec<_> = floors.iter().map(|floor| floor.estimates).collect();
        let status = floors.iter().fold(0, |all, floor| all | floor.status);
        let judged =
            Outcome::judged(test.rig, test.commands[0].sample_rate, &summed, fft, status, &estimates)?;
        Ok(Outcome { runs, ..judged })
    }
}
