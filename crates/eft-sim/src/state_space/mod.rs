//! Linear models in state space and their analysis.

pub(crate) mod matrices;
mod qr;
mod responses;

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix};

use self::matrices::eigenvalues;
pub(crate) use self::responses::Responses;
use crate::{Error, Result, checks};

/// Growth rate (1/s) up to which a mode counts as one at rest: a structure without a spring and an integral part have a
/// pole at the origin.
pub(crate) const AT_REST: f64 = 1e-9;

/// `ẋ = A·x + B·u`, `y = C·x + D·u`, or the same with the next sample on the left side. `u` is the force
/// command (N); a building has one per floor.
///
/// Outputs: force (N), displacement (m), velocity (m/s), spool opening (1), load pressure (Pa); of a sampled
/// model also the compensation signal (V). The names of a building end with the number of the actuator, from
/// 1.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StateSpace {
    /// State matrix.
    pub a: DMatrix<f64>,
    /// Input matrix, one column for each of `inputs`.
    pub b: DMatrix<f64>,
    /// Output matrix, one row for each of `outputs`.
    pub c: DMatrix<f64>,
    /// Feedthrough.
    pub d: DMatrix<f64>,
    /// Names of the states.
    pub states: Vec<String>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Keys of the rig whose effect on small signals the model does not contain.
    pub left_out: Vec<String>,
    /// Time between samples (s); `None` in continuous time.
    pub sample_time: Option<f64>,
}

/// The rows of the outputs with these names that are a quantity, one for each actuator.
pub(crate) fn rows_of(outputs: &[String], quantity: &str) -> impl Iterator<Item = usize> {
    let named = outputs.iter().enumerate();
    named.filter(move |(_, name)| name.split('_').next() == Some(quantity)).map(|(row, _)| row)
}

/// One pole, as an oscillation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// The pole in continuous time (1/s); for a sampled model the logarithm of its pole over the sample time.
    pub pole: Complex<f64>,
    /// Natural frequency `|s|/2π` (Hz).
    pub frequency: f64,
    /// Damping ratio `−Re s/|s|` (1); negative if the mode grows.
    pub damping: f64,
}

impl StateSpace {
    /// Poles (1/s), by magnitude; those of a sampled model are in the z-plane (1).
    ///
    /// # Errors
    /// Entries beyond double precision, or a QR iteration that does not converge on them.
    pub fn poles(&self) -> Result<Vec<Complex<f64>>> {
        eigenvalues(&self.a)
    }

    /// The poles as oscillations, by natural frequency; poles that vanish within a sample are left out.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn modes(&self) -> Result<Vec<Mode>> {
        let continuous = |pole: Complex<f64>| match self.sample_time {
            None => pole,
            Some(step) => pole.ln() / step,
        };
        let mut modes: Vec<_> = self
            .poles()?
            .into_iter()
            .filter(|pole| self.sample_time.is_none() || pole.norm() > 1e-12)
            .map(continuous)
            .map(|pole| Mode { pole, frequency: pole.norm() / TAU, damping: -pole.re / pole.norm() })
            .collect();
        modes.sort_by(|a, b| a.frequency.total_cmp(&b.frequency).then(a.pole.im.total_cmp(&b.pole.im)));
        Ok(modes)
    }

    /// Growth rate (1/s) of the least damped mode: the loop is stable if it is negative.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn growth_rate(&self) -> Result<f64> {
        let poles = self.poles()?;
        let rate = |pole: &Complex<f64>| match self.sample_time {
            None => pole.re,
            Some(step) => libm::log(pole.norm()) / step,
        };
        Ok(poles.iter().map(rate).fold(f64::NEG_INFINITY, f64::max))
    }

    /// The stability in words, with the growth rate.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn stability(&self) -> Result<String> {
        let rate = self.growth_rate()?;
        Ok(match rate {
            _ if rate.abs() <= AT_REST => "marginally stable".into(),
            _ if rate < 0.0 => format!("stable, slowest decay {}", per_second(-rate)),
            _ => format!("unstable, grows at {}", per_second(rate)),
        })
    }

    /// Response of an output to the first input at a frequency (Hz), in the output's unit per N.
    ///
    /// # Errors
    /// As [`response_to`](Self::response_to).
    pub fn response(&self, output: &str, frequency: f64) -> Result<Complex<f64>> {
        self.response_to(self.inputs.first().map_or("", String::as_str), output, frequency)
    }

    /// Response of an output to an input at a frequency (Hz), in the output's unit per N.
    ///
    /// # Errors
    /// An input or output that the model does not have, or a frequency that is not finite, negative, or on a
    /// pole.
    pub fn response_to(&self, input: &str, output: &str, frequency: f64) -> Result<Complex<f64>> {
        let place = |kind: &str, name: &str, names: &[String]| {
            let allowed = || Error::value(kind, name, format!("must be one of {}", names.join(", ")));
            names.iter().position(|known| known == name).ok_or_else(allowed)
        };
        let (row, column) = (place("output", output, &self.outputs)?, place("input", input, &self.inputs)?);
        checks::finite("frequency", frequency, "Hz")?;
        let variable = match self.sample_time {
            None => Complex::new(0.0, TAU * frequency),
            Some(step) => Complex::from_polar(1.0, TAU * frequency * step),
        };
        let n = self.a.nrows();
        let system =
            DMatrix::from_diagonal_element(n, n, variable) - self.a.map(|entry| Complex::new(entry, 0.0));
        let state = system
            .lu()
            .solve(&self.b.column(column).map(|entry| Complex::new(entry, 0.0)))
            .ok_or_else(|| Error::value("frequency", frequency, "must not lie on a pole of the model"))?;
        let answer = self.c.row(row).iter().zip(state.iter()).map(|(c, x)| x * *c).sum::<Complex<f64>>();
        Ok(answer + self.d[(row, column)])
    }
}

/// A rate (1/s) with its first digits.
pub(crate) fn per_second(rate: f64) -> String {
    if rate < 0.01 { format!("{rate:.2e} 1/s") } else { format!("{rate:.4} 1/s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass of 2 kg on a spring of 800 N/m with 5 % of critical damping, with force as input and
    /// displacement as output.
    fn oscillator() -> StateSpace {
        let (m, c, k) = (2.0, 2.0 * 0.05 * 40.0, 800.0);
        StateSpace {
            a: DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -k / m, -c / m]),
            b: DMatrix::from_row_slice(2, 1, &[0.0, 1.0 / m]),
            c: DMatrix::from_row_slice(1, 2, &[1.0, 0.0]),
            d: DMatrix::zeros(1, 1),
            states: vec!["x".into(), "v".into()],
            inputs: vec!["force".into()],
            outputs: vec!["displacement".into()],
            left_out: Vec::new(),
            sample_time: None,
        }
    }

    #[test]
    fn an_oscillator_has_its_mode_and_its_response() {
        let model = oscillator();
        let modes = model.modes().unwrap();
        assert!((modes[0].frequency - 20.0 / TAU).abs() < 1e-14 && (modes[1].damping - 0.05).abs() < 1e-15);
        assert!((model.growth_rate().unwrap() + 1.0).abs() < 1e-14);
        for frequency in [0.0, 1.0, 3.2, 50.0] {
            let s = Complex::new(0.0, TAU * frequency);
            let expected = (s * s * 2.0 + s * 4.0 + 800.0).inv();
            let error = model.response("displacement", frequency).unwrap() - expected;
            assert!(error.norm() < 1e-14 * expected.norm().max(1e-3));
        }
    }

    #[test]
    fn the_stability_is_told_with_the_digits_of_its_rate() {
        let told = |pole: f64| {
            let (a, one) = (DMatrix::from_element(1, 1, pole), DMatrix::from_element(1, 1, 1.0));
            let states = vec!["x".into()];
            StateSpace { a, b: one.clone(), c: one.clone(), d: one, states, ..oscillator() }
                .stability()
                .unwrap()
        };
        assert_eq!(told(-0.28841), "stable, slowest decay 0.2884 1/s");
        assert_eq!(told(1.234e-5), "unstable, grows at 1.23e-5 1/s");
        assert_eq!([told(3e-13), told(-3e-13)], ["marginally stable"; 2]);
    }

    #[test]
    fn unknown_outputs_and_bad_frequencies_are_named() {
        let text = |output, frequency| oscillator().response(output, frequency).unwrap_err().to_string();
        assert!(text("force", 1.0).starts_with("output = force: must be one of displacement"));
        assert!(text("displacement", f64::NAN).starts_with("frequency = NaN"));
    }
}
