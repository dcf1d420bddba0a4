//! Worker threads that process pieces of work while the calling thread reports progress.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use crate::{Error, Result};

/// Time between two calls of `progress`.
const REPORT_INTERVAL: Duration = Duration::from_millis(50);

/// Runs `work(0)` to `work(chunks - 1)`. Each returns some of the `total` results with their places. `work`
/// also receives the flag that tells it to stop.
///
/// # Errors
/// [`Error::Interrupted`] if `progress(done, total)`, called on the calling thread, returned `false`.
pub(super) fn run<T: Send>(
    threads: usize,
    chunks: usize,
    total: usize,
    work: impl Fn(usize, &dyn Fn() -> bool) -> Vec<(usize, Result<T>)> + Sync,
    mut progress: impl FnMut(usize, usize) -> bool,
) -> Result<Vec<Result<T>>> {
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let stopped = || stop.load(Ordering::Relaxed);
    let mut results: Vec<_> = (0..total).map(|_| Err(Error::Interrupted)).collect();
    let (send, receive) = channel();
    thread::scope(|scope| {
        for _ in 0..threads.min(chunks) {
            let (send, next, stopped, work) = (send.clone(), &next, &stopped, &work);
            scope.spawn(move || {
                while !stopped() {
                    let chunk = next.fetch_add(1, Ordering::Relaxed);
                    if chunk >= chunks || send.send(work(chunk, stopped)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(send);
        let (mut done, mut last_report) = (0, None::<Instant>);
        loop {
            if last_report.is_none_or(|last_report| last_report.elapsed() >= REPORT_INTERVAL) {
                last_report = Some(Instant::now());
                if !progress(done, total) {
                    stop.store(true, Ordering::Relaxed);
                }
            }
            match receive.recv_timeout(REPORT_INTERVAL) {
                Ok(finished) => {
                    done += finished.len();
                    for (index, result) in finished {
                        results[index] = result;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        progress(done, total);
    });
    if stopped() { Err(Error::Interrupted) } else { Ok(results) }
}
