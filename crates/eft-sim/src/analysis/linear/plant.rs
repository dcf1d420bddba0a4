//! Valves, actuators and structure near rest.

use nalgebra::{DMatrix, RowDVector};

use super::gains::Gains;
use crate::config::{MotionAt, RigConfig, Story, StructureKind};
use crate::design::PRESSURE;

/// Order of an actuator's states: pilot flow, spool, load pressure, displacement, velocity, then further
/// states of valve and load cell.
const SPOOL: usize = 1;
const DISPLACEMENT: usize = 3;
const VELOCITY: usize = 4;

/// `ẋ = A·x + B·v` of the plant under one valve command `v` (V) per actuator. The states of one actuator
/// follow those of another.
#[derive(Debug, Clone)]
pub(super) struct LinearPlant {
    pub(super) a: DMatrix<f64>,
    /// Rate of the state that the valve command drives, in the state's unit per s and V.
    pub(super) per_volt: f64,
    pub(super) actuators: usize,
    /// Index of an actuator's state that the valve command drives. `shown` has the index of the state that
    /// the load cell measures, and the force (N) per unit of that state.
    driven: usize,
    shown: (usize, f64),
    /// Names of an actuator's states.
    names: Vec<&'static str>,
    piston_area: f64,
    /// Motion (m/Pa) of a measured piston relative to the structure.
    yielding: f64,
    numbered: bool,
}

impl LinearPlant {
    /// Eqs. (2), (3), (6) without its root, (7), the proportional leakage of Eq. (5), torque motor, underlap,
    /// attachment and load cell, and the structure's slope at rest.
    pub(super) fn new(rig: &RigConfig, gains: &Gains) -> Self {
        let rig = rig.plant();
        let actuator = &rig.actuator;
        let stories = stories(rig);
        let compressibility = actuator.compressibility + actuator.attachment_compressibility();
        let hydraulics = rig.held_piston(&gains.rest, gains.flow, compressibility).continuous();
        let place = |state: usize| if state > PRESSURE { state + 2 } else { state };
        let mut names = hydraulics.names.clone();
        names.splice(DISPLACEMENT..DISPLACEMENT, ["displacement", "velocity"]);
        let each = names.len();
        let mut a = DMatrix::zeros(each * stories.len(), each * stories.len());
        for (i, story) in stories.iter().enumerate() {
            let at = |state: usize| i * each + state;
            for row in 0..hydraulics.names.len() {
                for column in 0..hydraulics.names.len() {
                    a[(at(place(row)), at(place(column)))] = hydraulics.a[(row, column)];
                }
            }
            a[(at(PRESSURE), at(VELOCITY))] = -actuator.piston_area / compressibility;
            a[(at(DISPLACEMENT), at(VELOCITY))] = 1.0;
            a[(at(VELOCITY), at(PRESSURE))] = actuator.piston_area / story.mass;
            // The columns below this floor, and those above it.
            let held = [(i, Some(story)), (i + 1, stories.get(i + 1))];
            for (upper, columns) in held.into_iter().filter_map(|(upper, columns)| Some((upper, columns?))) {
                let sign = if upper == i { -1.0 } else { 1.0 };
                for (floor, part) in [(Some(upper), sign), (upper.checked_sub(1), -sign)] {
                    let Some(floor) = floor else { continue };
                    a[(at(VELOCITY), floor * each + DISPLACEMENT)] += part * columns.stiffness / story.mass;
                    a[(at(VELOCITY), floor * each + VELOCITY)] += part * columns.damping / story.mass;
                }
            }
        }
        let (shown, force) = (place(hydraulics.shown.0), hydraulics.shown.1);
        if let Some(inertia) = rig.sensors.cell_mass.filter(|_| shown != PRESSURE) {
            for cell in (0..stories.len()).map(|i| i * each + shown) {
                let corner = -a[(cell, cell)];
                let acceleration = a.row(cell - shown + VELOCITY) * (-inertia * corner);
                let mut row = a.row_mut(cell);
                row += acceleration;
            }
        }
        let attached = actuator.attachment_compressibility() / actuator.piston_area;
        Self {
            a,
            per_volt: hydraulics.driven.1,
            actuators: stories.len(),
            driven: place(hydraulics.driven.0),
            shown: (shown, force * rig.sensors.force.gain),
            names,
            piston_area: actuator.piston_area,
            yielding: if rig.sensors.motion_at == MotionAt::Piston { attached } else { 0.0 },
            numbered: rig.structure.kind == StructureKind::ShearBuilding,
        }
    }

    /// Number of states.
    pub(super) fn states(&self) -> usize {
        self.a.nrows()
    }

    /// Index of one of an actuator's states.
    fn index(&self, actuator: usize, state: usize) -> usize {
        actuator * self.names.len() + state
    }

    /// Index of the state that an actuator's valve command drives.
    pub(super) fn driven(&self, actuator: usize) -> usize {
        self.index(actuator, self.driven)
    }

    /// The velocity (m/s) where it is measured as a row over the states.
    pub(super) fn velocity(&self, actuator: usize) -> RowDVector<f64> {
        let mut row = self.a.row(self.index(actuator, PRESSURE)) * self.yielding;
        row[self.index(actuator, VELOCITY)] += 1.0;
        row
    }

    /// The displacement (m) where it is measured as a row over the states.
    pub(super) fn displacement(&self, actuator: usize) -> RowDVector<f64> {
        let mut row = RowDVector::zeros(self.states());
        row[self.index(actuator, PRESSURE)] = self.yielding;
        row[self.index(actuator, DISPLACEMENT)] = 1.0;
        row
    }

    /// The acceleration (m/s²) of the structure as a row over the states.
    pub(super) fn acceleration(&self, actuator: usize) -> RowDVector<f64> {
        self.a.row(self.index(actuator, VELOCITY)).into_owned()
    }

    /// The measured force (N) as a row over the states.
    pub(super) fn shown(&self, actuator: usize) -> RowDVector<f64> {
        let mut row = RowDVector::zeros(self.states());
        row[self.index(actuator, self.shown.0)] = self.shown.1;
        row
    }

    /// Rate (N/s) of the measured force; the valve command has no direct effect on it.
    pub(super) fn shown_rate(&self, actuator: usize) -> RowDVector<f64> {
        self.shown(actuator) * &self.a
    }

    /// The name of an actuator's signal. With several actuators it ends with the actuator's number, from 1.
    pub(super) fn name(&self, signal: &str, actuator: usize) -> String {
        if self.numbered { format!("{signal}_{}", actuator + 1) } else { signal.to_owned() }
    }

    /// Names of the states.
    pub(super) fn names(&self) -> Vec<String> {
        let of = |i: usize| self.names.iter().map(move |name| self.name(name, i));
        (0..self.actuators).flat_map(of).collect()
    }

    /// The output rows of every model, over `states` states: force (N), displacement (m), velocity (m/s),
    /// spool opening (1) and load pressure (Pa) of each actuator.
    pub(super) fn outputs(&self, states: usize) -> (DMatrix<f64>, Vec<String>) {
        let signals = [
            ("force", PRESSURE, self.piston_area),
            ("displacement", DISPLACEMENT, 1.0),
            ("velocity", VELOCITY, 1.0),
            ("spool", SPOOL, 1.0),
            ("load_pressure", PRESSURE, 1.0),
        ];
        let mut c = DMatrix::zeros(signals.len() * self.actuators, states);
        let mut names = Vec::with_capacity(c.nrows());
        for actuator in 0..self.actuators {
            for (name, state, factor) in signals {
                c[(names.len(), self.index(actuator, state))] = factor;
                names.push(self.name(name, actuator));
            }
        }
        (c, names)
    }

    /// Names of the inputs.
    pub(super) fn inputs(&self) -> Vec<String> {
        (0..self.actuators).map(|actuator| self.name("command", actuator)).collect()
    }
}

/// The structure's stories near rest.
fn stories(rig: &RigConfig) -> Vec<Story> {
    let s = &rig.structure;
    let mut stories: Vec<_> = (0..s.floors()).map(|n| s.story(n)).collect();
    if let (Some(damper), false) = (&s.power_damper, s.kind == StructureKind::ShearBuilding) {
        // A power law with exponent 1 is a viscous damper; with a higher exponent its slope at rest is zero.
        let slope = if damper.exponent == 1.0 { damper.coefficient } else { 0.0 };
        stories.iter_mut().for_each(|story| story.damping += slope);
    }
    stories
}

/// Keys of a rig with an effect on small signals that no linear model contains. These are dead zone, offset,
/// friction, play, constant leakage, a damper that is infinitely steep at rest, and changing estimates.
pub(super) fn left_out(rig: &RigConfig) -> Vec<String> {
    let (plant, compensation) = (rig.plant(), &rig.compensation);
    let (valve, structure) = (&plant.servovalve, &plant.structure);
    let steep = structure.power_damper.as_ref().is_some_and(|damper| damper.exponent < 1.0);
    let building = structure.kind == StructureKind::ShearBuilding;
    named(&[
        (valve.overlap > 0.0, "servovalve.overlap"),
        (valve.null_bias != 0.0, "servovalve.null_bias"),
        (valve.leakage.constant > 0.0, "servovalve.leakage.constant"),
        (plant.actuator.friction > 0.0, "actuator.friction"),
        (plant.actuator.attachment_play > 0.0, "actuator.attachment_play"),
        (plant.sensors.force.bias != 0.0, "sensors.force.bias"),
        (plant.sensors.velocity.bias != 0.0, "sensors.velocity.bias"),
        (steep && !building, "structure.power_damper"),
        (compensation.adaptive, "compensation.adaptive"),
        (compensation.guard, "compensation.guard"),
    ])
}

/// The keys whose effect is there.
pub(super) fn named(keys: &[(bool, &str)]) -> Vec<String> {
    keys.iter().filter(|(present, _)| *present).map(|(_, key)| (*key).to_owned()).collect()
}
