//! Your board: settings on which the number of cycles depends.

/// Set the clock, the wait states of the flash and the caches as in your product. Without a change the processor runs
/// as after reset: at a low clock, at which many flashes need no wait states, and without caches.
pub fn start() {}
