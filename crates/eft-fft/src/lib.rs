#![doc = include_str!("../README.md")]

use std::cell::RefCell;

use realfft::RealFftPlanner;
pub use realfft::{FftError, num_complex::Complex64};

thread_local! {
    /// Kept, because the tables of a plan cost as much as a transform, and the tests of a study have the same
    /// length.
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// One-sided, unnormalised spectrum of a real signal followed by zeros up to `length` samples: bins 0 to `length/2`.
///
/// # Errors
/// A signal longer than `length`.
pub fn spectrum(signal: &[f64], length: usize) -> Result<Vec<Complex64>, FftError> {
    let plan = PLANNER.with_borrow_mut(|planner| planner.plan_fft_forward(length));
    let mut input = plan.make_input_vec();
    let samples = input.get_mut(..signal.len()).ok_or(FftError::InputBuffer(length, signal.len()))?;
    samples.copy_from_slice(signal);
    let mut output = plan.make_output_vec();
    plan.process(&mut input, &mut output)?;
    Ok(output)
}

/// The real signal of `length` samples that has a one-sided spectrum; `length` times too large, as usual for
/// an FFT.
///
/// # Errors
/// The number of bins is not `length/2 + 1`, or the first or last bin is not real as for a real signal.
pub fn signal(mut spectrum: Vec<Complex64>, length: usize) -> Result<Vec<f64>, FftError> {
    let plan = PLANNER.with_borrow_mut(|planner| planner.plan_fft_inverse(length));
    let mut output = plan.make_output_vec();
    plan.process(&mut spectrum, &mut output)?;
    Ok(output)
}
