//! The response of the structure to exactly the commanded force, with which every scheme is compared.

use crate::closed_loop::linear_motion::LinearMotion;
use crate::closed_loop::simulate::{SimulateOptions, check_commands, one_actuator};
use crate::config::{RigConfig, StructureKind};
use crate::ground_motion::excitation::Command;
use crate::plant::{Equations, Motion, Stages, Structure, TimeGrid, linear_up_to, runge_kutta};
use crate::{Error, Result, interruption};

/// Motion of the structure alone, one value per command sample.
#[derive(Debug, Clone, PartialEq)]
pub struct IdealResponse {
    /// Displacement (m).
    pub displacement: Vec<f64>,
    /// Velocity (m/s).
    pub velocity: Vec<f64>,
}

/// The structure's response to the command, which is linear between samples.
///
/// A linear structure takes exact steps from sample to sample. Other structures take Runge–Kutta steps at most
/// as long as the options' largest step. Where the displacement is below the softening one at both ends of a
/// step, the structure is linear in it, and the step is exact.
///
/// # Errors
/// As [`ideal_responses`], or a building, which needs one command per story.
pub fn ideal_response(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
) -> Result<IdealResponse> {
    one_actuator(rig)?;
    Ok(ideal_responses(rig, std::slice::from_ref(command), options)?.swap_remove(0))
}

/// As [`ideal_response`], under one command per actuator, the ground floor's first. It returns one response
/// per actuator.
///
/// # Errors
/// An invalid command, a wrong number of commands, commands of different lengths or rates, or a structure too
/// stiff for the step, whose motion grows without bound.
pub fn ideal_responses(
    rig: &RigConfig,
    commands: &[Command],
    options: &SimulateOptions,
) -> Result<Vec<IdealResponse>> {
    let (sample_rate, samples) = check_commands(rig, commands)?;
    let grid = options.grid(rig, sample_rate)?;
    let at_rest = vec![Motion::default(); commands.len()];
    let force = |i: usize, floor: usize| {
        let values = &commands[floor].values;
        let now = values[i];
        [now, (values.get(i + 1).copied().unwrap_or(now) - now) * sample_rate]
    };
    let responses = motions(rig, &at_rest, samples, grid, force)?;
    let finite =
        |i: usize| responses.iter().all(|r| r.displacement[i].is_finite() && r.velocity[i].is_finite());
    let Some(i) = (0..samples).find(|&i| !finite(i)) else { return Ok(responses) };
    let (key, mass) = lightest(rig);
    let allowed = format!(
        "must be larger, or its damping or stiffness smaller, or `largest_step` or the command's step shorter: the motion \
         grows without bound at sample {}, computed in steps of {:.3e} s",
        i - 1,
        grid.step
    );
    Err(Error::value(key, mass, allowed))
}

/// The smallest mass (kg) of a structure, with its key.
fn lightest(rig: &RigConfig) -> (&'static str, f64) {
    let structure = &rig.structure;
    match (structure.kind, &structure.stories) {
        (StructureKind::ShearBuilding, Some(stories)) => {
            ("structure.stories.masses", stories.masses.iter().copied().fold(f64::INFINITY, f64::min))
        }
        _ => ("structure.mass", structure.mass),
    }
}

/// The motion of a rig's structure from `start` on under forces. `force(i, floor)` returns the force on a floor
/// at sample `i` (N) and its rate until the next sample (N/s).
pub(crate) fn motions(
    rig: &RigConfig,
    start: &[Motion<f64>],
    samples: usize,
    grid: TimeGrid,
    force: impl Fn(usize, usize) -> [f64; 2],
) -> Result<Vec<IdealResponse>> {
    let floors: Vec<[f64; 3]> = start.iter().map(|motion| motion.to_array()).collect();
    match *floors {
        // A state of known length is faster by a third.
        [one] => motions_from(rig, one, samples, grid, force),
        _ => motions_from(rig, floors.concat(), samples, grid, force),
    }
}

/// As [`motions`], from the state of every floor.
fn motions_from<X: Clone + AsRef<[f64]> + AsMut<[f64]>>(
    rig: &RigConfig,
    mut state: X,
    samples: usize,
    mut grid: TimeGrid,
    force: impl Fn(usize, usize) -> [f64; 2],
) -> Result<Vec<IdealResponse>> {
    let structure = &Structure::pack(&|_| rig);
    let trace = || Vec::with_capacity(samples);
    let response = |_| IdealResponse { displacement: trace(), velocity: trace() };
    let mut responses: Vec<_> = (0..structure.len()).map(response).collect();
    let limit = linear_up_to(rig);
    let linear =
        |step: f64| LinearMotion::new(&state, step, limit, |at, floor| unit_rates(structure, at, floor));
    let whole_sample = linear(1.0 / grid.sample_rate).filter(|_| limit == f64::INFINITY);
    if whole_sample.is_some() {
        grid = TimeGrid::new(grid.sample_rate, 1);
    }
    let linear = whole_sample.or_else(|| linear(grid.step));
    let (mut stages, mut next) = (Stages::new(&state), state.clone());
    for i in 0..samples {
        if i.is_multiple_of(grid.ticks_per_check()) {
            interruption::check()?;
        }
        let floors = state.as_ref().as_chunks().0;
        for (floor, response) in responses.iter_mut().enumerate() {
            let [displacement, velocity, _] = floors[floor];
            response.displacement.push(displacement);
            response.velocity.push(velocity);
        }
        let mut equations = Forced { structure, force: |floor| force(i, floor) };
        for n in 0..grid.steps {
            let start = f64::from(n) * grid.step;
            let over_step = |floor| {
                let [now, slope] = force(i, floor);
                [now + slope * start, slope * grid.step]
            };
            if linear.as_ref().is_some_and(|linear| linear.step(&state, &mut next, over_step)) {
                std::mem::swap(&mut state, &mut next);
            } else {
                runge_kutta(state.as_mut(), &mut stages, start, grid.step, &mut equations);
            }
        }
    }
    Ok(responses)
}

/// The rates of a state under 1 N on one floor or on none.
fn unit_rates(structure: &Structure<f64>, state: &[f64], pushed: Option<usize>) -> Vec<f64> {
    let force = |floor| [if pushed == Some(floor) { 1.0 } else { 0.0 }, 0.0];
    let mut rates = vec![0.0; state.len()];
    Forced { structure, force }.rate(state, 0.0, &mut rates);
    rates
}

/// A structure under forces that are linear in time.
struct Forced<'a, F> {
    structure: &'a Structure<f64>,
    /// On each floor: force (N) now, and its rate (N/s).
    force: F,
}

impl<F: Fn(usize) -> [f64; 2]> Equations<f64> for Forced<'_, F> {
    #[inline(always)]
    fn rate(&mut self, state: &[f64], time: f64, rate: &mut [f64]) {
        let Self { structure, force } = self;
        let (motions, rates) = (state.as_chunks().0, rate.as_chunks_mut().0);
        let motion = |i: usize| Motion::from_array(motions[i]);
        structure.accelerations(
            |i| {
                let [now, slope] = force(i);
                now + slope * time
            },
            motion,
            |i, acceleration| {
                rates[i] = [motion(i).velocity, acceleration, structure.hysteresis_rate(i, motion)];
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{RigValues, StructureKind};
    use crate::ground_motion::excitation::sine_sweep;

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
            assert!((x / scale - exact).abs() < 1e-11, "{t} s: {x} instead of {}", exact * scale);
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
            assert!((x - exact).abs() < 1e-12 * 20e3 / k, "{t} s");
        }
    }

    /// Linear and softening structures and a building, with commands of which one softens the spring.
    fn structures() -> [(RigConfig, Vec<Command>); 3] {
        let building = RigConfig::zhao2005()
            .replace(&[
                ("structure.kind", "shear_building".into()),
                ("structure.stories.masses", vec![7040.0, 6000.0, 3000.0].into()),
                ("structure.stories.dampings", vec![4330.0, 0.0, 2e3].into()),
                ("structure.stories.stiffnesses", vec![9e5, 6e5, 4e5].into()),
            ])
            .unwrap();
        let sweep = |amplitude| sine_sweep(amplitude, 0.5, 4.0, 8.0, 256.0).unwrap();
        [
            (linear(4330.0), vec![sweep(9e3)]),
            (RigConfig::zhao2005(), vec![sweep(9e3)]),
            (building, vec![sweep(3e3), sweep(-1e3), sweep(2e3)]),
        ]
    }

    #[test]
    fn exact_steps_agree_with_runge_kutta() {
        for (rig, commands) in structures() {
            let found = ideal_responses(&rig, &commands, &SimulateOptions::default()).unwrap();
            let structure = Structure::<f64>::pack(&|_| &rig);
            let mut state = vec![0.0; 3 * commands.len()];
            let mut stages = Stages::new(&state);
            let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            // The step with a kink of the spring is less accurate.
            let tolerance = if rig.structure.kind == StructureKind::Bilinear { 1e-6 } else { 1e-11 };
            let steps = 64;
            for i in 0..commands[0].values.len() - 1 {
                for (floor, response) in found.iter().enumerate() {
                    let [x, v, _] = state.as_chunks().0[floor];
                    for (found, expected, all) in [
                        (response.displacement[i], x, &response.displacement),
                        (response.velocity[i], v, &response.velocity),
                    ] {
                        let error = (found - expected).abs() / largest(all);
                        assert!(
                            error < tolerance,
                            "{:?}, sample {i}, floor {floor}: {error}",
                            rig.structure.kind
                        );
                    }
                }
                let [now, next] =
                    [i, i + 1].map(|i| commands.iter().map(|c| c.values[i]).collect::<Vec<_>>());
                let force = |floor: usize| [now[floor], (next[floor] - now[floor]) * 256.0];
                let mut equations = Forced { structure: &structure, force };
                let step = 1.0 / 256.0 / f64::from(steps);
                for n in 0..steps {
                    runge_kutta(&mut state, &mut stages, f64::from(n) * step, step, &mut equations);
                }
            }
        }
    }

    #[test]
    fn the_steps_of_a_linear_structure_do_not_matter() {
        for (rig, commands) in structures() {
            let [default, coarse] = [SimulateOptions::default().largest_step, 1.0].map(|largest_step| {
                let options = SimulateOptions { largest_step, ..SimulateOptions::default() };
                ideal_responses(&rig, &commands, &options).unwrap()
            });
            assert_eq!(default == coarse, rig.structure.kind != StructureKind::Bilinear);
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
    fn a_structure_that_cannot_be_integrated_is_refused() {
        let rig = linear(0.0)
            .replace(&[
                ("structure.kind", "bouc_wen".into()),
                ("structure.mass", 1e-3.into()),
                ("structure.stiffness", 1e15.into()),
                ("structure.bouc_wen.yield_displacement", 0.02.into()),
                ("structure.bouc_wen.post_yield_ratio", 0.1.into()),
                ("structure.bouc_wen.exponent", 1.0.into()),
                ("structure.bouc_wen.shape", 0.5.into()),
            ])
            .unwrap();
        let error = respond(&rig, &Command::new(vec![1.0; 100], 1.0).unwrap()).unwrap_err();
        let told = error.to_string();
        assert!(
            told.starts_with("structure.mass = 0.001: must be larger, or its damping or stiffness smaller"),
            "{told}"
        );
        assert!(told.contains("computed in steps of "), "{told}");
    }
}
