//! Metrics of a measured force and its command; every function takes two slices of equal length.
//!
//! Invalid input (empty, unequal, not finite, a command that is zero throughout) is an error. Only an undefined one of
//! the [`Metrics`] is NaN.

mod actuator;
mod coherence;
mod delay;
mod fei;
mod fft_ratio;
mod force;
mod norms;
mod oscillation;
mod pair;
mod table;

pub use actuator::{Actuator, rows};
pub(crate) use actuator::{Summed, Sums, judge, summed};
pub use coherence::{Coherence, coherence};
pub use delay::delay;
pub use fft_ratio::{FftRatio, fft_ratio};
pub use norms::nrmse;
pub(crate) use norms::{BLOCK, Norms};
pub use oscillation::OIL_COLUMN;
pub use table::{METRICS, Metric, Metrics, worst};
