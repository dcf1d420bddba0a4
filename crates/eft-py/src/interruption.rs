//! Ctrl-C and progress during a long call.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

use pyo3::prelude::*;

use crate::errors::to_python;

/// Time between two checks of Ctrl-C and two calls of `progress`: short for a user, but long enough to leave
/// the interpreter to other threads.
const PATIENCE: Duration = Duration::from_millis(50);

/// Checks Ctrl-C and calls `progress` at intervals during a run.
#[derive(Default)]
pub(crate) struct Watch {
    progress: Option<Py<PyAny>>,
    last: Option<Instant>,
    stopped: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Self {
        Self { progress, last: None, stopped: None }
    }

    /// Whether to continue; the exception of an interruption is kept.
    pub(crate) fn go_on(&mut self, done: usize, total: usize) -> bool {
        if self.stopped.is_some() {
            return false;
        }
        let now = Instant::now();
        if done < total && self.last.is_some_and(|last| now - last < PATIENCE) {
            return true;
        }
        self.last = Some(now);
        let asked = Python::attach(|py| {
            py.check_signals()?;
            self.progress.as_ref().map_or(Ok(()), |progress| progress.call1(py, (done, total)).map(|_| ()))
        });
        self.stopped = asked.err();
        self.stopped.is_none()
    }

    /// The outcome, or the exception that ended it.
    pub(crate) fn end<T>(self, outcome: eft_sim::Result<T>) -> PyResult<T> {
        match self.stopped {
            Some(error) => Err(error),
            None => outcome.map_err(to_python),
        }
    }
}

/// Runs `work` without the interpreter. Ctrl-C ends its long loops.
pub(crate) fn interruptible<R: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> eft_sim::Result<R> + Send,
) -> PyResult<R> {
    py.detach(|| {
        let watch = Rc::new(RefCell::new(Watch::default()));
        let asked = Rc::clone(&watch);
        let result = eft_sim::interruptible(move || asked.borrow_mut().go_on(0, 1), work);
        watch.take().end(result)
    })
}
