//! Real Fourier transforms, forward and back.

use crate::error::{Error, Result};
use realfft::num_complex::Complex64;
use realfft::{FftError, RealFftPlanner};
use std::cell::RefCell;

thread_local! {
    /// Plans hold twiddle tables that cost as much as a transform; tests of a study share their length.
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// One-sided, unnormalised spectrum of a real signal: bins 0 to `n/2`.
pub(super) fn spectrum(signal: &[f64]) -> Result<Vec<Complex64>> {
    padded_spectrum(signal, signal.len())
}

/// [`spectrum`] of a signal followed by zeros up to `length`.
pub(super) fn padded_spectrum(signal: &[f64], length: usize) -> Result<Vec<Complex64>> {
    let plan = PLANNER.with_borrow_mut(|planner| planner.plan_fft_forward(length));
    let mut input = plan.make_input_vec();
    input[..signal.len()].copy_from_slice(signal);
    let mut output = plan.make_output_vec();
    plan.process(&mut input, &mut output).map_err(|error| wrong_size(length, &error))?;
    Ok(output)
}

/// The real signal of `length` samples that has a one-sided spectrum; `length` times too large, as FFTs are.
pub(super) fn signal_of(mut spectrum: Vec<Complex64>, length: usize) -> Result<Vec<f64>> {
    let plan = PLANNER.with_borrow_mut(|planner| planner.plan_fft_inverse(length));
    let mut output = plan.make_output_vec();
    plan.process(&mut spectrum, &mut output).map_err(|error| wrong_size(length, &error))?;
    Ok(output)
}

fn wrong_size(length: usize, error: &FftError) -> Error {
    Error::value("signal", format!("{length} samples"), error.to_string())
}
