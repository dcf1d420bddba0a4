//! Which tests of a batch can run side by side.

use std::any::TypeId;
use std::collections::HashMap;
use std::ptr;

use crate::batch::{BatchOptions, Test};
use crate::closed_loop::one_actuator;
use crate::closed_loop::{Method, Precision, adapts};
use crate::config::Realization;
use crate::lanes::width;
use crate::plant::{TimeGrid, needs_detail};

/// Tests that one thread takes at once, by their places in the batch.
pub(super) struct Piece {
    pub(super) places: Vec<usize>,
    /// How time is cut, where they run side by side.
    pub(super) side_by_side: Option<TimeGrid>,
}

/// What tests side by side share; any other parameter may differ.
#[derive(PartialEq, Eq, Hash, Clone, Copy)]
struct Kind {
    digital: bool,
    sample_rate: u64,
    samples: usize,
    steps: u32,
}

/// Cuts a batch into pieces, the larger ones first.
pub(super) fn pieces<P: Precision>(tests: &[Test<'_>], options: &BatchOptions) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut alone = Vec::new();
    let mut kinds: Vec<(Kind, Vec<usize>)> = Vec::new();
    let mut known = HashMap::new();
    // A command that all tests share is looked through once.
    let mut sound = HashMap::new();
    for (place, test) in tests.iter().enumerate() {
        let is_sound =
            *sound.entry(ptr::from_ref(test.command)).or_insert_with(|| test.command.validate().is_ok());
        let Some(kind) = kind::<P>(test, options).filter(|_| is_sound) else {
            alone.push(place);
            continue;
        };
        let n = *known.entry(kind).or_insert_with(|| {
            kinds.push((kind, Vec::new()));
            kinds.len() - 1
        });
        kinds[n].1.push(place);
    }
    let width = width();
    for (kind, mut places) in kinds {
        // A step that one lane needs in small pieces costs all of them: rigs that
        // are compensated alike meet their limits together.
        let alike = |place: usize| {
            let rig = tests[place].rig;
            let (compensation, valve) = (&rig.compensation, &rig.plant().servovalve);
            (compensation.mode as u8, compensation.level * valve.flow_gain_scale)
        };
        places.sort_by(|&a, &b| {
            let (a, b) = (alike(a), alike(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        for places in places.chunks(width) {
            // A row of lanes costs about as much as two tests, however few of its lanes are filled.
            if places.len() > 2 {
                let grid = TimeGrid::new(f64::from_bits(kind.sample_rate), kind.steps);
                pieces.push(Piece { places: places.to_vec(), side_by_side: Some(grid) });
            } else {
                alone.extend(places);
            }
        }
    }
    pieces.extend(alone.into_iter().map(|place| Piece { places: vec![place], side_by_side: None }));
    pieces
}

/// The kind of a test, of a sound command, that can run beside others; none for one that must run alone, or fails.
fn kind<P: Precision>(test: &Test<'_>, options: &BatchOptions) -> Option<Kind> {
    let Test { rig, command } = test;
    let double = TypeId::of::<P>() == TypeId::of::<f64>();
    let plain = !needs_detail(rig) && !adapts(rig) && !rig.protection.enabled;
    let exponential = options.simulate.method == Method::Exponential;
    if options.traces || !double || !plain || !exponential {
        return None;
    }
    one_actuator(rig).ok()?;
    let grid = options.simulate.grid(rig, command.sample_rate).ok()?;
    Some(Kind {
        digital: rig.controller.realization == Realization::Digital,
        sample_rate: command.sample_rate.to_bits(),
        samples: command.values.len(),
        steps: grid.steps,
    })
}
