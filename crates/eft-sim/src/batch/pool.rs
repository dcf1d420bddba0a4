//! Worker threads that process pieces of work while the calling thread reports progress.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use crate::error::{Error, Result};

/// Time between two calls of `go_on`.
const PATIENCE: Duration = Duration::from_millis(50);

/// Runs `work(0)` to `work(pieces - 1)`. Each returns some of the `total` results with their places. `work`
/// also receives the flag that tells it to stop.
///
/// # Errors
/// [`Error::Interrupted`] if `go_on(done, total)`, called on the calling thread, returned `false`.
pub(super) fn run<T: Send>(
    threads: usize,
    pieces: usize,
    total: usize,
    work: impl Fn(usize, &dyn Fn() -> bool) -> Vec<(usize, Result<T>)> + Sync,
    mut go_on: impl FnMut(usize, usize) -> bool,
) -> Result<Vec<Result<T>>> {
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let stopped = || stop.load(Ordering::Relaxed);
    let mut results: Vec<_> = (0..total).map(|_| Err(Error::Interrupted)).collect();
    let (send, receive) = channel();
    thread::scope(|scope| {
        for _ in 0..threads.min(pieces) {
            let (send, next, stopped, work) = (send.clone(), &next, &stopped, &work);
            scope.spawn(move || {
                while !stopped() {
                    let piece = next.fetch_add(1, Ordering::Relaxed);
                    if piece >= pieces || send.send(work(piece, stopped)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(send);
        let (mut done, mut asked) = (0, None::<Instant>);
        loop {
            if asked.is_none_or(|asked| asked.elapsed() >= PATIENCE) {
                asked = Some(Instant::now());
                if !go_on(done, total) {
                    stop.store(true, Ordering::Relaxed);
                }
            }
            match receive.recv_timeout(PATIENCE) {
                Ok(finished) => {
                    done += finished.len();
                    for (place, result) in finished {
                        results[place] = result;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        go_on(done, total);
    });
    if stopped() { Err(Error::Interrupted) } else { Ok(results) }
}
