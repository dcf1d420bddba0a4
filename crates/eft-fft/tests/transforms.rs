//! The transforms compared with their definition.
#![allow(clippy::unwrap_used)]

use eft_fft::{Complex64, signal, spectrum};

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
