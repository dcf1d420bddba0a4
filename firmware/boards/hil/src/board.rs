//! Your board: what has to be set before cycles mean something.

/// Set the clock, the wait states of the flash and the caches as in your product. As it stands the processor runs as
/// after reset: at a low clock, where many flashes need no wait states, and without caches.
pub fn start() {}
