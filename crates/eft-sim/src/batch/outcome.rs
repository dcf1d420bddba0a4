//! The result of one test of a batch.

use eft_core::status;

use crate::batch::BatchOptions;
use crate::closed_loop::{Estimates, TestRun, adapts};
use crate::metrics::{Actuator, Metrics, Summed, judge, summed};
use crate::{Result, RigConfig};

/// The result of a test.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Every metric; for a building the value of the floor with the largest. Metrics of the force are NaN if
    /// the test diverged and the force is too large to square.
    pub metrics: Metrics,
    /// Every flag of [`status`] that was raised at any time.
    pub status: u32,
    /// The controller's estimates at the end, by the names of [`TestRun`]'s traces. For a building each is
    /// that of the floor where it changed most. `None` without self-calibration and guard.
    pub estimates: Option<Vec<(&'static str, f64)>>,
    /// Number of simulated samples: that of the command, or fewer if the test diverged.
    pub samples: usize,
    /// The traces of every actuator, if requested.
    pub runs: Vec<TestRun>,
}

impl Outcome {
    /// Computes the outcome of a test from its traces.
    ///
    /// # Errors
    /// Commands that are zero throughout, because a relative error is then undefined.
    pub fn new(rig: &RigConfig, runs: Vec<TestRun>, options: &BatchOptions) -> Result<Self> {
        let mut actuators = Vec::with_capacity(runs.len());
        for run in &runs {
            actuators.push(Actuator {
                command: &run.command,
                force: &run.force,
                displacement: &run.displacement,
                spool: &run.spool,
                min_supply_pressure: run.min_supply_pressure(),
            });
        }
        let estimates: Vec<_> = runs.iter().filter_map(|run| run.last_estimates()).collect();
        let status = runs.iter().fold(0, |all, run| all | run.status_union());
        let sample_rate = runs.first().map_or(f64::NAN, |run| run.sample_rate);
        let judged =
            Self::judged(rig, sample_rate, &summed(rig, &actuators), options.fft, status, &estimates)?;
        Ok(Self { runs: if options.traces { runs } else { Vec::new() }, ..judged })
    }

    /// Computes the outcome of a test from its sums and from the final estimates of each actuator's
    /// controller. The costly metrics need whole signals.
    ///
    /// # Errors
    /// Commands that are zero throughout, because a relative error is then undefined.
    pub(super) fn judged(
        rig: &RigConfig,
        sample_rate: f64,
        actuators: &[Summed<'_>],
        fft: bool,
        status: u32,
        estimates: &[Estimates<f64>],
    ) -> Result<Self> {
        let rows = judge(rig, sample_rate, actuators, fft, status & status::DIVERGED != 0)?;
        let estimates = adapts(rig).then(|| match estimates {
            [one] => one.named(),
            floors => Estimates::nominal(&|_| rig).farthest(floors),
        });
        let samples = actuators.first().map_or(0, |one| one.command.len());
        Ok(Self { metrics: Metrics::worst(&rows), status, estimates, samples, runs: Vec::new() })
    }

    /// Whether the test ran to its end with finite values.
    pub fn finished(&self) -> bool {
        self.status & status::DIVERGED == 0
    }
}
