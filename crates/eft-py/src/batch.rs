//! Many tests in one call.

use eft_sim::batch::{self, BatchOptions, Outcome, Test};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict, PyList};

use crate::errors::refuse;
use crate::excitation::Command;
use crate::integration::options;
use crate::interruption::Watch;
use crate::rig::Rig;
use crate::run::{Dtype, traces};
use crate::values::{optional_number, optional_whole};

/// The result of one test of a batch.
#[pyclass(frozen, get_all, module = "eft._native")]
pub(crate) struct BatchResult {
    /// The metrics of `TestRun.metrics` by name; for a building the largest of all floors. Without `fft`
    /// those that take longer than a test are absent. Metrics of the force are NaN if the test diverged and
    /// the force is too large.
    metrics: Py<PyDict>,
    /// The controller's estimates at the end by the names of `TestRun`'s traces; for a building those of the
    /// floor where each changed most. `None` without self-calibration and guard.
    estimates: Option<Py<PyDict>>,
    /// The traces by name, as from `simulate`; `None` if not requested.
    traces: Option<Py<PyDict>>,
    /// Every status bit that was raised at any time.
    status: u32,
    /// Number of simulated samples: that of the command, or fewer if the test diverged.
    samples: usize,
    /// Whether the test ran to its end with finite values.
    finished: bool,
}

impl BatchResult {
    fn new(py: Python<'_>, outcome: Outcome, stacked: bool) -> PyResult<Self> {
        let estimates = outcome.estimates.as_ref().map(|found| found.into_py_dict(py)).transpose()?;
        let finished = outcome.finished();
        Ok(Self {
            metrics: outcome.metrics.iter().into_py_dict(py)?.unbind(),
            estimates: estimates.map(Bound::unbind),
            status: outcome.status,
            samples: outcome.samples,
            finished,
            traces: match outcome.runs {
                runs if runs.is_empty() => None,
                runs => Some(traces(py, runs, stacked)?.unbind()),
            },
        })
    }
}

/// Run many tests, one per rig, on `threads` threads (all cores if `None`).
///
/// `commands` is one command for all rigs, or a sequence with one per rig. The result has one entry per rig,
/// in order: a `BatchResult`, or the reason why that test failed. The numbers do not depend on the other
/// tests or on the threads.
#[pyfunction]
#[pyo3(signature = (rigs, commands, *, dtype="f64", method="exponential", largest_step=None, threads=None,
                    traces=false, fft=true))]
#[allow(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn simulate_batch<'py>(
    py: Python<'py>,
    rigs: Vec<Py<Rig>>,
    commands: &Bound<'py, PyAny>,
    dtype: &str,
    method: &str,
    #[pyo3(from_py_with = optional_number)] largest_step: Option<f64>,
    #[pyo3(from_py_with = optional_whole)] threads: Option<usize>,
    traces: bool,
    fft: bool,
) -> PyResult<Bound<'py, PyList>> {
    let dtype = Dtype::parse(dtype)?;
    let options = BatchOptions { simulate: options(method, largest_step)?, threads, traces, fft };
    let one = commands.extract::<Py<Command>>().ok();
    let commands: Vec<Py<Command>> = match one {
        Some(command) => rigs.iter().map(|_| command.clone_ref(py)).collect(),
        None => commands.extract()?,
    };
    if commands.len() != rigs.len() {
        let allowed = format!("must be one, or one for each of the {} rigs", rigs.len());
        return Err(refuse("commands", format!("{} commands", commands.len()), allowed));
    }
    let mut tests = Vec::with_capacity(rigs.len());
    let mut refused = Vec::new();
    for (rig, command) in rigs.iter().zip(&commands) {
        let rig = &rig.get().config;
        match command.get().of(rig) {
            Ok(commands) => {
                tests.push(Test { rig, commands });
                refused.push(None);
            }
            Err(error) => refused.push(Some(error.value(py).to_string())),
        }
    }
    let mut watch = Watch::default();
    let go_on = |done, total| watch.go_on(done, total);
    let outcomes = py.detach(|| match dtype {
        Dtype::F32 => batch::simulate_batch::<f32>(&tests, &options, go_on),
        Dtype::F64 => batch::simulate_batch::<f64>(&tests, &options, go_on),
    });
    let entries = PyList::empty(py);
    let mut outcomes = watch.end(outcomes)?.into_iter();
    for (refused, command) in refused.into_iter().zip(&commands) {
        if let Some(reason) = refused {
            entries.append(reason)?;
            continue;
        }
        match outcomes.next() {
            Some(Ok(outcome)) => entries.append(BatchResult::new(py, outcome, command.get().stacked)?)?,
            Some(Err(error)) => entries.append(error.to_string())?,
            None => {}
        }
    }
    Ok(entries)
}
