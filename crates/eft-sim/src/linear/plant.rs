//! Valve, actuator and structure near rest.

use nalgebra::{DMatrix, DVector, RowDVector};

use super::gains::Gains;
use crate::config::RigConfig;

/// Order of the plant's states: that of [`crate::rig::PlantState`].
pub(super) const PILOT_FLOW: usize = 0;
pub(super) const SPOOL: usize = 1;
pub(super) const PRESSURE: usize = 2;
pub(super) const DISPLACEMENT: usize = 3;
pub(super) const VELOCITY: usize = 4;
pub(super) const NAMES: [&str; 5] = ["pilot_flow", "spool", "load_pressure", "displacement", "velocity"];
pub(super) const STATES: usize = NAMES.len();

/// `ẋ = A·x + b·v` of the plant under a valve command `v` (V).
pub(super) struct LinearPlant {
    pub(super) a: DMatrix<f64>,
    pub(super) valve: DVector<f64>,
    piston_area: f64,
}

impl LinearPlant {
    /// Eqs. (2), (3), (6) without its root, (7), and the structure's slope at rest.
    pub(super) fn new(rig: &RigConfig, gains: &Gains) -> Self {
        let (valve, actuator, structure) = (&rig.servovalve, &rig.actuator, &rig.structure);
        let mut a = DMatrix::zeros(STATES, STATES);
        let pilot = valve.pilot_flow_gain / valve.pilot_time_constant;
        a[(PILOT_FLOW, PILOT_FLOW)] = -1.0 / valve.pilot_time_constant;
        a[(PILOT_FLOW, SPOOL)] = -pilot * valve.spool_sensitivity * valve.spool_stroke;
        a[(SPOOL, PILOT_FLOW)] = 1.0 / (valve.spool_area * valve.spool_stroke);
        a[(PRESSURE, SPOOL)] = gains.flow / actuator.compressibility;
        a[(PRESSURE, PRESSURE)] = -actuator.leakage / actuator.compressibility;
        a[(PRESSURE, VELOCITY)] = -actuator.piston_area / actuator.compressibility;
        a[(DISPLACEMENT, VELOCITY)] = 1.0;
        a[(VELOCITY, PRESSURE)] = actuator.piston_area / structure.mass;
        a[(VELOCITY, DISPLACEMENT)] = -structure.stiffness / structure.mass;
        a[(VELOCITY, VELOCITY)] = -structure.damping / structure.mass;
        let mut input = DVector::zeros(STATES);
        input[PILOT_FLOW] = pilot;
        Self { a, valve: input, piston_area: actuator.piston_area }
    }

    /// Force (N) from the state.
    pub(super) fn force(&self) -> RowDVector<f64> {
        let mut row = RowDVector::zeros(STATES);
        row[PRESSURE] = self.piston_area;
        row
    }

    /// Rate of the force (N/s) from the state.
    pub(super) fn force_rate(&self) -> RowDVector<f64> {
        self.a.row(PRESSURE) * self.piston_area
    }
}

/// The rows that every model shows: force (N), displacement (m), velocity (m/s), spool opening (1), load pressure (Pa).
pub(super) fn outputs(plant: &LinearPlant, states: usize) -> (DMatrix<f64>, Vec<String>) {
    let names = ["force", "displacement", "velocity", "spool", "load_pressure"];
    let mut c = DMatrix::zeros(names.len(), states);
    c[(0, PRESSURE)] = plant.force()[PRESSURE];
    for (row, state) in [(1, DISPLACEMENT), (2, VELOCITY), (3, SPOOL), (4, PRESSURE)] {
        c[(row, state)] = 1.0;
    }
    (c, names.map(str::to_owned).to_vec())
}
