//! What the structure would do under exactly the commanded force: the answer every scheme is judged by.

use crate::closed_loop::simulate::{SimulateOptions, one_actuator};
use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::excitation::Command;
use crate::rig::{Specimen, Vector, longest_step, runge_kutta};

/// Motion of the structure alone, one value per command sample.
#[derive(Debug, Clone, PartialEq)]
pub struct IdealResponse {
    /// Displacement (m).
    pub displacement: Vec<f64>,
    /// Velocity (m/s).
    pub velocity: Vec<f64>,
}

/// The structure's response to the command itself, linear between samples; classical Runge–Kutta steps no longer
/// than the options' largest step.
///
/// # Errors
/// An invalid command, or a structure too stiff for the step, whose motion grows without bound.
pub fn ideal_response(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
) -> Result<IdealResponse> {
    one_actuator(rig)?;
    command.validate()?;
    let specimen = Specimen::<f64>::pack(|_| rig);
    let steps = options.steps(command.sample_rate)?.max(needed_steps(rig, command.sample_rate)?);
    let step = 1.0 / (command.sample_rate * f64::from(steps));
    let mut motion = Motion::default();
    let mut ideal = IdealResponse {
        displacement: Vec::with_capacity(command.values.len()),
        velocity: Vec::with_capacity(command.values.len()),
    };
    for (i, &now) in command.values.iter().enumerate() {
        ideal.displacement.push(motion.displacement);
        ideal.velocity.push(motion.velocity);
        let rate = (command.values.get(i + 1).copied().unwrap_or(now) - now) * command.sample_rate;
        for n in 0..steps {
            motion = runge_kutta(motion, f64::from(n) * step, step, |at, time| Motion {
                displacement: at.velocity,
                velocity: specimen.acceleration(
                    now + rate * time,
                    at.displacement,
                    at.velocity,
                    at.hysteresis,
                ),
                hysteresis: specimen.hysteresis_rate(at.velocity, at.hysteresis),
            });
        }
        if !(motion.displacement.is_finite() && motion.velocity.is_finite()) {
            let allowed =
                format!("must be short enough for the structure: its motion has no end at sample {i}");
            return Err(Error::value("largest_step", step, allowed));
        }
    }
    Ok(ideal)
}

/// Steps per tick without which the structure's own parts would not be followed.
fn needed_steps(rig: &RigConfig, sample_rate: f64) -> Result<u32> {
    let largest_step = longest_step(rig).min(1.0 / sample_rate);
    SimulateOptions { largest_step, ..SimulateOptions::default() }.steps(sample_rate)
}

/// The structure's state.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    displacement: f64,
    velocity: f64,
    hysteresis: f64,
}

impl Vector<f64> for Motion {
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            displacement: f(self.displacement, other.displacement),
            velocity: f(self.velocity, other.velocity),
            hysteresis: f(self.hysteresis, other.hysteresis),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{RigValues, StructureKind};

    fn respond(rig: &RigConfig, command: &Command) -> Result<IdealResponse> {
        ideal_response(rig, command, &SimulateOptions::default())
    }

    fn linear(damping: f64) -> RigConfig {
        let set = |rig: &mut RigValues| {
            rig.structure.kind = StructureKind::Linear;
            rig.structure.damping = damping;
        };
        RigConfig::zhao2005().with(set).unwrap()
    }

    #[test]
    fn a_constant_force_gives_the_damped_step_response() {
        let rig = linear(4330.0);
        let (m, c, k) = (rig.structure.mass, rig.structure.damping, rig.structure.stiffness);
        let command = Command::new(vec![10e3; 4096], 512.0).unwrap();
        let response = respond(&rig, &command).unwrap();
        let omega = (k / m).sqrt();
        let zeta = c / (2.0 * (k * m).sqrt());
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let scale = 10e3 / k;
        for (t, x) in command.time().into_iter().zip(&response.displacement) {
            let (sin, cos) = (damped * t).sin_cos();
            let exact = 1.0 - (-zeta * omega * t).exp() * (cos + zeta * omega / damped * sin);
            assert!((x / scale - exact).abs() < 1e-7, "{t} s: {x} instead of {}", exact * scale);
        }
    }

    #[test]
    fn a_ramp_is_linear_between_samples() {
        // x = a·(t − sin(ωt)/ω)/k for F = a·t without damping: exact only if the force has no steps.
        let rig = linear(0.0);
        let (m, k) = (rig.structure.mass, rig.structure.stiffness);
        let omega = (k / m).sqrt();
        let command = Command::new((0..20).map(|i| f64::from(i) * 1e3).collect(), 4.0).unwrap();
        let response = respond(&rig, &command).unwrap();
        for (t, x) in command.time().into_iter().zip(&response.displacement) {
            let exact = 4e3 * (t - (omega * t).sin() / omega) / k;
            assert!((x - exact).abs() < 1e-7 * 20e3 / k, "{t} s");
        }
    }

    #[test]
    fn a_softening_spring_keeps_the_energy() {
        let rig = RigConfig::zhao2005().with(|rig| rig.structure.damping = 0.0).unwrap();
        // From rest under a constant force F, the work F·x is kinetic and spring energy.
        let force = 15e3;
        let response = respond(&rig, &Command::new(vec![force; 2000], 500.0).unwrap()).unwrap();
        assert!(response.displacement.iter().any(|x| *x > 0.03), "it must reach the soft part");
        let spring = |x: f64| {
            let (k, soft) = (693.8e3, 350e3);
            let beyond = (x.abs() - 0.025).max(0.0);
            0.5 * k * x * x - 0.5 * (k - soft) * beyond * beyond
        };
        for (x, v) in response.displacement.iter().zip(&response.velocity) {
            let energy = 0.5 * 7040.0 * v * v + spring(*x) - force * x;
            assert!(energy.abs() < 1e-5 * force * 0.05, "{energy} J at {x} m");
        }
    }

    #[test]
    fn what_cannot_be_integrated_is_refused() {
        let stiff = |rig: &mut RigValues| (rig.structure.mass, rig.structure.stiffness) = (1e-3, 1e15);
        let rig = linear(0.0).with(stiff).unwrap();
        let error = respond(&rig, &Command::new(vec![1.0; 100], 1.0).unwrap()).unwrap_err();
        assert!(error.to_string().starts_with("largest_step = "), "{error}");
    }
}
