//! What is left of one test of a batch.

use eft_core::status;

use crate::batch::BatchOptions;
use crate::closed_loop::TestRun;
use crate::error::Result;
use crate::metrics::{Metrics, TimeMetrics};

/// How a test went.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Name and value of every metric; NaN where a metric has no answer. `max_spool` is the largest opening (1).
    pub metrics: Vec<(&'static str, f64)>,
    /// Every flag of [`status`] that was raised at any time.
    pub status: u32,
    /// Samples that were run: the command's, or fewer where the test diverged.
    pub samples: usize,
    /// The traces, where they were asked for.
    pub run: Option<TestRun>,
}

impl Outcome {
    /// Judges a test.
    ///
    /// # Errors
    /// A command that is zero throughout, which no error can be related to.
    pub(super) fn new(run: TestRun, options: &BatchOptions) -> Result<Self> {
        let status = run.status_union();
        let mut metrics = match judge(&run, options.fft) {
            // The force of a test that diverged may be too large to square.
            Err(_) if status & status::DIVERGED != 0 => unanswered(options.fft),
            judged => judged?,
        };
        metrics.push(("max_spool", run.spool.iter().fold(0.0, |most: f64, x| most.max(x.abs()))));
        Ok(Self { metrics, status, samples: run.force.len(), run: options.traces.then_some(run) })
    }

    /// Whether the test ran to its end with finite values.
    pub fn finished(&self) -> bool {
        self.status & status::DIVERGED == 0
    }
}

type Named = Vec<(&'static str, f64)>;

fn judge(run: &TestRun, fft: bool) -> Result<Named> {
    Ok(if fft {
        named(&Metrics::new(&run.command, &run.force, run.sample_rate)?.all())
    } else {
        named(&TimeMetrics::new(&run.command, &run.force)?.all())
    })
}

fn unanswered(fft: bool) -> Named {
    if fft { named(&Metrics::UNANSWERED.all()) } else { named(&TimeMetrics::UNANSWERED.all()) }
}

fn named(metrics: &[(&'static str, Option<f64>, &'static str)]) -> Named {
    metrics.iter().map(|(name, value, _)| (*name, value.unwrap_or(f64::NAN))).collect()
}
