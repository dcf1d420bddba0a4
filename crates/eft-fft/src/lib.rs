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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_are_those_of_the_definition() {
        for length in [1, 2, 5, 12, 27, 30] {
            let samples: Vec<f64> = (0..9.min(length)).map(|n| ((n * n) as f64).sin()).collect();
            for (k, bin) in spectrum(&samples, length).unwrap().into_iter().enumerate() {
                let turn = |n: usize| Complex64::cis(-std::f64::consts::TAU * (n * k) as f64 / length as f64);
                let expected: Complex64 = samples.iter().enumerate().map(|(n, x)| turn(n) * x).sum();
                assert!((bin - expected).norm() < 1e-13, "{length} {k}: {bin} {expected}");
            }
        }
    }

    #[test]
    fn back_is_the_signal_times_its_length() {
        for length in [1, 6, 7, 64] {
            let samples: Vec<f64> = (0..length).map(|n| (n as f64).cos()).collect();
            let back = signal(spectrum(&samples, length).unwrap(), length).unwrap();
            let close = |(x, y): (&f64, &f64)| (x * length as f64 - y).abs() < 1e-12;
            assert!(samples.iter().zip(&back).all(close), "{length}: {back:?}");
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        assert!(spectrum(&[1.0; 5], 4).is_err());
        assert!(signal(vec![Complex64::default(); 3], 8).is_err());
        assert!(signal(vec![Complex64::new(0.0, 1.0); 5], 8).is_err());
    }
}
