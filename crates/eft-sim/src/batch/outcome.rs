//! What is left of one test of a batch.

use eft_core::status;

use crate::batch::BatchOptions;
use crate::closed_loop::estimates::Estimates;
use crate::closed_loop::{TestRun, adapts};
use crate::config::RigConfig;
use crate::error::Result;
use crate::metrics::{Actuator, Row, Summed, judge, summed};

/// How a test went.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Every metric, of a building that of the floor where it is largest; NaN those of the force where that of a test that
    /// diverged is too large to square.
    pub metrics: Row,
    /// Every flag of [`status`] that was raised at any time.
    pub status: u32,
    /// What the controller believed at the end, by the names of [`TestRun`]'s traces, of a building that of the floor
    /// where it moved farthest. None of a rig that neither adapts nor guards.
    pub estimates: Option<Vec<(&'static str, f64)>>,
    /// Samples that were run: the command's, or fewer where the test diverged.
    pub samples: usize,
    /// The traces of every actuator, where they were asked for.
    pub runs: Vec<TestRun>,
}

impl Outcome {
    /// Judges a test by its traces.
    ///
    /// # Errors
    /// As [`judged`](Self::judged).
    pub(super) fn new(rig: &RigConfig, runs: Vec<TestRun>, options: &BatchOptions) -> Result<Self> {
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

    /// Judges a test by what was summed up, by whole signals where the costly metrics are wanted, and by what each
    /// actuator's controller believed at the end.
    ///
    /// # Errors
    /// Commands that are zero throughout, which no error can be related to.
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
            floors => Estimates::nominal(|_| rig).farthest(floors).named(),
        });
        let samples = actuators.first().map_or(0, |one| one.command.len());
        Ok(Self { metrics: Row::worst(&rows), status, estimates, samples, runs: Vec::new() })
    }

    /// Whether the test ran to its end with finite values.
    pub fn finished(&self) -> bool {
        self.status & status::DIVERGED == 0
    }
}
