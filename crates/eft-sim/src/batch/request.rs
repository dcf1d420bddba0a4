//! The tests of a batch, and how it runs.

use crate::closed_loop::SimulateOptions;
use crate::config::RigConfig;
use crate::ground_motion::excitation::Command;

/// One test of a batch.
#[derive(Debug, Clone, Copy)]
pub struct Test<'a> {
    /// The tested rig.
    pub rig: &'a RigConfig,
    /// The force commands (N), one per actuator, the ground floor's first.
    pub commands: &'a [Command],
}

/// How a batch is run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BatchOptions {
    /// How each test is run.
    pub simulate: SimulateOptions,
    /// Number of threads; `None` means one per core.
    pub threads: Option<usize>,
    /// Whether the outcomes carry the traces.
    pub traces: bool,
    /// Whether to compute the metrics that need a Fourier transform; they take longer than the test.
    pub fft: bool,
}
