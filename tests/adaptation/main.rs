//! Self-calibration: its accuracy, and its behaviour under faults.
#![allow(clippy::unwrap_used)]

mod attacks;
mod feedforward;
mod flow_curve;
mod measurements_only;
#[path = "../results/mod.rs"]
mod results;
mod rigs;
mod self_calibration;
mod sensor_faults;
mod structures;
mod tones;
