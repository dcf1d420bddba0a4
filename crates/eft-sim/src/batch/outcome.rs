//! What is left of one test of a batch.

use eft_core::status;

use crate::batch::BatchOptions;
use crate::closed_loop::TestRun;
use crate::config::RigConfig;
use crate::error::Result;
use crate::metrics::{Norms, Row, Sums, Whole, ideal_displacements, not_silent};

/// How a test went.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Every metric; NaN those of the force where that of a test that diverged is too large to square.
    pub metrics: Row,
    /// Every flag of [`status`] that was raised at any time.
    pub status: u32,
    /// What the controller believed at the end, by the names of [`TestRun`]'s traces. None of a rig that neither adapts
    /// nor guards.
    pub estimates: Option<Vec<(&'static str, f64)>>,
    /// Samples that were run: the command's, or fewer where the test diverged.
    pub samples: usize,
    /// The traces, where they were asked for.
    pub run: Option<TestRun>,
}

impl Outcome {
    /// Judges a test by its traces.
    ///
    /// # Errors
    /// As [`judged`](Self::judged).
    pub(super) fn new(run: TestRun, options: &BatchOptions) -> Result<Self> {
        let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let sums = Sums {
            norms: Norms::of(&run.command, &run.force),
            max_spool: largest(&run.spool),
            drift: largest(&run.displacement),
            min_supply_pressure: run.min_supply_pressure(),
        };
        let whole = options.fft.then_some([run.force.as_slice(), run.displacement.as_slice()]);
        let judged = Self::judged(&run.rig, &run.command, run.sample_rate, &sums, whole, run.status_union())?;
        let estimates = run.estimates();
        Ok(Self { run: options.traces.then_some(run), estimates, ..judged })
    }

    /// Judges a test by what was summed up, and by the whole force (N) and displacement (m) where the costly metrics
    /// are wanted.
    ///
    /// # Errors
    /// A command that is zero throughout, which no error can be related to.
    pub(super) fn judged(
        rig: &RigConfig,
        command: &[f64],
        sample_rate: f64,
        sums: &Sums,
        whole: Option<[&[f64]; 2]>,
        status: u32,
    ) -> Result<Self> {
        not_silent(command)?;
        let ideal = whole.map(|_| ideal_displacements(rig, sample_rate, &[command]));
        let whole = whole.zip(ideal.as_deref()).map(|([force, displacement], ideal)| Whole {
            force,
            displacement,
            ideal: ideal.first().map_or(&[], Vec::as_slice),
        });
        let metrics = match Row::new(command, sample_rate, sums, whole) {
            Err(_) if status & status::DIVERGED != 0 => Row::without_force(sums, whole.is_some()),
            judged => judged?,
        };
        Ok(Self { metrics, status, estimates: None, samples: command.len(), run: None })
    }

    /// Whether the test ran to its end with finite values.
    pub fn finished(&self) -> bool {
        self.status & status::DIVERGED == 0
    }
}
