//! How well a measured force followed its command ; every function takes two equal slices.
//!
//! Input that has no answer (empty, unequal, not finite, a command that is zero throughout) is an error;
//! nothing here returns a NaN.

mod error_norms;
mod pair;
mod spectrum;

pub use error_norms::{nrmse, nrmse_bias_free, peak_error};
pub use spectrum::{FftRatio, fft_ratio};
