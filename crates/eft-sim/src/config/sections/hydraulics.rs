//! Actuator, supply and servovalve.

use eft_core::FlowTable;

use crate::config::schema::Kind::{Float, Floats};
use crate::config::schema::Need::{Optional, Required};
use crate::config::schema::{float, key};
use crate::config::section::section;
use crate::{Error, Result};

section! {
    /// `[actuator]`, Eq. (7).
    pub struct Actuator in "actuator." {
        piston_area: f64 = "m²", Float(1e-8, 1e2), Required, "effective piston area A";
        compressibility: f64 = "m³/Pa", Float(1e-20, 1.0), Required, "oil compressibility of the chambers K_a, Eq. (7)";
        leakage: f64 = "m³/(s·Pa)", Float(0.0, 1e-3), Required, "cross-piston leakage C_l, Eq. (7)";
        stroke: f64 = "m", Float(1e-4, 1e2), Required, "stroke to either side of the middle";
        dead_length: Option<f64> = "m", Float(1e-4, 1e3), Optional, "remaining length of a chamber at the end of the stroke, volume over area; absent means constant volumes";
        area_ratio: f64 = "", Float(0.1, 10.0), float(1.0), "area of the piston's side that pushes over `actuator.piston_area`, the side that pulls; the flow curve is that of equal areas";
        attachment_stiffness: Option<f64> = "N/m", Float(1e3, 1e15), Optional, "stiffness of clevises and load cell between piston and structure; absent means rigid";
        attachment_play: f64 = "m", Float(0.0, 1e-2), float(0.0), "play of clevises and load cell from one side to the other";
        friction: f64 = "N", Float(0.0, 1e9), float(0.0), "Coulomb friction of the seals";
        friction_velocity: f64 = "m/s", Float(1e-6, 1.0), float(1e-3), "velocity below which the friction falls to zero";
        bypass_flow: f64 = "m³/s", Float(0.0, 1.0), float(0.0), "bypass valve across the piston, which opens after a trip: flow of the open valve at a load pressure of 1 MPa; 0 means no bypass valve";
        bypass_time: f64 = "s", Float(1e-4, 1e2), float(0.05), "time from a trip to the open bypass valve";
        stop_stiffness: Option<f64> = "N/m", Float(1.0, 1e15), Optional, "stiffness of the stops at the ends of the stroke; absent means no stops";
        stop_damping: f64 = "s/m", Float(0.0, 1e3), float(0.0), "damping of the stops relative to their elastic force";
    }
}

section! {
    /// `[supply]`.
    pub struct Supply in "supply." {
        pressure: f64 = "Pa", Float(1e3, 1e9), Required, "supply pressure P_s at which the flow curve was measured";
        droop: Option<f64> = "Pa·s/m³", Float(1e-3, 1e18), Optional, "decrease of the pressure with the pump's flow; absent means no droop";
        accumulator: Option<f64> = "m³/Pa", Float(1e-18, 1.0), Optional, "capacity of the accumulator, gas volume over exponent times pressure";
        pump_flow: Option<f64> = "m³/s", Float(0.0, 1e3), Optional, "largest flow of the pump";
        /// The set pressure against time.
        schedule: Option<SupplySchedule>;
    }
}

section! {
    /// `[supply.schedule]`: the set pressure against time, with linear interpolation.
    pub struct SupplySchedule in "supply.schedule." {
        times: Vec<f64> = "s", Floats(1, 64, -1e6, 1e6), Optional, "times of the set pressures, with linear interpolation";
        pressures: Vec<f64> = "Pa", Floats(1, 64, 0.0, 1e9), Optional, "set pressures at those times";
    }
}

section! {
    /// `[servovalve]`: the true valve, Eqs. (2), (3) and (6).
    pub struct Servovalve in "servovalve." {
        pilot_time_constant: f64 = "s", Float(1e-6, 1.0), Required, "time constant of the pilot stage τ, Eq. (2)";
        pilot_flow_gain: f64 = "m³/(s·V)", Float(1e-12, 1.0), Required, "flow gain of the pilot stage K_vp, Eq. (2)";
        spool_area: f64 = "m²", Float(1e-9, 1.0), Required, "end area of the main spool A_v, Eq. (3)";
        spool_stroke: f64 = "m", Float(1e-6, 1.0), Required, "stroke of the main spool to either side x_vmax";
        spool_sensitivity: f64 = "V/m", Float(1e-3, 1e9), Required, "sensitivity of the spool position sensor K_3";
        flow_gain_scale: f64 = "", Float(1e-2, 1e2), float(1.0), "true flow over the flow of the valve's curve";
        /// The controller's flow curve f, Table 2.
        flow_table: FlowCurve { &[
            key("servovalve.flow_table.openings", "", Floats(2, 64, -1.0, 1.0), Required, "spool openings of the controller's flow curve, Table 2"),
            key("servovalve.flow_table.flows", "m³/s", Floats(2, 64, -1e3, 1e3), Required, "no-load flows at those openings, Table 2"),
        ] };
        /// The true valve's flow curve, if it differs.
        true_flow_table: Option<FlowCurve> { &[
            key("servovalve.true_flow_table.openings", "", Floats(2, 64, -1.0, 1.0), Optional, "spool openings of the true valve's flow curve, if it differs from the controller's"),
            key("servovalve.true_flow_table.flows", "m³/s", Floats(2, 64, -1e3, 1e3), Optional, "no-load flows at those openings"),
        ] };
        pilot_flow_limit: Option<f64> = "m³/s", Float(1e-12, 1e3), Optional, "largest flow of the pilot stage";
        torque_motor_frequency: Option<f64> = "Hz", Float(1.0, 1e6), Optional, "natural frequency of the torque motor before the pilot stage, second order; absent means no torque motor";
        torque_motor_damping: f64 = "", Float(0.05, 10.0), float(0.7), "damping ratio of the torque motor";
        overlap: f64 = "", Float(-0.5, 0.5), float(0.0), "overlap of the spool's lands, an opening without flow; a negative value is an underlap, within which all ports are open; the nonlinear compensation compensates for the configured value";
        null_bias: f64 = "", Float(-0.5, 0.5), float(0.0), "null bias: spool opening at which the valve passes nothing at no load; the controller adds it to every opening";
        /// Leakage of the main stage, Eq. (5).
        leakage: ValveLeakage;
    }
}

section! {
    /// `[servovalve.leakage]`, the second part of Eq. (5).
    pub struct ValveLeakage in "servovalve.leakage." {
        proportional: f64 = "m³/(s·Pa)", Float(0.0, 1e-3), float(0.0), "leakage of the main stage proportional to the load pressure, Eq. (5)";
        constant: f64 = "m³/s", Float(0.0, 1.0), float(0.0), "constant leakage of the main stage at `supply.pressure`, Eq. (5)";
        null_region: f64 = "", Float(1e-6, 1.0), float(0.003), "opening within which the constant leakage changes its sign";
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

impl SupplySchedule {
    /// Set pressure (Pa) at a time (s).
    pub(crate) fn at(&self, time: f64) -> f64 {
        interpolated(&self.times, &self.pressures, time)
    }
}

/// Linear between the points, constant beyond them.
pub(crate) fn interpolated(at: &[f64], values: &[f64], x: f64) -> f64 {
    let above = at.partition_point(|point| *point <= x);
    match (above.checked_sub(1), values.get(above)) {
        (None, _) => values[0],
        (Some(below), Some(next)) => {
            let share = (x - at[below]) / (at[above] - at[below]);
            values[below] + share * (next - values[below])
        }
        (Some(below), None) => values[below],
    }
}

impl Servovalve {
    /// The flow curve of the true valve, before `flow_gain_scale`.
    pub(crate) fn true_curve(&self) -> &FlowCurve {
        self.true_flow_table.as_ref().unwrap_or(&self.flow_table)
    }
}

/// Largest number of points of a flow curve.
pub const TABLE_CAPACITY: usize = 64;

section! {
    /// A piecewise linear flow curve through (0, 0).
    pub struct FlowCurve in "" {
        /// Spool openings of the points, strictly increasing, dimensionless.
        openings: Vec<f64>;
        /// No-load flows at the points, strictly increasing, m³/s.
        flows: Vec<f64>;
    }
}

impl FlowCurve {
    /// The curve as a table of the core.
    pub(crate) fn table(&self) -> Result<FlowTable<f64, TABLE_CAPACITY>> {
        Ok(FlowTable::<f64, TABLE_CAPACITY>::new(&self.openings, &self.flows)?)
    }

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
        let short = || {
            let found = format!("{} to {}", self.openings[0], self.openings[last]);
            let allowed = format!("must reach beyond {opening} on both sides");
            Error::value("servovalve.flow_table.openings", found, allowed)
        };
        Ok([beyond(1.0).ok_or_else(short)?, beyond(-1.0).ok_or_else(short)?])
    }
}
