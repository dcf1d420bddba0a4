//! Actuator, supply and servovalve.

use crate::config::section::section;

use crate::error::{Error, Result};

section! {
    /// `[actuator]`, Eq. (7).
    pub struct Actuator {
        /// Effective piston area A, m².
        pub piston_area: f64,
        /// Oil compressibility of the chambers K_a, m³/Pa.
        pub compressibility: f64,
        /// Cross-piston leakage C_l, m³/(s·Pa).
        pub leakage: f64,
        /// Stroke to either side of the middle, m.
        pub stroke: f64,
        /// Remaining length of a chamber at the end of the stroke, volume over piston area, m; constant volumes
        /// if absent.
        pub dead_length: Option<f64>,
        /// Area of the side that pushes over that of the side that pulls, dimensionless.
        pub area_ratio: f64,
        /// Stiffness of clevises and load cell between piston and structure, N/m; rigid if absent.
        pub attachment_stiffness: Option<f64>,
        /// Play of the attachment from one side to the other, m.
        pub attachment_play: f64,
        /// Coulomb friction of the seals, N.
        pub friction: f64,
        /// Velocity below which the friction falls to zero, m/s.
        pub friction_velocity: f64,
        /// Flow of the open bypass valve across the piston at a load pressure of 1 MPa, m³/s; 0 means no valve.
        pub bypass_flow: f64,
        /// Time from a trip to the open bypass valve, s.
        pub bypass_time: f64,
        /// Stiffness of the stops at the ends of the stroke, N/m; no stops if absent.
        pub stop_stiffness: Option<f64>,
        /// Damping of the stops relative to their elastic force, s/m.
        pub stop_damping: f64,
    }
}

section! {
    /// `[supply]`.
    pub struct Supply {
        /// Supply pressure P_s at which the flow curve was measured, Pa.
        pub pressure: f64,
        /// Fall of the pressure with the pump's flow, Pa·s/m³.
        pub droop: Option<f64>,
        /// Capacity of the accumulator, m³/Pa.
        pub accumulator: Option<f64>,
        /// The pump's largest flow, m³/s.
        pub pump_flow: Option<f64>,
        /// The set pressure against time.
        pub schedule: Option<SupplySchedule>,
    }
}

section! {
    /// `[supply.schedule]`: the set pressure against time, with linear interpolation.
    pub struct SupplySchedule {
        /// Times of the points, strictly increasing, s.
        pub times: Vec<f64>,
        /// Set pressures at the points, Pa.
        pub pressures: Vec<f64>,
    }
}

section! {
    /// `[servovalve]`: the true valve, Eqs. (2), (3) and (6).
    pub struct Servovalve {
        /// Time constant of the pilot stage τ, s.
        pub pilot_time_constant: f64,
        /// Flow gain of the pilot stage K_vp, m³/(s·V).
        pub pilot_flow_gain: f64,
        /// End area of the main spool A_v, m².
        pub spool_area: f64,
        /// Stroke of the main spool to either side x_vmax, m.
        pub spool_stroke: f64,
        /// Sensitivity of the spool position sensor K_3, V/m.
        pub spool_sensitivity: f64,
        /// Ratio of the true flow to that of the valve's curve, dimensionless.
        pub flow_gain_scale: f64,
        /// The controller's flow curve f, Table 2.
        pub flow_table: FlowCurve,
        /// The true valve's flow curve, if it differs.
        pub true_flow_table: Option<FlowCurve>,
        /// Largest flow of the pilot stage, m³/s.
        pub pilot_flow_limit: Option<f64>,
        /// Natural frequency of the torque motor before the pilot stage, Hz; no motor if absent.
        pub torque_motor_frequency: Option<f64>,
        /// Damping ratio of the torque motor, dimensionless.
        pub torque_motor_damping: f64,
        /// Overlap of the spool's lands as an opening; negative means underlap, dimensionless.
        pub overlap: f64,
        /// Spool opening at which the valve passes nothing at no load, dimensionless.
        pub null_bias: f64,
        /// Leakage of the main stage, Eq. (5).
        pub leakage: ValveLeakage,
    }
}

section! {
    /// `[servovalve.leakage]`, the second part of Eq. (5).
    pub struct ValveLeakage {
        /// Part proportional to the load pressure, m³/(s·Pa).
        pub proportional: f64,
        /// Constant part at `supply.pressure`, m³/s.
        pub constant: f64,
        /// Opening within which the constant part changes its sign, dimensionless.
        pub null_region: f64,
    }
}

impl Actuator {
    /// Compressibility (m³/Pa) that a spring between piston and structure adds to the oil's: `A²/k`.
    pub(crate) fn attachment_compressibility(&self) -> f64 {
        self.attachment_stiffness.map_or(0.0, |stiffness| self.piston_area * self.piston_area / stiffness)
    }

    /// Factors (1) on the flow curve for a pulling and a pushing piston without load. The outflow of one side
    /// is the area ratio `n` times the inflow of the other, so the ports share the pressure unevenly. The
    /// factor is `√(2/(1 + n³))` for pulling, and `√n` times that for pushing.
    pub(crate) fn flow_factors(&self) -> [f64; 2] {
        let pulling = (2.0 / (1.0 + self.area_ratio.powi(3))).sqrt();
        [pulling, pulling * self.area_ratio.sqrt()]
    }
}

impl Servovalve {
    /// The flow curve of the true valve, before `flow_gain_scale`.
    pub(crate) fn true_curve(&self) -> &FlowCurve {
        self.true_flow_table.as_ref().unwrap_or(&self.flow_table)
    }
}

section! {
    /// A piecewise linear flow curve through (0, 0).
    pub struct FlowCurve {
        /// Spool openings of the points, strictly increasing, dimensionless.
        pub openings: Vec<f64>,
        /// No-load flows at the points, strictly increasing, m³/s.
        pub flows: Vec<f64>,
    }
}

impl FlowCurve {
    /// The slopes (m³/s) on both sides of the origin, the shallower first.
    pub(crate) fn slopes(&self) -> Result<(f64, f64)> {
        let [(_, pulling), (_, pushing)] = self.around(0.0)?;
        Ok((pulling.min(pushing), pulling.max(pushing)))
    }

    /// Flow (m³/s) and outward slope (m³/s) at an opening (1) of at least 0, and the same at minus the
    /// opening.
    pub(crate) fn around(&self, opening: f64) -> Result<[(f64, f64); 2]> {
        let last = self.openings.len() - 1;
        let beyond = |side: f64| {
            // The segment whose outer end is beyond the opening.
            let outer = (0..=last).filter(|i| side * self.openings[*i] > opening);
            let end = outer.min_by(|a, b| self.openings[*a].abs().total_cmp(&self.openings[*b].abs()))?;
            let start =
                if side > 0.0 { end.checked_sub(1)? } else { Some(end + 1).filter(|i| *i <= last)? };
            let slope = (self.flows[end] - self.flows[start]) / (self.openings[end] - self.openings[start]);
            Some((self.flows[start] + slope * (side * opening - self.openings[start]), slope))
        };
        match (beyond(1.0), beyond(-1.0)) {
            (Some(pulling), Some(pushing)) => Ok([pulling, pushing]),
            _ => Err(Error::value(
                "servovalve.flow_table.openings",
                format!("{} to {}", self.openings[0], self.openings[last]),
                format!("must reach beyond {opening} on both sides"),
            )),
        }
    }
}
