//! Metrics of a measured force and its command; every function takes two slices of equal length.
//!
//! Invalid input (empty, unequal, not finite, a command that is zero throughout) is an error; no function
//! returns NaN.

mod coherence;
mod delay;
mod error_norms;
mod fei;
mod fft_ratio;
mod norms;
mod oscillation;
mod pair;
mod row;
mod summary;

pub use coherence::{Coherence, coherence};
pub use delay::delay;
pub use error_norms::nrmse;
pub use fft_ratio::{FftRatio, fft_ratio};
pub(crate) use norms::{BLOCK, Norms};
pub use oscillation::OIL_COLUMN;
pub use row::{Actuator, METRICS, Metric, Row, rows, worst};
pub(crate) use row::{Summed, Sums, judge, summed};
pub use summary::Metrics;
