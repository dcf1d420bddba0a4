//! Valves, actuators and structure near rest.

use nalgebra::{DMatrix, RowDVector};

use super::gains::Gains;
use crate::config::{RigConfig, Story, StructureKind, VelocitySource};
use crate::plant::Supply;

/// Order of an actuator's states: that of an actuator of the plant, then the load cell where it lags.
pub(super) const PILOT_FLOW: usize = 0;
const SPOOL: usize = 1;
const PRESSURE: usize = 2;
const DISPLACEMENT: usize = 3;
pub(super) const VELOCITY: usize = 4;
const CELL: usize = 5;
const NAMES: [&str; 6] = ["pilot_flow", "spool", "load_pressure", "displacement", "velocity", "load_cell"];

/// `ẋ = A·x + B·v` of the plant under one valve command `v` (V) an actuator; the states actuator by actuator.
#[derive(Debug, Clone)]
pub(super) struct LinearPlant {
    pub(super) a: DMatrix<f64>,
    /// Rate of the pilot flow per valve command (m³/s² per V).
    pub(super) to_pilot: f64,
    pub(super) actuators: usize,
    /// States of one actuator.
    each: usize,
    piston_area: f64,
    cell_gain: f64,
    numbered: bool,
}

impl LinearPlant {
    /// Eqs. (2), (3), (6) without its root, (7), the leakage of Eq. (5) that is proportional, the load cell, and the
    /// structure's slope at rest.
    pub(super) fn new(rig: &RigConfig, gains: &Gains) -> Self {
        let rig = rig.plant();
        let (valve, actuator) = (&rig.servovalve, &rig.actuator);
        let stories = stories(rig);
        let cell = rig.sensors.force.bandwidth.map(|corner| std::f64::consts::TAU * corner);
        let each = if cell.is_some() { NAMES.len() } else { CELL };
        let mut a = DMatrix::zeros(each * stories.len(), each * stories.len());
        let to_pilot = valve.pilot_flow_gain / valve.pilot_time_constant;
        // The flow curve holds at `supply.pressure`; a schedule may begin elsewhere.
        let supplied = Supply::<f64>::pack(|_| rig).setting(0.0) / rig.supply.pressure;
        for (i, story) in stories.iter().enumerate() {
            let at = |state: usize| i * each + state;
            a[(at(PILOT_FLOW), at(PILOT_FLOW))] = -1.0 / valve.pilot_time_constant;
            a[(at(PILOT_FLOW), at(SPOOL))] = -to_pilot * valve.spool_sensitivity * valve.spool_stroke;
            a[(at(SPOOL), at(PILOT_FLOW))] = 1.0 / (valve.spool_area * valve.spool_stroke);
            let leakage = actuator.leakage + valve.leakage.proportional;
            a[(at(PRESSURE), at(SPOOL))] = gains.flow * supplied.sqrt() / actuator.compressibility;
            a[(at(PRESSURE), at(PRESSURE))] = -leakage / actuator.compressibility;
            a[(at(PRESSURE), at(VELOCITY))] = -actuator.piston_area / actuator.compressibility;
            a[(at(DISPLACEMENT), at(VELOCITY))] = 1.0;
            a[(at(VELOCITY), at(PRESSURE))] = actuator.piston_area / story.mass;
            // The columns below this floor, and those above it, which stand on it.
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
        if let Some(corner) = cell {
            let inertia = rig.sensors.cell_mass.unwrap_or(0.0);
            for i in 0..stories.len() {
                let cell = i * each + CELL;
                let acceleration = a.row(i * each + VELOCITY) * (-inertia * corner);
                a.set_row(cell, &acceleration);
                a[(cell, i * each + PRESSURE)] += corner * actuator.piston_area;
                a[(cell, cell)] -= corner;
            }
        }
        Self {
            a,
            to_pilot,
            actuators: stories.len(),
            each,
            piston_area: actuator.piston_area,
            cell_gain: rig.sensors.force.gain,
            numbered: rig.structure.kind == StructureKind::ShearBuilding,
        }
    }

    /// Number of states.
    pub(super) fn states(&self) -> usize {
        self.a.nrows()
    }

    /// Index of one of an actuator's states.
    pub(super) fn index(&self, actuator: usize, state: usize) -> usize {
        actuator * self.each + state
    }

    /// What the load cell shows (N) as a row over the states.
    pub(super) fn shown(&self, actuator: usize) -> RowDVector<f64> {
        let mut row = RowDVector::zeros(self.states());
        if self.each > CELL {
            row[self.index(actuator, CELL)] = self.cell_gain;
        } else {
            row[self.index(actuator, PRESSURE)] = self.cell_gain * self.piston_area;
        }
        row
    }

    /// Its rate (N/s): no valve command reaches it at once.
    pub(super) fn shown_rate(&self, actuator: usize) -> RowDVector<f64> {
        self.shown(actuator) * &self.a
    }

    /// A name for one of an actuator's signals; with several actuators it has the actuator's number, from 1.
    pub(super) fn name(&self, signal: &str, actuator: usize) -> String {
        if self.numbered { format!("{signal}_{}", actuator + 1) } else { signal.to_owned() }
    }

    /// Names of the states.
    pub(super) fn names(&self) -> Vec<String> {
        let of = |i: usize| NAMES.iter().take(self.each).map(move |name| self.name(name, i));
        (0..self.actuators).flat_map(of).collect()
    }

    /// The rows that every model shows, over `states` states: force (N), displacement (m), velocity (m/s), spool
    /// opening (1) and load pressure (Pa) of each actuator.
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
        // A power law of the first degree is a viscous damper; of a higher one it has no slope at rest.
        let slope = if damper.exponent == 1.0 { damper.coefficient } else { 0.0 };
        stories.iter_mut().for_each(|story| story.damping += slope);
    }
    stories
}

/// Keys of a rig whose effect on small signals no linear model has: a dead zone, an offset, a friction, a constant leakage, a
/// damper that is infinitely steep at rest, estimates that move, a velocity that is not its sensor's.
pub(super) fn left_out(rig: &RigConfig) -> Vec<String> {
    let (plant, compensation) = (rig.plant(), &rig.compensation);
    let (valve, structure) = (&plant.servovalve, &plant.structure);
    let steep = structure.power_damper.as_ref().is_some_and(|damper| damper.exponent < 1.0);
    let building = structure.kind == StructureKind::ShearBuilding;
    [
        (valve.overlap > 0.0, "servovalve.overlap"),
        (valve.null_bias != 0.0, "servovalve.null_bias"),
        (valve.leakage.constant > 0.0, "servovalve.leakage.constant"),
        (plant.actuator.friction > 0.0, "actuator.friction"),
        (steep && !building, "structure.power_damper"),
        (rig.controller.velocity_source != VelocitySource::Sensor, "controller.velocity_source"),
        (compensation.adaptive, "compensation.adaptive"),
        (compensation.guard, "compensation.guard"),
    ]
    .into_iter()
    .filter(|(present, _)| *present)
    .map(|(_, key)| key.to_owned())
    .collect()
}
