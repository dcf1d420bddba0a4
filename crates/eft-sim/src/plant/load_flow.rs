//! The main stage's load flow, Eq. (6) with Table 2: `Q_L = f(x_v)·√(1 − sgn(x_v)·P_L/P_s)`.

use eft_core::FlowTable;

use crate::Result;
use crate::config::{RigConfig, TABLE_CAPACITY};
use crate::lanes::Num;

/// Flow through the main stage into the actuator.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LoadFlow<S: Num> {
    curve: FlowTable<S, TABLE_CAPACITY>,
    scale: S,
    supply_pressure: S,
    per_supply_pressure: S,
    /// Whether the lands of any lane overlap or underlap.
    has_overlap: bool,
    overlap: S,
    /// Whether the areas of any lane's piston differ. The next fields are the area of the pushing side over
    /// the other (1), and the factor (1) on the flow.
    has_unequal_areas: bool,
    area_ratio: S,
    factor: S,
}

impl<S: Num> LoadFlow<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Result<Self> {
        let curves =
            (0..S::LANES).map(|i| rig(i).servovalve.true_curve().table()).collect::<Result<Vec<_>>>()?;
        Ok(Self {
            curve: FlowTable::pack(&|i| &curves[i]),
            scale: S::from_lanes(|i| rig(i).servovalve.flow_gain_scale),
            supply_pressure: S::from_lanes(|i| rig(i).supply.pressure),
            per_supply_pressure: S::from_lanes(|i| 1.0 / rig(i).supply.pressure),
            has_overlap: (0..S::LANES).any(|i| rig(i).servovalve.overlap != 0.0),
            overlap: S::from_lanes(|i| rig(i).servovalve.overlap),
            has_unequal_areas: (0..S::LANES).any(|i| rig(i).actuator.area_ratio != 1.0),
            area_ratio: S::from_lanes(|i| rig(i).actuator.area_ratio),
            factor: S::from_lanes(|i| rig(i).actuator.flow_factors()[0]),
        })
    }

    /// Load flow (m³/s) and its slope over the opening (m³/s per unit opening). The arguments are a spool
    /// opening (1), a load pressure (Pa), and the supply pressure over that of the curve's measurement (1).
    /// If the load pressure exceeds the supply the flow is reversed: the root has the sign of its radicand.
    #[inline(always)]
    pub(crate) fn flow_and_gain(&self, opening: S, load_pressure: S, relative_supply: S) -> (S, S) {
        let ratio = (load_pressure * self.per_supply_pressure).times_sign_of(opening);
        let radicand = relative_supply - ratio;
        let root = radicand.abs().sqrt().times_sign_of(radicand);
        let (flow, slope) = self.curve.flow_and_slope(opening);
        (self.scale * flow * root, self.scale * slope * root)
    }

    /// Load flow (m³/s) at a supply pressure (Pa), and the flow (m³/s) drawn from the supply. With an overlap
    /// `o` of the lands, the ports for pulling are open by `max(x_v − o, 0)` and those for pushing by
    /// `min(x_v + o, 0)`. Within an underlap, `o < 0`, both are open (Merritt 1967).
    #[inline(always)]
    pub(crate) fn flow_at(&self, opening: S, load_pressure: S, supply_pressure: S) -> (S, S) {
        let relative_supply = supply_pressure / self.supply_pressure;
        if !self.has_overlap {
            return self.port_flow(opening, load_pressure, relative_supply);
        }
        let (zero, most) = (S::splat(0.0), S::splat(f64::MAX));
        let pulling = (opening - self.overlap).limit(zero, most);
        let pushing = (opening + self.overlap).limit(-most, zero);
        let pulled = self.port_flow(pulling, load_pressure, relative_supply);
        let pushed = self.port_flow(pushing, load_pressure, relative_supply);
        (pulled.0 + pushed.0, pulled.1 + pushed.1)
    }

    /// The same for the ports of one direction. With an area ratio `n` the flow `A·ẋ` of the pulling side is
    /// `√(2/(1 + n³))·f(x_v)` times a root. The root is `√(P/P_s − P_L/P_s)` for pulling and `√(n·P/P_s +
    /// P_L/P_s)` for pushing, where `P_L` is the force over `piston_area`. The pressures of the chambers are
    /// in equilibrium.
    #[inline(always)]
    fn port_flow(&self, opening: S, load_pressure: S, relative_supply: S) -> (S, S) {
        if !self.has_unequal_areas {
            let (flow, _) = self.flow_and_gain(opening, load_pressure, relative_supply);
            return (flow, flow.times_sign_of(opening));
        }
        let ratio = S::select(opening.lt(S::splat(0.0)), self.area_ratio, S::splat(1.0));
        let (flow, _) = self.flow_and_gain(opening, load_pressure, ratio * relative_supply);
        let flow = self.factor * flow;
        (flow, ratio * flow.times_sign_of(opening))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn at_the_measured_pressure_the_flow_is_eq_6() {
        let rig = changed(&[]);
        let valve = LoadFlow::<f64>::pack(&|_| &rig).unwrap();
        for opening in [-0.8, -0.13, 0.0, 0.05, 0.6] {
            for load in [-2.2e7, -9e6, 0.0, 5e6, 2.5e7] {
                let (flow, drawn) = valve.flow_at(opening, load, 1.9e7);
                let part = 1.0 - load * f64::signum(opening) / 1.9e7;
                let eq_6 = valve.curve.flow(opening) * part.signum() * part.abs().sqrt();
                assert!((flow - eq_6).abs() <= 1e-14 * eq_6.abs().max(1e-3));
                assert_eq!(drawn, if opening < 0.0 { -flow } else { flow });
            }
        }
    }

    #[test]
    fn flow_follows_the_root_of_the_pressure_and_the_overlap_passes_nothing() {
        let rig = changed(&[("servovalve.overlap", 0.03.into())]);
        let valve = LoadFlow::<f64>::pack(&|_| &rig).unwrap();
        let no_load = |opening, pressure| valve.flow_at(opening, 0.0, pressure).0;
        assert!((no_load(0.5, 0.81 * 1.9e7) / no_load(0.5, 1.9e7) - 0.9).abs() < 1e-12);
        assert_eq!(no_load(0.03, 1.9e7), 0.0);
        assert_eq!(no_load(-0.02, 1.9e7), 0.0);
        // 0.13 − 0.03 is the table's first point.
        assert!((no_load(0.13, 1.9e7) - 102.2 * 1.6387064e-5).abs() < 1e-15);
        assert!((no_load(-0.13, 1.9e7) + 101.0 * 1.6387064e-5).abs() < 1e-15);
    }

    #[test]
    fn within_an_underlap_both_directions_are_open() {
        let lap = 0.02;
        let rig = changed(&[("servovalve.overlap", (-lap).into())]);
        let valve = LoadFlow::<f64>::pack(&|_| &rig).unwrap();
        let supply = 1.9e7;
        // The bridge of four lands, Merritt's open-centre valve, with the flow of each land at the pressures
        // of the chambers.
        for (opening, load) in
            [(0.0, 0.0), (0.0, 4e6), (0.012, -3e6), (-0.019, 6e6), (0.05, 2e6), (-0.3, 5e6)]
        {
            let [first, second] = [(supply + load) / 2.0, (supply - load) / 2.0];
            let land = |area: f64, drop: f64| {
                let by = valve.curve.flow(area) * (drop / (supply / 2.0)).sqrt();
                if area > 0.0 { by } else { 0.0 }
            };
            let back = |area: f64, drop: f64| {
                let by = -valve.curve.flow(-area) * (drop / (supply / 2.0)).sqrt();
                if area > 0.0 { by } else { 0.0 }
            };
            let expected = land(lap + opening, supply - first) - back(lap - opening, first);
            let drawn = land(lap + opening, supply - first) + back(lap - opening, supply - second);
            let (flow, taken) = valve.flow_at(opening, load, supply);
            assert!((flow - expected).abs() < 1e-15 && (taken - drawn).abs() < 1e-15, "{opening} {load}");
        }
        // The gain at null is the sum of both ports, and they leak with the load pressure.
        let rest = rig.at_rest(&rig.servovalve.flow_table).unwrap();
        let flow = |opening, load| valve.flow_at(opening, load, supply).0;
        assert!(((flow(1e-6, 0.0) - flow(-1e-6, 0.0)) / 2e-6 / rest.steeper - 1.0).abs() < 1e-9);
        assert!(((flow(0.0, -1e3) - flow(0.0, 1e3)) / 2e3 / rest.leakage - 1.0).abs() < 1e-6);
    }

    #[test]
    fn unequal_areas_share_the_pressure_like_two_lands_in_series() {
        let (ratio, supply) = (1.3, 1.9e7);
        let rig = changed(&[("actuator.area_ratio", ratio.into())]);
        let valve = LoadFlow::<f64>::pack(&|_| &rig).unwrap();
        for opening in [0.3, -0.3] {
            for load in [-8e6, 0.0, 5e6] {
                let (flow, drawn) = valve.flow_at(opening, load, supply);
                // Each land takes (Q/g)² of pressure, g = f(x_v)/√(P_s/2); the flow of the other side is
                // scaled by the area ratio.
                let conductance = valve.curve.flow(opening).abs() / (supply / 2.0_f64).sqrt();
                let drop = |flow: f64| (flow / conductance).powi(2);
                let (near, far) = (drop(flow), drop(ratio * flow));
                let [first, second] = if opening > 0.0 { [supply - near, far] } else { [near, supply - far] };
                assert!((first - ratio * second - load).abs() < 1e-6 * supply, "{opening} {load}");
                let taken = if opening > 0.0 { flow } else { -ratio * flow };
                assert!((drawn - taken).abs() < 1e-15);
            }
        }
        let rest = rig.at_rest(&rig.servovalve.flow_table).unwrap();
        let slopes = [1e-6, -1e-6].map(|x: f64| valve.flow_at(x, 0.0, supply).0 / x);
        assert!(
            (slopes[0] / rest.shallower - 1.0).abs() < 1e-9 && (slopes[1] / rest.steeper - 1.0).abs() < 1e-9
        );
    }
}
