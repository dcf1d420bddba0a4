//! A test of a shear building, each floor with its own actuator, servovalve, sensors and controller.

use eft_core::{ControllerState, status};

use crate::closed_loop::controller::Precision;
use crate::closed_loop::digital_side::{DigitalSide, Driven};
use crate::closed_loop::ideal::IdealResponse;
use crate::closed_loop::simulate::{SimulateOptions, soft_end};
use crate::closed_loop::single::Tick;
use crate::closed_loop::test_run::TestRun;
use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::excitation::{Command, effective_force};
use crate::records::Record;
use crate::rig::{BuildingPlant, Driver, EnergyBalance, ShearBuilding, longest_step};

/// Ticks between two looks at whether to go on.
const CHUNK: usize = 1024;

/// The effective force of a ground motion on each floor, `−mass_i·scale·a_g`.
///
/// # Errors
/// A structure that is no building, or what [`effective_force`] refuses.
pub fn story_forces(rig: &RigConfig, record: &Record, sample_rate: f64, scale: f64) -> Result<Vec<Command>> {
    ShearBuilding::new(rig)?;
    let masses = rig.structure.stories.iter().flat_map(|stories| &stories.masses);
    masses.map(|mass| effective_force(record, *mass, sample_rate, scale)).collect()
}

/// One floor of a building.
struct Floor<'a> {
    plant: &'a BuildingPlant,
    floor: usize,
}

impl Driven<f64> for Floor<'_> {
    fn command(&self, driver: &Driver<f64>) -> f64 {
        self.plant.driven_command(self.floor, driver)
    }
}

/// Runs one command a floor on a rig whose structure is a shear building; one [`TestRun`] a floor, the ground
/// floor's first. Each floor has the rig's actuator, and noise of its own; all share the supply. When the protection
/// of one trips, all others trip at the next sample.
///
/// # Errors
/// As [`simulate`](crate::simulate); not one command a floor, or commands of different lengths or rates.
pub fn simulate_building<P: Precision<Flags = u32>>(
    rig: &RigConfig,
    commands: &[Command],
    options: &SimulateOptions,
    go_on: impl FnMut(usize, usize) -> bool,
) -> Result<Vec<TestRun>> {
    Ok(run_through::<P>(rig, commands, options, go_on)?.0)
}

/// Where the energy of such a test went, all floors together.
///
/// # Errors
/// As [`simulate_building`].
pub fn building_energy_balance(
    rig: &RigConfig,
    commands: &[Command],
    options: &SimulateOptions,
) -> Result<EnergyBalance> {
    Ok(run_through::<f64>(rig, commands, options, |_, _| true)?.1.balance())
}

fn run_through<P: Precision<Flags = u32>>(
    rig: &RigConfig,
    commands: &[Command],
    options: &SimulateOptions,
    mut go_on: impl FnMut(usize, usize) -> bool,
) -> Result<(Vec<TestRun>, BuildingPlant)> {
    let (sample_rate, total) = check(rig, commands)?;
    let steps = steps(rig, options, sample_rate)?;
    let soft_end = soft_end(rig, sample_rate, total);
    let mut plant = BuildingPlant::new(rig)?;
    let floors = 0..commands.len();
    let mut digital: Vec<DigitalSide<f64, P>> = floors
        .clone()
        .map(|floor| DigitalSide::new(|_| rig, sample_rate, floor as u64))
        .collect::<Result<_>>()?;
    let mut states = vec![ControllerState::default(); commands.len()];
    let mut runs: Vec<_> = floors.clone().map(|_| TestRun::with_capacity(rig, sample_rate, total)).collect();
    let mut drivers = Vec::with_capacity(commands.len());
    let mut tripped = false;
    for i in 0..total {
        if i % CHUNK == 0 && !go_on(i, total) {
            return Err(Error::Interrupted);
        }
        if !floors.clone().all(|floor| plant.core(floor).is_bounded()) {
            for last in runs.iter_mut().filter_map(|run| run.status.last_mut()) {
                *last |= status::DIVERGED;
            }
            break;
        }
        drivers.clear();
        if Some(i) == soft_end {
            digital.iter_mut().for_each(DigitalSide::end);
        }
        if tripped {
            // One floor let down alone would twist the others off it.
            digital.iter_mut().for_each(DigitalSide::trip);
        }
        let sides = digital.iter_mut().zip(&mut states);
        for ((floor, command), ((digital, state), run)) in
            commands.iter().enumerate().zip(sides.zip(&mut runs))
        {
            let value = |i: usize| command.values.get(i).copied();
            let now = value(i).unwrap_or_default();
            let truth = plant.signals(floor);
            let next = value(i + 1).unwrap_or(now);
            let decision = digital.sample::<false>(state, now, next, truth, &Floor { plant: &plant, floor });
            let (at_stop, beyond_stroke) = plant.at_limits(floor);
            let mut flags = decision.status;
            tripped |= flags & status::TRIPPED != 0;
            flags |= if at_stop { status::SPOOL_STOP } else { 0 };
            flags |= if beyond_stroke { status::STROKE_EXCEEDED } else { 0 };
            let tick = Tick {
                plant: plant.core(floor),
                force: plant.force(floor),
                supply_pressure: truth.supply_pressure,
                acceleration: truth.acceleration,
                decision,
                status: flags,
            };
            run.extend(&[now]).set(0, &tick, 0);
            drivers.push(tick.decision.driver);
        }
        plant.advance(&drivers, 1.0 / sample_rate, steps, None);
    }
    for (run, side) in runs.iter_mut().zip(&digital) {
        run.learn(|openings| side.found_flows(openings, 0));
    }
    go_on(total, total);
    Ok((runs, plant))
}

/// The building's motion under exactly the commanded forces, one response a floor.
///
/// # Errors
/// As [`simulate_building`].
pub fn ideal_building_response(
    rig: &RigConfig,
    commands: &[Command],
    options: &SimulateOptions,
) -> Result<Vec<IdealResponse>> {
    let (sample_rate, total) = check(rig, commands)?;
    let building = ShearBuilding::new(rig)?;
    let steps = steps(rig, options, sample_rate)?;
    let step = 1.0 / (sample_rate * f64::from(steps));
    let n = commands.len();
    // Displacements, then velocities.
    let mut state = vec![0.0; 2 * n];
    let mut rates = vec![vec![0.0; 2 * n]; 4];
    let mut stage = state.clone();
    let mut responses = vec![IdealResponse { displacement: Vec::new(), velocity: Vec::new() }; n];
    for i in 0..total {
        for (floor, response) in responses.iter_mut().enumerate() {
            response.displacement.push(state[floor]);
            response.velocity.push(state[n + floor]);
        }
        for part in 0..steps {
            let force = |floor: usize, share: f64| {
                let values = &commands[floor].values;
                let now = values[i];
                let next = values.get(i + 1).copied().unwrap_or(now);
                now + (next - now) * (f64::from(part) + share) / f64::from(steps)
            };
            for (k, share) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
                for j in 0..2 * n {
                    stage[j] = state[j] + if k > 0 { share * step * rates[k - 1][j] } else { 0.0 };
                }
                let rate = &mut rates[k];
                rate[..n].copy_from_slice(&stage[n..]);
                building.accelerations(
                    |floor| force(floor, share),
                    |floor| (stage[floor], stage[n + floor]),
                    |floor, acceleration| rate[n + floor] = acceleration,
                );
            }
            for (j, x) in state.iter_mut().enumerate() {
                *x += step / 6.0 * (rates[0][j] + 2.0 * (rates[1][j] + rates[2][j]) + rates[3][j]);
            }
        }
    }
    Ok(responses)
}

fn check(rig: &RigConfig, commands: &[Command]) -> Result<(f64, usize)> {
    let stories = ShearBuilding::new(rig)?.len();
    let count =
        || Error::value("commands", commands.len(), format!("must be one for each of {stories} stories"));
    if commands.len() != stories {
        return Err(count());
    }
    let first = commands.first().ok_or_else(count)?;
    for command in commands {
        command.validate()?;
        if command.sample_rate != first.sample_rate || command.values.len() != first.values.len() {
            let found = format!("{} samples at {} Hz", command.values.len(), command.sample_rate);
            let allowed = format!("must all have {} samples at {} Hz", first.values.len(), first.sample_rate);
            return Err(Error::value("commands", found, allowed));
        }
    }
    Ok((first.sample_rate, first.values.len()))
}

/// Steps per tick: the options', or what the effects and the building's fastest mode need.
pub(crate) fn steps(rig: &RigConfig, options: &SimulateOptions, sample_rate: f64) -> Result<u32> {
    let asked = options.steps(sample_rate)?;
    let building = 0.2 / ShearBuilding::new(rig)?.fastest_rate();
    let largest_step = longest_step(rig).min(building).min(options.largest_step);
    Ok(SimulateOptions { largest_step, ..*options }.steps(sample_rate)?.max(asked))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_loop::Method;
    use crate::excitation::sine_sweep;
    use crate::simulate;

    const RATE: f64 = 2048.0;

    fn building(stories: usize, changes: &[(&str, toml::Value)]) -> RigConfig {
        let list = |value: f64| toml::Value::Array(vec![value.into(); stories]);
        let mut all = vec![
            ("structure.kind", "shear_building".into()),
            ("structure.stories.masses", list(7040.0)),
            ("structure.stories.dampings", list(4330.0)),
            ("structure.stories.stiffnesses", list(693.8e3)),
        ];
        all.extend(changes.iter().cloned());
        RigConfig::zhao2005().replace(&all).unwrap()
    }

    fn run(rig: &RigConfig, commands: &[Command]) -> Vec<TestRun> {
        simulate_building::<f64>(rig, commands, &SimulateOptions::default(), |_, _| true).unwrap()
    }

    #[test]
    fn one_story_is_the_linear_structure() {
        let command = sine_sweep(8900.0, 0.0, 10.0, 4.0, RATE).unwrap();
        for realization in ["analog", "digital"] {
            let changes = [
                ("controller.realization", toml::Value::from(realization)),
                ("sensors.force.noise", 20.0.into()),
            ];
            let one = run(&building(1, &changes), std::slice::from_ref(&command)).remove(0);
            let rig =
                building(1, &changes).replace(&[("structure.kind", toml::Value::from("linear"))]).unwrap();
            // The building's own method, or the two would differ by the error of both.
            let options = SimulateOptions { method: Method::RungeKutta, ..SimulateOptions::default() };
            let single = simulate::<f64>(&rig, &command, &options, |_, _| true).unwrap();
            let distance =
                one.force.iter().zip(&single.force).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
            assert!(distance < 1e-6, "{realization}: {distance} N");
        }
    }

    #[test]
    fn every_actuator_has_noise_of_its_own() {
        let command = sine_sweep(2000.0, 0.0, 10.0, 0.5, RATE).unwrap();
        let rig = building(3, &[("sensors.velocity.noise", 1e-3.into())]);
        let runs = run(&rig, &vec![command; 3]);
        let noise = |run: &TestRun| {
            let pairs = run.measured_velocity().iter().zip(&run.velocity);
            pairs.map(|(a, b)| a - b).collect::<Vec<_>>()
        };
        assert_ne!(noise(&runs[0]), noise(&runs[1]));
        assert_ne!(noise(&runs[1]), noise(&runs[2]));
    }

    #[test]
    fn compensated_actuators_move_the_building_as_ideal_ones_do() {
        let command = sine_sweep(3000.0, 0.2, 6.0, 16.0, RATE).unwrap();
        let commands = vec![command; 3];
        let errors = |mode: &str, feedforward: bool| {
            let rig = building(
                3,
                &[("compensation.mode", mode.into()), ("compensation.feedforward", feedforward.into())],
            );
            let ideal = ideal_building_response(&rig, &commands, &SimulateOptions::default()).unwrap();
            let pairs = ideal.into_iter().zip(run(&rig, &commands));
            pairs
                .map(|(ideal, real)| crate::metrics::nrmse(&ideal.displacement, &real.displacement).unwrap())
                .collect::<Vec<_>>()
        };
        let (with, without) = (errors("nonlinear", true), errors("off", false));
        for (with, without) in with.iter().zip(&without) {
            assert!(*with < 0.15 && *without > 0.5, "{with} against {without}");
        }
    }

    #[test]
    fn energy_of_a_building_adds_up_and_closer_with_a_smaller_step() {
        let command = sine_sweep(6000.0, 0.2, 6.0, 4.0, RATE).unwrap();
        let rig = building(
            3,
            &[
                ("actuator.dead_length", 0.01.into()),
                ("actuator.friction", 200.0.into()),
                ("supply.droop", 3e8.into()),
                ("supply.accumulator", 5e-10.into()),
                ("servovalve.leakage.proportional", 2e-12.into()),
                ("servovalve.leakage.constant", 4e-5.into()),
            ],
        );
        let gap = |divisor: f64| {
            let options =
                SimulateOptions { largest_step: 1.0 / (4096.0 * divisor), ..SimulateOptions::default() };
            let balance = building_energy_balance(&rig, &vec![command.clone(); 3], &options).unwrap();
            for part in [balance.droop, balance.valve, balance.leakage, balance.friction, balance.damping] {
                assert!(part > 1e-4 * balance.supplied, "{balance:?}");
            }
            balance.gap().abs()
        };
        let gaps = [0.5, 2.0].map(gap);
        assert!(gaps[0] < 1e-6 && gaps[1] < gaps[0] / 4.0, "{gaps:?}");
    }

    #[test]
    fn what_does_not_fit_the_building_is_refused() {
        let command = sine_sweep(2000.0, 0.0, 10.0, 0.5, RATE).unwrap();
        let rig = building(2, &[]);
        let refused = |commands: &[Command]| {
            let options = SimulateOptions::default();
            simulate_building::<f64>(&rig, commands, &options, |_, _| true).unwrap_err().to_string()
        };
        assert!(refused(std::slice::from_ref(&command)).contains("must be one for each of 2 stories"));
        let other = sine_sweep(2000.0, 0.0, 10.0, 0.25, RATE).unwrap();
        assert!(refused(&[command.clone(), other]).contains("must all have"));
        let options = SimulateOptions::default();
        let error = simulate::<f64>(&rig, &command, &options, |_, _| true).unwrap_err().to_string();
        assert!(error.starts_with("structure.kind = \"shear_building\""), "{error}");
        let plain = simulate_building::<f64>(&RigConfig::zhao2005(), &[command], &options, |_, _| true);
        assert!(plain.unwrap_err().to_string().starts_with("structure.kind = "));
    }
}
