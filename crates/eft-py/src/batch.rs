//! Many tests in one call.

use eft_sim::batch::{self, BatchOptions, Outcome, Test};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::{refuse, to_python};
use crate::excitation::Command;
use crate::integration::options;
use crate::rig::Rig;
use crate::run::{Dtype, traces};
use crate::values::{optional_number, optional_whole};

/// The result of one test of a batch.
#[pyclass(frozen, module = "eft._native")]
pub(crate) struct BatchResult {
    metrics: Py<PyDict>,
    estimates: Option<Py<PyDict>>,
    traces: Option<Py<PyDict>>,
    status: u32,
    samples: usize,
    finished: bool,
}

#[pymethods]
impl BatchResult {
    /// The metrics of `TestRun.metrics` by name; for a building the largest of all floors. Without `fft`
    /// those that take longer than a test are absent. Metrics of the force are NaN if the test diverged and
    /// the force is too large.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> Bound<'py, PyDict> {
        self.metrics.bind(py).clone()
    }
    /// The controller's estimates at the end by the names of `TestRun`'s traces; for a building those of the
    /// floor where each changed most. `None` without self-calibration and guard.
    #[getter]
    fn estimates<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyDict>> {
        self.estimates.as_ref().map(|estimates| estimates.bind(py).clone())
    }
    /// Every status bit that was raised at any time.
    #[getter]
    fn status(&self) -> u32 {
        self.status
    }
    /// Number of simulated samples: that of the command, or fewer if the test diverged.
    #[getter]
    fn samples(&self) -> usize {
        self.samples
    }
    /// Whether the test ran to its end with finite values.
    #[getter]
    fn finished(&self) -> bool {
        self.finished
    }
    /// The traces by name, as from `simulate`; `None` if not requested.
    #[getter]
    fn traces<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyDict>> {
        self.traces.as_ref().map(|traces| traces.bind(py).clone())
    }
}

impl BatchResult {
    fn new(py: Python<'_>, outcome: Outcome, stacked: bool) -> PyResult<Self> {
        let named = |values: &mut dyn Iterator<Item = (&str, f64)>| {
            let dict = PyDict::new(py);
            for (name, value) in values {
                dict.set_item(name, value)?;
            }
            PyResult::Ok(dict.unbind())
        };
        let finished = outcome.finished();
        Ok(Self {
            metrics: named(&mut outcome.metrics.iter())?,
            estimates: outcome.estimates.map(|found| named(&mut found.into_iter())).transpose()?,
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
    let mut stopped = None;
    let go_on = |_, _| match Python::attach(|py| py.check_signals()) {
        Ok(()) => true,
        Err(error) => {
            stopped = Some(error);
            false
        }
    };
    let outcomes = py.detach(|| match dtype {
        Dtype::F32 => batch::simulate_batch::<f32>(&tests, &options, go_on),
        Dtype::F64 => batch::simulate_batch::<f64>(&tests, &options, go_on),
    });
    if let Some(error) = stopped {
        return Err(error);
    }
    let entries = PyList::empty(py);
    let mut outcomes = outcomes.map_err(to_python)?.into_iter();
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
