//! Selects the tests of a batch that can run side by side.

use std::collections::HashMap;
use std::ptr;

use crate::batch::{BatchOptions, Test};
use crate::closed_loop::{ChannelKind, check_commands, soft_end};
use crate::config::Realization;
use crate::instruments::are_ideal;
use crate::lanes::width;
use crate::plant::{TimeGrid, needs_detail};

/// Tests that one thread runs together, by their places in the batch.
pub(super) struct Chunk {
    pub(super) indices: Vec<usize>,
    /// Their common properties, if they run side by side.
    pub(super) side_by_side: Option<TestKind>,
}

/// The properties that tests side by side share; any other parameter may differ.
#[derive(Debug, PartialEq, Eq, Hash, Clone, Copy)]
pub(super) struct TestKind {
    sample_rate: u64,
    steps: u32,
    pub(super) samples: usize,
    pub(super) actuators: usize,
    /// Whether the plant has effects beyond the paper's.
    pub(super) detailed: bool,
    digital: bool,
    channel: ChannelKind,
    ideal_sensors: bool,
    /// The tick at which the soft end of the protections begins.
    pub(super) soft_end: Option<usize>,
}

impl TestKind {
    /// The kind of a test with valid commands; `None` for a test that is refused.
    fn of(test: &Test<'_>, options: &BatchOptions) -> Option<Self> {
        let Test { rig, commands } = test;
        let first = commands.first()?;
        let (sample_rate, samples) = (first.sample_rate, first.values.len());
        Some(Self {
            sample_rate: sample_rate.to_bits(),
            steps: options.simulate.grid(rig, sample_rate).ok()?.steps,
            samples,
            actuators: commands.len(),
            detailed: needs_detail(rig),
            digital: rig.controller.realization == Realization::Digital,
            channel: ChannelKind::of(rig),
            ideal_sensors: are_ideal(rig),
            soft_end: soft_end(rig, sample_rate, samples),
        })
    }

    /// The ticks and integration steps.
    pub(super) fn grid(&self) -> TimeGrid {
        TimeGrid::new(f64::from_bits(self.sample_rate), self.steps)
    }
}

/// Divides a batch into pieces, the larger ones first.
pub(super) fn chunks(tests: &[Test<'_>], options: &BatchOptions) -> Vec<Chunk> {
    let mut chunks = Vec::new();
    let mut alone = Vec::new();
    let mut kinds: Vec<(TestKind, Vec<usize>)> = Vec::new();
    let mut kind_numbers = HashMap::new();
    // Commands shared by several tests with the same number of stories are checked once.
    let mut command_validity = HashMap::new();
    for (index, test) in tests.iter().enumerate() {
        let commands_and_floors = (ptr::from_ref(test.commands), test.rig.structure.floors());
        let is_valid = *command_validity
            .entry(commands_and_floors)
            .or_insert_with(|| check_commands(test.rig, test.commands).is_ok());
        let Some(kind) = TestKind::of(test, options).filter(|_| is_valid) else {
            alone.push(index);
            continue;
        };
        let n = *kind_numbers.entry(kind).or_insert_with(|| {
            kinds.push((kind, Vec::new()));
            kinds.len() - 1
        });
        kinds[n].1.push(index);
    }
    let width = width();
    for (kind, mut indices) in kinds {
        // A step that one lane must subdivide costs time in all lanes. Rigs with similar compensation reach
        // their limits together.
        let sort_key = |index: usize| {
            let rig = tests[index].rig;
            let (compensation, valve) = (&rig.compensation, &rig.plant().servovalve);
            (compensation.mode as u8, compensation.level * valve.flow_gain_scale)
        };
        indices.sort_by(|&a, &b| {
            let (a, b) = (sort_key(a), sort_key(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        for indices in indices.chunks(width) {
            // A set of lanes costs about as much as two tests, even if few of its lanes are used.
            if indices.len() > 2 {
                chunks.push(Chunk { indices: indices.to_vec(), side_by_side: Some(kind) });
            } else {
                alone.extend(indices);
            }
        }
    }
    chunks.extend(alone.into_iter().map(|index| Chunk { indices: vec![index], side_by_side: None }));
    chunks
}
