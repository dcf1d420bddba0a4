//! What the structure would do under exactly the commanded force: the answer every scheme is judged by.

use crate::closed_loop::simulate::SimulateOptions;
use crate::config::RigConfig;
use crate::error::Result;
use crate::excitation::Command;
use crate::rig::Structure;

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
/// An invalid command or configuration.
pub fn ideal_response(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
) -> Result<IdealResponse> {
    rig.validate()?;
    command.validate()?;
    let structure = Structure::<f64>::pack(|_| rig);
    let steps = options.steps(command.sample_rate)?;
    let step = 1.0 / (command.sample_rate * f64::from(steps));
    let (mut x, mut v) = (0.0, 0.0);
    let mut ideal = IdealResponse {
        displacement: Vec::with_capacity(command.values.len()),
        velocity: Vec::with_capacity(command.values.len()),
    };
    for (i, &now) in command.values.iter().enumerate() {
        ideal.displacement.push(x);
        ideal.velocity.push(v);
        let next = command.values.get(i + 1).copied().unwrap_or(now);
        for n in 0..steps {
            let force = |part: f64| now + (next - now) * (f64::from(n) + part) / f64::from(steps);
            let a1 = structure.acceleration(force(0.0), x, v);
            let v2 = v + step / 2.0 * a1;
            let a2 = structure.acceleration(force(0.5), x + step / 2.0 * v, v2);
            let v3 = v + step / 2.0 * a2;
            let a3 = structure.acceleration(force(0.5), x + step / 2.0 * v2, v3);
            let v4 = v + step * a3;
            let a4 = structure.acceleration(force(1.0), x + step * v3, v4);
            x += step / 6.0 * (v + 2.0 * (v2 + v3) + v4);
            v += step / 6.0 * (a1 + 2.0 * (a2 + a3) + a4);
        }
    }
    Ok(ideal)
}
