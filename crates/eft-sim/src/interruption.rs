//! Ends long computations early, for example after Ctrl-C.

use std::cell::Cell;

use crate::{Error, Result};

type GoOn = Box<dyn FnMut() -> bool>;

thread_local! {
    static GO_ON: Cell<Option<GoOn>> = const { Cell::new(None) };
}

/// Restores the question of an outer call, also after a panic.
struct Outer(Option<GoOn>);

impl Drop for Outer {
    fn drop(&mut self) {
        GO_ON.set(self.0.take());
    }
}

/// Runs `work` on this thread. Its long loops call `go_on` many times a second, and end with
/// [`Error::Interrupted`] when it returns `false`.
pub fn interruptible<R>(go_on: impl FnMut() -> bool + 'static, work: impl FnOnce() -> R) -> R {
    let _outer = Outer(GO_ON.replace(Some(Box::new(go_on))));
    work()
}

/// Asks whether to go on, in a long loop.
pub(crate) fn check() -> Result<()> {
    // Taken out during the call, because a signal handler may run a computation of its own.
    let mut go_on = GO_ON.take();
    let goes_on = go_on.as_mut().is_none_or(|ask| ask());
    GO_ON.set(go_on);
    if goes_on { Ok(()) } else { Err(Error::Interrupted) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_ends_when_it_is_asked_to() {
        let count = |most: usize| (0..most).take_while(|_| check().is_ok()).count();
        let mut left = 3;
        let asked = move || {
            left -= 1;
            left >= 0
        };
        // An inner call has a question of its own, and the outer one's returns after it.
        assert_eq!(interruptible(asked, || [interruptible(|| true, || count(9)), count(9)]), [9, 3]);
        assert_eq!(count(9), 9);
    }
}
