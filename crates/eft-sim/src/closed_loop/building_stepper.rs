//! A building's plant alone, one sample at a time, for controllers and structures from outside.

use crate::closed_loop::building::steps;
use crate::closed_loop::simulate::SimulateOptions;
use crate::closed_loop::stepper::PlantReading;
use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::rig::{BuildingPlant, Driver};
use crate::sensors::Signals;

/// The actuators of a shear building, carried on sample by sample under one held valve command each, the ground
/// floor's first: [`PlantStepper`](crate::closed_loop::PlantStepper) for several actuators, with the same exchange.
#[derive(Debug, Clone)]
pub struct BuildingStepper {
    plant: BuildingPlant,
    stories: usize,
    sample_rate: f64,
    steps: u32,
    ticks: u64,
    last_velocities: Vec<f64>,
    /// What a structure from outside last answered with (m/s²), one a floor; none where the rig's own follows.
    led: Option<Vec<f64>>,
}

impl BuildingStepper {
    /// The plant of a rig at rest, to be stepped at a sample rate (Hz).
    ///
    /// # Errors
    /// An invalid sample rate; a structure that is no building.
    pub fn new(rig: &RigConfig, sample_rate: f64, options: &SimulateOptions) -> Result<Self> {
        crate::checks::sample_rate("sample_rate", sample_rate)?;
        let (plant, steps) = (BuildingPlant::new(rig)?, steps(rig, options, sample_rate)?);
        let stories = plant.stories();
        Ok(Self {
            plant,
            stories,
            sample_rate,
            steps,
            ticks: 0,
            last_velocities: vec![0.0; stories],
            led: None,
        })
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.plant.reset();
        self.ticks = 0;
        self.last_velocities.fill(0.0);
        self.led = None;
    }

    /// What is true now, one reading a floor.
    pub fn readings(&self) -> Vec<PlantReading> {
        let time = self.ticks as f64 / self.sample_rate;
        let reading = |floor| {
            let Signals { supply_pressure, acceleration, .. } = self.plant.signals(floor);
            let led = self.led.as_ref().and_then(|led| led.get(floor).copied());
            let further = [supply_pressure, led.unwrap_or(acceleration)];
            let limits = self.plant.at_limits(floor);
            PlantReading::new(time, &self.plant.core(floor), self.plant.force(floor), further, limits)
        };
        (0..self.stories).map(reading).collect()
    }

    /// One sample with the rig's building under a valve command (V) a floor, and what is true after it.
    ///
    /// # Errors
    /// Not one command a floor, or one that is not finite.
    pub fn step(&mut self, valve_commands: &[f64]) -> Result<Vec<PlantReading>> {
        let drivers = self.held(valve_commands)?;
        self.plant.advance(&drivers, 1.0 / self.sample_rate, self.steps, None);
        self.led = None;
        self.ticks += 1;
        Ok(self.readings())
    }

    /// One sample of the hydraulics under a valve command (V) a floor, the pistons led by the structure outside; the
    /// mean forces (N) on that structure over the sample. [`follow`](Self::follow) must come next.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn push(&mut self, valve_commands: &[f64]) -> Result<Vec<f64>> {
        let drivers = self.held(valve_commands)?;
        let velocities: Vec<f64> = (0..self.stories).map(|floor| self.plant.core(floor).velocity).collect();
        let changes = velocities.iter().zip(&self.last_velocities);
        let accelerations: Vec<f64> = changes.map(|(now, last)| (now - last) * self.sample_rate).collect();
        self.last_velocities = velocities;
        let step = 1.0 / (self.sample_rate * f64::from(self.steps));
        let mut means = vec![0.0; self.stories];
        let share = 0.5 / f64::from(self.steps);
        for _ in 0..self.steps {
            self.add_forces(&mut means, share);
            self.plant.advance(&drivers, step, 1, Some(&accelerations));
            self.add_forces(&mut means, share);
        }
        self.ticks += 1;
        Ok(means)
    }

    /// The motions (m, m/s) that the structure outside has reached at the end of the sample, one a floor.
    ///
    /// # Errors
    /// Not one a floor, or one that is not finite.
    pub fn follow(&mut self, displacements: &[f64], velocities: &[f64]) -> Result<()> {
        self.check("displacement", "m", displacements)?;
        self.check("velocity", "m/s", velocities)?;
        for (floor, (displacement, velocity)) in displacements.iter().zip(velocities).enumerate() {
            self.plant.set_motion(floor, *displacement, *velocity);
        }
        let changes = velocities.iter().zip(&self.last_velocities);
        self.led = Some(changes.map(|(now, last)| (now - last) * self.sample_rate).collect());
        Ok(())
    }

    fn add_forces(&self, sums: &mut [f64], share: f64) {
        for (floor, sum) in sums.iter_mut().enumerate() {
            *sum += share * self.plant.force(floor);
        }
    }

    fn held(&self, valve_commands: &[f64]) -> Result<Vec<Driver<f64>>> {
        self.check("valve_command", "V", valve_commands)?;
        Ok(valve_commands.iter().map(|command| Driver::held(*command)).collect())
    }

    fn check(&self, name: &str, unit: &str, values: &[f64]) -> Result<()> {
        if values.len() != self.stories {
            let allowed = format!("must be one for each of {} stories", self.stories);
            return Err(Error::value(name, format!("{} values", values.len()), allowed));
        }
        values.iter().try_for_each(|value| crate::checks::finite(name, *value, unit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_loop::simulate_building;
    use crate::excitation::Command;

    const RATE: f64 = 2048.0;
    const MASS: f64 = 7040.0;
    const DAMPING: f64 = 4330.0;
    const STIFFNESS: f64 = 693.8e3;

    fn rig() -> RigConfig {
        let list = |value: f64| toml::Value::Array(vec![value.into(); 2]);
        RigConfig::zhao2005()
            .replace(&[
                ("structure.kind", "shear_building".into()),
                ("structure.stories.masses", list(MASS)),
                ("structure.stories.dampings", list(DAMPING)),
                ("structure.stories.stiffnesses", list(STIFFNESS)),
                ("controller.realization", "digital".into()),
            ])
            .unwrap()
    }

    #[test]
    fn stepping_under_the_commands_of_a_test_gives_the_test() {
        let tone = |amplitude: f64, i: u32| amplitude * (0.004 * f64::from(i)).sin();
        let command =
            |amplitude| Command::new((0..4096).map(|i| tone(amplitude, i)).collect(), RATE).unwrap();
        let options = SimulateOptions::default();
        let runs =
            simulate_building::<f64>(&rig(), &[command(3e3), command(5e3)], &options, |_, _| true).unwrap();
        let mut plant = BuildingStepper::new(&rig(), RATE, &options).unwrap();
        for i in 0..4096 {
            for (reading, run) in plant.readings().iter().zip(&runs) {
                assert_eq!((reading.force, reading.displacement), (run.force[i], run.displacement[i]));
            }
            plant.step(&[runs[0].valve_command[i], runs[1].valve_command[i]]).unwrap();
        }
        plant.reset();
        assert_eq!(plant.readings()[1].force, 0.0);
    }

    /// Largest error of the forces (N) with the rig's own building outside, exchanged at a rate (Hz).
    fn exchange_error(rate: f64) -> f64 {
        let options = SimulateOptions::default();
        let mut inside = BuildingStepper::new(&rig(), rate, &options).unwrap();
        let mut outside = inside.clone();
        let (mut x, mut v, mut worst) = ([0.0; 2], [0.0; 2], 0.0_f64);
        for i in 0..(2.0 * rate) as u32 {
            let t = (f64::from(i) / rate * 512.0).floor() / 512.0;
            let commands = [0.08 * (7.0 * t).sin(), 0.05 * (11.0 * t).sin()];
            let truth = inside.step(&commands).unwrap();
            let force = outside.push(&commands).unwrap();
            let h = 1.0 / rate / 50.0;
            let accelerations = |x: &[f64; 2], v: &[f64; 2]| {
                let columns = |drift: f64, rate: f64| STIFFNESS * drift + DAMPING * rate;
                let (lower, upper) = (columns(x[0], v[0]), columns(x[1] - x[0], v[1] - v[0]));
                [(force[0] - lower + upper) / MASS, (force[1] - upper) / MASS]
            };
            for _ in 0..50 {
                let a = accelerations(&x, &v);
                let half = [v[0] + 0.5 * h * a[0], v[1] + 0.5 * h * a[1]];
                x = [x[0] + h * half[0], x[1] + h * half[1]];
                let a = accelerations(&x, &half);
                v = [half[0] + 0.5 * h * a[0], half[1] + 0.5 * h * a[1]];
            }
            outside.follow(&x, &v).unwrap();
            for (a, b) in outside.readings().iter().zip(&truth) {
                worst = worst.max((a.force - b.force).abs());
            }
        }
        worst
    }

    #[test]
    fn the_exchange_is_of_second_order() {
        let errors = [1024.0, 2048.0].map(exchange_error);
        assert!(errors[1] < errors[0] / 3.0, "{errors:?}");
    }

    #[test]
    fn bad_input_is_named() {
        let mut plant = BuildingStepper::new(&rig(), RATE, &SimulateOptions::default()).unwrap();
        let text = |error: Error| error.to_string();
        assert!(text(plant.step(&[0.0]).unwrap_err()).starts_with("valve_command = 1 values: must be one"));
        assert!(text(plant.step(&[0.0, f64::NAN]).unwrap_err()).starts_with("valve_command = NaN"));
        assert!(
            text(plant.follow(&[0.0; 2], &[f64::INFINITY; 2]).unwrap_err()).starts_with("velocity = inf")
        );
        let plain = BuildingStepper::new(&RigConfig::zhao2005(), RATE, &SimulateOptions::default());
        assert!(text(plain.unwrap_err()).starts_with("structure.kind"));
    }
}
