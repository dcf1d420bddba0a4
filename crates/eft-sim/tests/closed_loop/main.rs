//! Whole tests through the public interface, so that the closed loops are compiled once, in the library.
#![allow(clippy::unwrap_used)]

mod batch;
mod experiments;
mod fine_tuning;
mod instruments;
mod latencies;
mod overlap;
mod processor_in_the_loop;
mod replay;
mod simulate;
mod stepper;
mod traces;
mod virtual_rig;
