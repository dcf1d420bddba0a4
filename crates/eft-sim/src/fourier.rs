//! Real Fourier transforms, forward and back, with the errors of `eft-fft` as errors of this crate.

pub(crate) use eft_fft::Complex64;
use eft_fft::FftError;

use crate::{Error, Result, interruption};

/// One-sided, unnormalised spectrum of a real signal: bins 0 to `n/2`.
pub(crate) fn spectrum(signal: &[f64]) -> Result<Vec<Complex64>> {
    padded_spectrum(signal, signal.len())
}

/// [`spectrum`] of a signal padded with zeros to `length`.
pub(crate) fn padded_spectrum(signal: &[f64], length: usize) -> Result<Vec<Complex64>> {
    interruption::check()?;
    eft_fft::spectrum(signal, length).map_err(|error| wrong_size(length, &error))
}

/// The real signal of `length` samples that has a one-sided spectrum; `length` times too large, as usual for
/// an FFT.
pub(crate) fn signal_of(spectrum: Vec<Complex64>, length: usize) -> Result<Vec<f64>> {
    interruption::check()?;
    eft_fft::signal(spectrum, length).map_err(|error| wrong_size(length, &error))
}

fn wrong_size(length: usize, error: &FftError) -> Error {
    Error::value("signal", format!("{length} samples"), error.to_string())
}
