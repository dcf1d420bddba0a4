//! The plant alone, one sample at a time, for controllers and structures from outside.

use eft_core::status;

use crate::closed_loop::simulate::{SimulateOptions, one_actuator};
use crate::config::RigConfig;
use crate::error::Result;
use crate::rig::{DetailedPlant, DetailedState, Held, Pace, PlantModel, PlantState, longest_step};
use crate::sensors::Signals;

/// What is true of the plant at one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantReading {
    /// Time since the start (s).
    pub time: f64,
    /// Force on the structure (N).
    pub force: f64,
    /// Displacement (m).
    pub displacement: f64,
    /// Velocity (m/s).
    pub velocity: f64,
    /// Spool opening (1).
    pub spool: f64,
    /// Load pressure (Pa).
    pub load_pressure: f64,
    /// Supply pressure (Pa).
    pub supply_pressure: f64,
    /// Acceleration (m/s²); of a structure from outside the mean of the sample that ends now.
    pub acceleration: f64,
    /// [`status::SPOOL_STOP`], [`status::STROKE_EXCEEDED`] and [`status::DIVERGED`].
    pub status: u32,
}

impl PlantReading {
    /// At a time (s): state, force (N), supply pressure (Pa) and acceleration (m/s²), and whether the spool is at a
    /// stop and the piston beyond its stroke.
    pub(crate) fn new(
        time: f64,
        core: &PlantState<f64>,
        force: f64,
        [supply_pressure, acceleration]: [f64; 2],
        (at_stop, beyond_stroke): (bool, bool),
    ) -> Self {
        let PlantState { spool, load_pressure, displacement, velocity, .. } = *core;
        let flags = [
            (at_stop, status::SPOOL_STOP),
            (beyond_stroke, status::STROKE_EXCEEDED),
            (!core.is_bounded(), status::DIVERGED),
        ];
        let status = flags.iter().filter(|flag| flag.0).fold(0, |all, flag| all | flag.1);
        Self {
            time,
            force,
            displacement,
            velocity,
            spool,
            load_pressure,
            supply_pressure,
            acceleration,
            status,
        }
    }
}

/// A plant that is carried on sample by sample under a held valve command.
///
/// Instead of the rig's own structure another one may follow the actuator: [`push`](Self::push) carries the
/// hydraulics over one sample and gives the mean force of that sample, [`follow`](Self::follow) takes the motion
/// that the other structure answered with. Over a sample the piston moves with the velocity extrapolated from the
/// last two answers, so the exchange is of second order in the sample period: half the period, a quarter of the error.
#[derive(Debug, Clone)]
pub struct PlantStepper {
    plant: DetailedPlant<f64>,
    state: DetailedState<f64>,
    pace: Pace,
    ticks: u64,
    last_velocity: f64,
    /// What a structure from outside last answered with (m/s²); none where the rig's own follows.
    led: Option<f64>,
}

impl PlantStepper {
    /// The plant of a rig at rest, to be stepped at a sample rate (Hz).
    ///
    /// # Errors
    /// An invalid sample rate; a building, which has several valves.
    pub fn new(rig: &RigConfig, sample_rate: f64, options: &SimulateOptions) -> Result<Self> {
        crate::checks::sample_rate("sample_rate", sample_rate)?;
        one_actuator(rig)?;
        let asked = options.steps(sample_rate)?;
        let needed =
            SimulateOptions { largest_step: longest_step(rig).min(options.largest_step), ..*options };
        let pace = Pace::new(sample_rate, needed.steps(sample_rate)?.max(asked));
        let plant = DetailedPlant::pack(|_| rig, pace)?;
        Ok(Self { state: plant.at_rest(), plant, pace, ticks: 0, last_velocity: 0.0, led: None })
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.state = self.plant.at_rest();
        self.ticks = 0;
        self.last_velocity = 0.0;
        self.led = None;
    }

    /// What is true now.
    pub fn reading(&self) -> PlantReading {
        let Signals { supply_pressure, acceleration, .. } = self.plant.signals(&self.state);
        PlantReading::new(
            self.ticks as f64 / self.pace.sample_rate,
            DetailedPlant::core(&self.state),
            self.plant.force(&self.state),
            [supply_pressure, self.led.unwrap_or(acceleration)],
            self.plant.at_limits(&self.state),
        )
    }

    /// One sample with the rig's structure under a valve command (V), and what is true after it.
    ///
    /// # Errors
    /// A command that is not finite.
    pub fn step(&mut self, valve_command: f64) -> Result<PlantReading> {
        crate::checks::finite("valve_command", valve_command, "V")?;
        self.state = self.plant.advance_driven(self.state, (), &Held(valve_command), self.pace);
        self.led = None;
        self.ticks += 1;
        Ok(self.reading())
    }

    /// One sample of the hydraulics under a valve command (V), the piston led by the structure outside; the mean
    /// force (N) on that structure over the sample. [`follow`](Self::follow) must come next.
    ///
    /// # Errors
    /// A command that is not finite.
    pub fn push(&mut self, valve_command: f64) -> Result<f64> {
        crate::checks::finite("valve_command", valve_command, "V")?;
        let velocity = DetailedPlant::core(&self.state).velocity;
        let acceleration = (velocity - self.last_velocity) * self.pace.sample_rate;
        self.last_velocity = velocity;
        let step = self.pace.step();
        let held = Held(valve_command);
        let mut sum = 0.0;
        for _ in 0..self.pace.steps {
            let before = self.plant.force(&self.state);
            self.state = self.plant.advance_led(self.state, &held, acceleration, step);
            sum += 0.5 * (before + self.plant.force(&self.state));
        }
        self.ticks += 1;
        Ok(sum / f64::from(self.pace.steps))
    }

    /// The motion (m, m/s) that the structure outside has reached at the end of the sample.
    ///
    /// # Errors
    /// A motion that is not finite.
    pub fn follow(&mut self, displacement: f64, velocity: f64) -> Result<()> {
        crate::checks::finite("displacement", displacement, "m")?;
        crate::checks::finite("velocity", velocity, "m/s")?;
        self.state.set_motion(displacement, velocity);
        self.led = Some((velocity - self.last_velocity) * self.pace.sample_rate);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_loop::Method;
    use crate::excitation::sine_sweep;
    use crate::simulate;

    fn digital() -> RigConfig {
        RigConfig::zhao2005().replace(&[("controller.realization", "digital".into())]).unwrap()
    }

    #[test]
    fn stepping_under_the_commands_of_a_test_gives_the_test() {
        let command = sine_sweep(8900.0, 0.0, 10.0, 4.0, 4096.0).unwrap();
        // The stepper's own method, or the two would differ by the error of both.
        let options = SimulateOptions { method: Method::RungeKutta, ..SimulateOptions::default() };
        let run = simulate::<f64>(&digital(), &command, &options, |_, _| true).unwrap();
        let mut plant = PlantStepper::new(&digital(), 4096.0, &options).unwrap();
        for (i, v) in run.valve_command.iter().enumerate() {
            let now = plant.reading();
            assert!((now.force - run.force[i]).abs() < 1e-6, "sample {i}");
            assert!((now.displacement - run.displacement[i]).abs() < 1e-12, "sample {i}");
            plant.step(*v).unwrap();
        }
    }

    /// Largest error of the force (N) with the rig's own structure outside, exchanged at a rate (Hz).
    fn exchange_error(sample_rate: f64) -> f64 {
        let rig = RigConfig::zhao2005().replace(&[("structure.kind", "linear".into())]).unwrap();
        let (m, c, k) = (rig.structure.mass, rig.structure.damping, rig.structure.stiffness);
        let options = SimulateOptions::default();
        let (mut inside, mut outside) = (
            PlantStepper::new(&rig, sample_rate, &options).unwrap(),
            PlantStepper::new(&rig, sample_rate, &options).unwrap(),
        );
        let (mut x, mut v, mut worst) = (0.0, 0.0, 0.0_f64);
        for i in 0..(4.0 * sample_rate) as u32 {
            // Held at the coarsest rate's samples, so that every rate runs the same test.
            let t = (f64::from(i) / sample_rate * 512.0).floor() / 512.0;
            let command = 0.1 * (std::f64::consts::TAU * 1.6 * t).sin();
            let truth = inside.step(command).unwrap();
            let force = outside.push(command).unwrap();
            // The structure under the mean force, in many small steps.
            let h = 1.0 / sample_rate / 50.0;
            for _ in 0..50 {
                let half = v + 0.5 * h * (force - c * v - k * x) / m;
                x += h * half;
                v = half + 0.5 * h * (force - c * half - k * x) / m;
            }
            outside.follow(x, v).unwrap();
            worst = worst.max((outside.reading().force - truth.force).abs());
        }
        worst
    }

    #[test]
    fn the_exchange_is_of_second_order() {
        let errors = [1024.0, 2048.0, 4096.0].map(exchange_error);
        println!("{errors:?}");
        for pair in errors.windows(2) {
            assert!(pair[1] < pair[0] / 3.0, "{errors:?}");
        }
    }

    #[test]
    fn bad_input_is_named() {
        let mut plant = PlantStepper::new(&digital(), 4096.0, &SimulateOptions::default()).unwrap();
        assert!(plant.step(f64::NAN).unwrap_err().to_string().starts_with("valve_command = NaN"));
        assert!(plant.follow(0.0, f64::INFINITY).unwrap_err().to_string().starts_with("velocity = inf"));
        let error = PlantStepper::new(&digital(), -1.0, &SimulateOptions::default()).unwrap_err();
        assert!(error.to_string().starts_with("sample_rate = -1"), "{error}");
    }
}
