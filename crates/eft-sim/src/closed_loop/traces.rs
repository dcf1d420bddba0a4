//! The traces of a test as one table: name, unit and source of each. A new trace needs one line here, for
//! Rust and Python.

use std::borrow::Cow;

use crate::closed_loop::estimate_history::{EstimateHistory, HeldTrace};
use crate::closed_loop::estimates::{Estimates, EstimatesInUse, estimates};
use crate::closed_loop::{Recorder, Tick, adapts};
use crate::config::{RigConfig, StructureKind, VelocitySource};
use crate::instruments::{are_ideal, has_accelerometer, has_load_pressure};
use crate::lanes::{Num, Work};
use crate::plant::needs_detail;

/// One line of the [table](TRACES).
#[derive(Debug, Clone, Copy)]
pub struct Trace {
    /// Its name in Rust, in Python and in files.
    pub name: &'static str,
    /// Its SI unit; empty for a dimensionless trace.
    pub unit: &'static str,
    /// Description.
    pub doc: &'static str,
    /// Its value in a test that does not record it.
    pub fallback: Fallback,
}

impl Trace {
    /// Whether it is an estimate of the learner.
    pub fn is_learned(&self) -> bool {
        matches!(self.fallback, Nominal(_))
    }
}

/// The value of a trace in a test that does not record it.
#[derive(Debug, Clone, Copy)]
pub enum Fallback {
    /// Every test records it.
    Recorded,
    /// One constant value from the rig.
    Constant(fn(&RigConfig) -> f64),
    /// One constant value from the configured controller; for traces of the learner.
    Nominal(fn(&RigConfig) -> f64),
    /// The trace of this name.
    Same(&'static str),
    /// The rig has no such thing.
    Absent,
}

use Fallback::{Absent, Constant, Nominal, Recorded, Same};

/// The groups of traces that a test records. A value that cannot change costs no memory and no time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Groups {
    plant: bool,
    supply: bool,
    sensors: bool,
    accelerometer: bool,
    pressures: bool,
    learner: bool,
}

impl Groups {
    fn of(rig: &RigConfig) -> Self {
        let sensors = !are_ideal(rig) || rig.controller.velocity_source != VelocitySource::Sensor;
        Self {
            plant: true,
            supply: supply_varies(rig),
            sensors,
            accelerometer: has_accelerometer(rig),
            pressures: has_load_pressure(rig),
            learner: adapts(rig),
        }
    }

    fn or(self, other: Self) -> Self {
        Self {
            plant: self.plant | other.plant,
            supply: self.supply | other.supply,
            sensors: self.sensors | other.sensors,
            accelerometer: self.accelerometer | other.accelerometer,
            pressures: self.pressures | other.pressures,
            learner: self.learner | other.learner,
        }
    }
}

/// Whether the supply pressure of a rig varies during a test.
pub(crate) fn supply_varies(rig: &RigConfig) -> bool {
    needs_detail(rig) || rig.structure.kind == StructureKind::ShearBuilding
}

/// `name: unit, description, value of a tick => fallback`, in groups that a test records together, after the
/// learner's [`estimates`].
macro_rules! traces {
    (
        learner |$calibration:ident| {
            $($learned:ident: $learned_unit:literal, $learned_doc:literal, $found:expr => $nominal:expr;)*
        }
        $($group:ident |$tick:ident| {
            $($name:ident: $unit:literal, $doc:literal, $value:expr => $fallback:expr;)*
        })*
    ) => {
        /// Every trace of floating-point numbers, in the order of tables and files.
        pub const TRACES: &[Trace] = &[
            $($(Trace { name: stringify!($name), unit: $unit, doc: $doc, fallback: $fallback },)*)*
            $(Trace {
                name: stringify!($learned),
                unit: $learned_unit,
                doc: $learned_doc,
                fallback: Nominal($nominal),
            },)*
        ];

        /// The samples of a test by the [table](TRACES). A trace that the test does not record is empty.
        #[derive(Debug, Clone, PartialEq)]
        pub struct Traces {
            groups: Groups,
            $($(#[doc = $doc] #[doc = concat!("(", $unit, ").")] pub $name: Vec<f64>,)*)*
            history: EstimateHistory,
            /// Bits of [`eft_core::status`].
            pub status: Vec<u32>,
        }

        impl Traces {
            pub(crate) fn with_capacity(rig: &RigConfig, ticks: usize) -> Self {
                let groups = Groups::of(rig);
                let capacity = |recorded| Vec::with_capacity(if recorded { ticks } else { 0 });
                Self {
                    groups,
                    $($($name: capacity(groups.$group),)*)*
                    history: EstimateHistory::default(),
                    status: Vec::with_capacity(ticks),
                }
            }

            /// The number of traces that a test of a rig keeps as samples.
            pub fn recorded(rig: &RigConfig) -> usize {
                let groups = Groups::of(rig);
                0 $(+ if groups.$group { [$(stringify!($name)),*].len() } else { 0 })*
            }

            /// The samples of a trace, and whether this test records it; `None` for an unknown name.
            fn recorded_samples(&self, name: &str) -> Option<(&Vec<f64>, bool)> {
                match name {
                    $($(stringify!($name) => Some((&self.$name, self.groups.$group)),)*)*
                    _ => None,
                }
            }

            fn samples_mut(&mut self, name: &str) -> Option<&mut Vec<f64>> {
                match name {
                    $($(stringify!($name) => Some(&mut self.$name),)*)*
                    _ => None,
                }
            }

            $($(
                #[doc = concat!($doc, " (", $unit, "). A trace that the test does not record is its replacement; a constant one is empty.")]
                pub fn $name(&self) -> &[f64] {
                    self.samples(stringify!($name))
                }
            )*)*

            $(
                #[doc = concat!($learned_doc, " (", $learned_unit, "). It is empty if the rig does not learn.")]
                pub fn $learned(&self) -> HeldTrace<'_> {
                    self.history.trace(|estimates| estimates.$learned, self.status.len())
                }
            )*

            /// A trace of the learner by name; `None` for any other name.
            pub fn held(&self, name: &str) -> Option<HeldTrace<'_>> {
                match name {
                    $(stringify!($learned) => Some(self.$learned()),)*
                    _ => None,
                }
            }
        }

        /// The last ticks of every trace, of one rig or of several side by side. It fits into the processor's
        /// cache until it is copied into the traces.
        pub(crate) struct Block<S: Num> {
            groups: Groups,
            $($($name: [S; BLOCK_TICKS],)*)*
            /// The learner's estimates, each with the tick from which they were in use.
            changes: Vec<(usize, EstimatesInUse<S>)>,
            status: [S::Flags; BLOCK_TICKS],
        }

        impl<S: Num> Block<S> {
            /// A block for all traces that any of these rigs records.
            pub(crate) fn new<'a>(rigs: impl Iterator<Item = &'a RigConfig>) -> Box<Self> {
                let none = [S::splat(0.0); BLOCK_TICKS];
                Box::new(Self {
                    groups: rigs.map(Groups::of).fold(Groups::default(), Groups::or),
                    $($($name: none,)*)*
                    changes: Vec::with_capacity(BLOCK_TICKS),
                    status: [S::Flags::default(); BLOCK_TICKS],
                })
            }

            /// Appends the first ticks to the traces of these lanes, one trace for all lanes before the next,
            /// because one trace fits into the fastest cache.
            #[inline(always)]
            fn append(&self, ticks: usize, to: &mut [(usize, &mut Traces)]) {
                $($(for (lane, to) in to.iter_mut().filter(|(_, to)| to.groups.$group) {
                    S::append(&mut to.$name, &self.$name[..ticks], *lane);
                })*)*
                for (lane, to) in to {
                    if to.groups.learner {
                        let first = to.status.len();
                        for (tick, now) in self.changes.iter().filter(|(tick, _)| *tick < ticks) {
                            to.history.add(first + tick, now.estimates.lane(*lane));
                        }
                    }
                    S::append_flags(&mut to.status, &self.status[..ticks], *lane);
                }
            }
        }

        impl<S: Num> Recorder<S> for Block<S> {
            #[inline(always)]
            fn record(&mut self, i: usize, tick: &Tick<'_, S>, estimates: &EstimatesInUse<S>) {
                $(if self.groups.$group {
                    $(self.$name[i] = { let $tick = tick; $value };)*
                })*
                if self.groups.learner {
                    self.record_estimates(i, estimates);
                }
                self.status[i] = tick.status;
            }
        }
    };
}

estimates!(traces! {
    plant |tick| {
        command: "N", "Force command", tick.command => Recorded;
        force: "N", "Force on the structure", tick.force => Recorded;
        displacement: "m", "Displacement", tick.plant.displacement => Recorded;
        velocity: "m/s", "Velocity", tick.plant.velocity => Recorded;
        spool: "", "Spool opening", tick.plant.spool => Recorded;
        load_pressure: "Pa", "Load pressure", tick.plant.load_pressure => Recorded;
        valve_command: "V", "Valve command", tick.output.valve_command => Recorded;
        compensation: "V", "Compensation signal", tick.output.compensation => Recorded;
    }
    supply |tick| {
        supply_pressure: "Pa", "Supply pressure",
            tick.supply_pressure => Constant(|rig| rig.plant().supply.pressure);
    }
    sensors |tick| {
        measured_force: "N", "Force as the load cell reported it", tick.output.measured.force => Same("force");
        measured_displacement: "m", "Displacement as its sensor reported it",
            tick.output.measured.displacement => Same("displacement");
        measured_velocity: "m/s", "Velocity as its sensor reported it, or as the controller estimated it",
            tick.output.measured.velocity => Same("velocity");
        measured_spool: "", "Spool opening as its sensor reported it",
            tick.output.measured.spool => Same("spool");
        measured_supply_pressure: "Pa", "Supply pressure as its sensor reported it",
            tick.output.measured.supply_pressure => Same("supply_pressure");
    }
    accelerometer |tick| {
        acceleration: "m/s²", "Acceleration, of a rig with an accelerometer", tick.acceleration => Absent;
        measured_acceleration: "m/s²", "Acceleration as the accelerometer reported it",
            tick.output.measured.acceleration => Absent;
    }
    pressures |tick| {
        measured_load_pressure: "Pa", "Load pressure as its sensors reported it",
            tick.output.measured.load_pressure => Absent;
    }
});

/// Ticks of a [`Block`].
pub(crate) const BLOCK_TICKS: usize = 128;

/// Copies the first ticks of a block.
struct AppendBlock<'a, 't, S: Num> {
    block: &'a Block<S>,
    ticks: usize,
    /// Lanes and their traces.
    to: &'a mut [(usize, &'t mut Traces)],
}

impl<S: Num> Work for AppendBlock<'_, '_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.block.append(self.ticks, self.to);
    }
}

impl<S: Num> Block<S> {
    /// Records the estimates in use at the first tick and at every change.
    #[inline(always)]
    fn record_estimates(&mut self, tick: usize, estimates: &EstimatesInUse<S>) {
        if tick == 0 {
            self.changes.clear();
        } else if self.changes.last().is_some_and(|(_, last)| last.changes == estimates.changes) {
            return;
        }
        self.changes.push((tick, *estimates));
    }

    /// Copies the first ticks to the traces of these lanes.
    pub(crate) fn append_to(&self, ticks: usize, to: &mut [(usize, &mut Traces)]) {
        S::dispatch(AppendBlock { block: self, ticks, to });
    }
}

/// The value of a trace in one test.
#[derive(Debug)]
pub enum Values<'a> {
    /// One value per sample.
    Samples(&'a mut Vec<f64>),
    /// Values that hold for some samples each.
    Held(HeldTrace<'a>),
    /// One constant value.
    Constant(f64),
    /// The samples of the trace of this name.
    Same(&'static str),
    /// The rig has no such thing.
    Absent,
}

impl Traces {
    /// The value of a trace of the table in this test of a rig.
    pub fn values(&mut self, trace: &Trace, rig: &RigConfig) -> Values<'_> {
        if self.recorded_samples(trace.name).is_some_and(|(_, recorded)| recorded) {
            return self.samples_mut(trace.name).map_or(Values::Absent, Values::Samples);
        }
        match trace.fallback {
            Nominal(_) if self.groups.learner => self.held(trace.name).map_or(Values::Absent, Values::Held),
            Constant(value) | Nominal(value) => Values::Constant(value(rig)),
            Same(name) => Values::Same(name),
            Recorded | Absent => Values::Absent,
        }
    }

    /// The samples of a trace, or of the trace with the same values; empty if there are none.
    pub fn samples(&self, name: &str) -> &[f64] {
        match self.recorded_samples(name) {
            Some((samples, true)) => samples,
            _ => match TRACES.iter().find(|trace| trace.name == name).map(|trace| trace.fallback) {
                Some(Same(other)) => self.samples(other),
                _ => &[],
            },
        }
    }

    /// The learner's last estimates; `None` if the rig does not learn.
    pub(crate) fn last_estimates(&self) -> Option<Estimates<f64>> {
        self.history.last().copied()
    }

    /// Names and values of the last estimates.
    pub fn estimates(&self) -> Option<Vec<(&'static str, f64)>> {
        self.last_estimates().map(|estimates| estimates.named())
    }

    /// One value of a trace per sample.
    fn all_samples(&self, name: &str) -> Cow<'_, [f64]> {
        let held = self.held(name).map(|held| held.samples());
        held.map_or_else(|| Cow::from(self.samples(name)), Cow::from)
    }

    /// Trace and sample of the first bit that differs from other traces; `None` if they are equal. Samples
    /// that only one of them has are a difference. A trace that only one of them has is ignored.
    pub fn first_difference(&self, other: &Self) -> Option<(&'static str, usize)> {
        fn first<T>(a: &[T], b: &[T], bits: impl Fn(&T) -> u64) -> Option<usize> {
            let differ = a.iter().zip(b).position(|(a, b)| bits(a) != bits(b));
            differ.or((a.len() != b.len()).then(|| a.len().min(b.len())))
        }
        let unknown = |samples: &[f64]| !samples.is_empty() && samples.iter().all(|value| value.is_nan());
        let differences = TRACES.iter().filter_map(|Trace { name, .. }| {
            let (a, b) = (self.all_samples(name), other.all_samples(name));
            if unknown(&a) || unknown(&b) {
                return None;
            }
            first(&a, &b, |value| value.to_bits()).map(|at| (*name, at))
        });
        let flags = first(&self.status, &other.status, |&flags| flags.into()).map(|at| ("status", at));
        differences.chain(flags).min_by_key(|difference| difference.1)
    }

    /// Every flag that was raised at any time.
    pub fn status_union(&self) -> u32 {
        self.status.iter().fold(0, |all, s| all | s)
    }
}
