//! What is left of one test of a batch.

use eft_core::status;

use crate::batch::BatchOptions;
use crate::closed_loop::{TestRun, adapts};
use crate::error::Result;
use crate::metrics::{Metrics, Norms, TimeMetrics, not_silent};

/// How a test went.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Name and value of every metric; NaN where a metric has no answer, and all NaN where the force of a test that
    /// diverged is too large to square. `max_spool` is the largest opening (1).
    pub metrics: Vec<(&'static str, f64)>,
    /// Every flag of [`status`] that was raised at any time.
    pub status: u32,
    /// What the controller believed at the end, by the names of [`TestRun`]'s traces: flow gain (1), response delay (s),
    /// valve gain (1) and level (1). None of a rig that neither adapts nor guards.
    pub estimates: Option<[(&'static str, f64); 4]>,
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
        let norms = Norms::of(&run.command, &run.force);
        let spool = run.spool.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let force = options.fft.then_some(run.force.as_slice());
        let judged = Self::judged(&run.command, run.sample_rate, &norms, force, spool, run.status_union())?;
        let last = |trace: &[f64]| trace.last().copied().unwrap_or(f64::NAN);
        let estimates = adapts(&run.rig).then(|| {
            [
                ("flow_gain_estimate", last(&run.flow_gain_estimate)),
                ("response_delay_estimate", last(&run.response_delay_estimate)),
                ("valve_gain_estimate", last(&run.valve_gain_estimate)),
                ("level", last(&run.level)),
            ]
        });
        Ok(Self { run: options.traces.then_some(run), estimates, ..judged })
    }

    /// Judges a test by what was summed up, and by the whole force (N) where the metrics that need Fourier
    /// transforms are wanted.
    ///
    /// # Errors
    /// A command that is zero throughout, which no error can be related to.
    pub(super) fn judged(
        command: &[f64],
        sample_rate: f64,
        norms: &Norms<f64>,
        force: Option<&[f64]>,
        spool: f64,
        status: u32,
    ) -> Result<Self> {
        not_silent(command)?;
        let varies = command.iter().any(|c| *c != command[0]);
        let judged = norms.metrics(varies).and_then(|time| match force {
            None => Ok(named(&time.all())),
            Some(force) => Ok(named(&Metrics::with_transforms(time, command, force, sample_rate)?.all())),
        });
        let mut metrics = match judged {
            Err(_) if status & status::DIVERGED != 0 => match force {
                None => named(&TimeMetrics::UNANSWERED.all()),
                Some(_) => named(&Metrics::UNANSWERED.all()),
            },
            judged => judged?,
        };
        metrics.push(("max_spool", spool));
        Ok(Self { metrics, status, estimates: None, samples: command.len(), run: None })
    }

    /// Whether the test ran to its end with finite values.
    pub fn finished(&self) -> bool {
        self.status & status::DIVERGED == 0
    }
}

fn named(metrics: &[(&'static str, Option<f64>, &'static str)]) -> Vec<(&'static str, f64)> {
    metrics.iter().map(|(name, value, _)| (*name, value.unwrap_or(f64::NAN))).collect()
}
