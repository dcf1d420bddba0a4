//! An external structure that replaces a rig's own.

use crate::lanes::Num;
use crate::plant::{AnyDrive, Plant, TimeGrid};

/// Displacements (m) and velocities (m/s), one of each per actuator.
pub type Motions = (Vec<f64>, Vec<f64>);

/// An external structure. Its inputs are the mean forces (N) over a sample, one per actuator, and the length
/// of the sample (s). It returns the motions at the end of the sample, or one sentence on why it cannot
/// continue.
pub type Specimen = Box<dyn FnMut(&[f64], f64) -> Result<Motions, String> + Send>;

/// Moves the pistons of a plant with an external structure. Within a sample their velocity is extrapolated
/// from the last two answers, so the exchange is of second order in the sample period.
#[derive(Debug, Clone)]
pub(crate) struct StructureExchange {
    /// Velocities (m/s) of the answer before the last one, one per actuator.
    last_velocities: Vec<f64>,
    /// Mean accelerations (m/s²) of the sample that ends now, one per actuator.
    accelerations: Option<Vec<f64>>,
}

impl StructureExchange {
    /// At rest.
    pub(crate) fn new(actuators: usize) -> Self {
        Self { last_velocities: vec![0.0; actuators], accelerations: None }
    }

    /// Back to rest.
    pub(crate) fn reset(&mut self) {
        self.last_velocities.fill(0.0);
        self.accelerations = None;
    }

    /// Notes that the rig's own structure moved instead.
    pub(crate) fn clear_accelerations(&mut self) {
        self.accelerations = None;
    }

    /// Mean acceleration (m/s²) of an actuator over the sample that ends now; `None` if the rig's own
    /// structure moves.
    pub(crate) fn acceleration(&self, actuator: usize) -> Option<f64> {
        self.accelerations.as_ref().and_then(|all| all.get(actuator).copied())
    }

    /// Advances the hydraulics by one sample and returns the mean forces (N) on the structure.
    pub(crate) fn advance_hydraulics(
        &mut self,
        plant: &mut Plant<f64>,
        drivers: &[AnyDrive<f64>],
        grid: TimeGrid,
    ) -> Vec<f64> {
        let actuators = 0..plant.actuators();
        let velocities: Vec<f64> = actuators.clone().map(|i| plant.actuator(i).velocity).collect();
        let accelerations = self.mean_accelerations(&velocities, grid);
        self.last_velocities = velocities;
        let mut sums = vec![0.0; actuators.len()];
        for n in 0..grid.steps {
            let before: Vec<f64> = actuators.clone().map(|i| plant.force(i)).collect();
            plant.step(drivers, f64::from(n) * grid.step, grid.step, Some(&accelerations));
            plant.update_forces();
            for (i, (sum, before)) in sums.iter_mut().zip(before).enumerate() {
                *sum += 0.5 * (before + plant.force(i));
            }
        }
        sums.into_iter().map(|sum| sum / f64::from(grid.steps)).collect()
    }

    /// Sets the motions (m, m/s) that the structure has reached, one per actuator.
    pub(crate) fn set_motions(
        &mut self,
        plant: &mut Plant<f64>,
        displacements: &[f64],
        velocities: &[f64],
        grid: TimeGrid,
    ) {
        plant.set_motion(displacements, velocities);
        self.accelerations = Some(self.mean_accelerations(velocities, grid));
    }

    /// Mean accelerations (m/s²) from the last answer's velocities to these velocities (m/s).
    fn mean_accelerations(&self, velocities: &[f64], grid: TimeGrid) -> Vec<f64> {
        let pairs = velocities.iter().zip(&self.last_velocities);
        pairs.map(|(now, last)| (now - last) * grid.sample_rate).collect()
    }
}

/// The motion of the pistons with an external structure.
pub(crate) trait PistonMotion<S: Num> {
    /// Advances the plant by one sample.
    fn advance(&mut self, plant: &mut Plant<S>, drivers: &[AnyDrive<S>], grid: TimeGrid);
    /// Mean acceleration (m/s²) of an actuator over the sample that ends now.
    fn acceleration(&self, actuator: usize) -> Option<S>;
    /// Reason why it could not continue.
    fn failure(&self) -> Option<&str>;
}

/// An external structure that moves with a plant until it cannot continue.
pub(crate) struct ExternalStructure {
    specimen: Specimen,
    exchange: StructureExchange,
    failure: Option<String>,
}

impl ExternalStructure {
    /// At rest, for a number of actuators.
    pub(crate) fn new(specimen: Specimen, actuators: usize) -> Self {
        Self { specimen, exchange: StructureExchange::new(actuators), failure: None }
    }
}

impl PistonMotion<f64> for ExternalStructure {
    // After a failure the structure is not called again, and the plant does not change.
    fn advance(&mut self, plant: &mut Plant<f64>, drivers: &[AnyDrive<f64>], grid: TimeGrid) {
        if self.failure.is_some() {
            return;
        }
        let forces = self.exchange.advance_hydraulics(plant, drivers, grid);
        match (self.specimen)(&forces, 1.0 / grid.sample_rate)
            .and_then(|motions| check_motions(motions, forces.len()))
        {
            Ok((displacements, velocities)) => {
                self.exchange.set_motions(plant, &displacements, &velocities, grid);
            }
            Err(reason) => self.failure = Some(reason),
        }
    }

    fn acceleration(&self, actuator: usize) -> Option<f64> {
        self.exchange.acceleration(actuator)
    }

    fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }
}

/// The motions, if there is a finite one for each actuator.
fn check_motions(motions: Motions, actuators: usize) -> Result<Motions, String> {
    for (name, unit, values) in [("displacement", "m", &motions.0), ("velocity", "m/s", &motions.1)] {
        if values.len() != actuators {
            return Err(format!("{name} = {} values: must be {actuators}, one per actuator", values.len()));
        }
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return Err(format!("{name} = {value} {unit}: must be finite"));
        }
    }
    Ok(motions)
}
