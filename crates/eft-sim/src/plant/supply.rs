//! The hydraulic supply: `C·Ṗ = Q_pump − Q_drawn`, `Q_pump = (P_set(t) − P)/R` within the range of the pump.
//!
//! The pump keeps its set pressure less the droop `R·Q`. The accumulator of capacity `C = V_gas/(n·P)` (its
//! gas volume, the polytropic exponent and the pressure; Merritt, *Hydraulic Control Systems*, 1967) supplies
//! the flow that the pump cannot deliver at once. Without both, the pressure is the set pressure.

use eft_core::Mask;

use crate::config::{RigConfig, SupplySchedule};
use crate::lanes::Num;

/// Pump, accumulator and schedule of the set pressure.
#[derive(Debug, Clone)]
pub(crate) struct Supply<S: Num> {
    schedules: Vec<Option<SupplySchedule>>,
    constant: S,
    /// Whether any lane has an accumulator.
    has_accumulator: bool,
    yields: S::Mask,
    per_droop: S,
    pump_flow: S,
    per_capacity: S,
    capacity: S,
}

impl<S: Num> Supply<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let supply = |i: usize| &rig(i).supply;
        let mut schedules: Vec<_> = (0..S::LANES).map(|i| supply(i).schedule.clone()).collect();
        if schedules.iter().all(Option::is_none) {
            schedules.clear();
        }
        Self {
            schedules,
            constant: S::from_lanes(|i| supply(i).pressure),
            has_accumulator: (0..S::LANES).any(|i| supply(i).accumulator.is_some()),
            yields: S::Mask::from_lanes(|i| supply(i).accumulator.is_some()),
            per_droop: S::from_lanes(|i| supply(i).droop.map_or(0.0, |droop| 1.0 / droop)),
            pump_flow: S::from_lanes(|i| supply(i).pump_flow.unwrap_or(f64::MAX)),
            per_capacity: S::from_lanes(|i| supply(i).accumulator.map_or(0.0, |capacity| 1.0 / capacity)),
            capacity: S::from_lanes(|i| supply(i).accumulator.unwrap_or(0.0)),
        }
    }

    /// The pump's set pressure (Pa) at a time (s) of the test.
    #[inline(always)]
    pub(crate) fn setting(&self, time: S) -> S {
        if self.schedules.is_empty() { self.constant } else { self.scheduled(time) }
    }

    #[inline(never)]
    fn scheduled(&self, time: S) -> S {
        S::from_lanes(|i| match self.schedules.get(i) {
            Some(Some(schedule)) => schedule.at(time.lane(i)),
            _ => self.constant.lane(i),
        })
    }

    /// The pressure (Pa) at the valve; with an accumulator, the pressure of the accumulator.
    #[inline(always)]
    pub(crate) fn pressure(&self, setting: S, accumulator: S) -> S {
        if self.has_accumulator { S::select(self.yields, accumulator, setting) } else { setting }
    }

    /// Flow (m³/s) from the pump at a set pressure and a pressure (Pa) while the valves draw a flow (m³/s).
    #[inline(always)]
    pub(crate) fn pump_flow(&self, setting: S, pressure: S, drawn: S) -> S {
        if !self.has_accumulator {
            return drawn;
        }
        let given = ((setting - pressure) * self.per_droop).limit(S::splat(0.0), self.pump_flow);
        S::select(self.yields, given, drawn)
    }

    /// Rate (Pa/s) of the accumulator's pressure.
    #[inline(always)]
    pub(crate) fn rate(&self, pump_flow: S, drawn: S) -> S {
        (pump_flow - drawn) * self.per_capacity
    }

    /// Energy (J) in the accumulator at a pressure (Pa).
    pub(crate) fn stored(&self, pressure: S) -> S {
        S::splat(0.5) * self.capacity * pressure * pressure
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;
    use crate::plant::runge_kutta::{Equations, Stages, runge_kutta};

    const DROOP: f64 = 2e8;
    const CAPACITY: f64 = 7e-10;

    fn supply(extra: &[(&str, toml::Value)]) -> Supply<f64> {
        let mut changes = vec![("supply.droop", DROOP.into()), ("supply.accumulator", CAPACITY.into())];
        changes.extend(extra.iter().cloned());
        let rig = changed(&changes);
        Supply::pack(&|_| &rig)
    }

    /// An accumulator from which a flow (m³/s) is drawn.
    struct Drawn<'a>(&'a Supply<f64>, f64);

    impl Equations<f64> for Drawn<'_> {
        fn rate(&mut self, pressure: &[f64], time: f64, rate: &mut [f64]) {
            let Self(supply, drawn) = *self;
            rate[0] = supply.rate(supply.pump_flow(supply.setting(time), pressure[0], drawn), drawn);
        }
    }

    fn after(supply: &Supply<f64>, drawn: f64, time: f64) -> f64 {
        let step = time / 1000.0;
        let (mut pressure, mut stages) = ([1.9e7], Stages::new(&[1.9e7]));
        for n in 0..1000 {
            runge_kutta(&mut pressure, &mut stages, f64::from(n) * step, step, &mut Drawn(supply, drawn));
        }
        pressure[0]
    }

    #[test]
    fn a_step_of_flow_droops_exponentially() {
        let (supply, drawn, time): (_, f64, _) = (supply(&[]), 5e-3, 0.2);
        let expected = 1.9e7 - DROOP * drawn * (1.0 - (-time / (DROOP * CAPACITY)).exp());
        assert!((after(&supply, drawn, time) / expected - 1.0).abs() < 1e-10);
    }

    #[test]
    fn a_flow_above_the_pumps_empties_the_accumulator() {
        let supply = supply(&[("supply.pump_flow", 1e-3.into())]);
        // At its largest flow the pump cannot follow the droop, and the pressure falls linearly.
        let rate = |p| supply.rate(supply.pump_flow(1.9e7, p, 5e-3), 5e-3);
        assert_eq!(rate(1.8e7), (1e-3 - 5e-3) / CAPACITY);
        assert_eq!(rate(1.7e7), rate(1.8e7));
    }

    #[test]
    fn a_schedule_is_straight_between_its_points() {
        let points = |values: &[f64]| toml::Value::Array(values.iter().map(|v| (*v).into()).collect());
        let rig = changed(&[
            ("supply.schedule.times", points(&[1.0, 3.0])),
            ("supply.schedule.pressures", points(&[1.9e7, 1.5e7])),
        ]);
        let supply = Supply::<f64>::pack(&|_| &rig);
        let given = [0.0, 1.0, 1.5, 2.0, 3.0, 9.0].map(|t| supply.pressure(supply.setting(t), 0.0));
        assert_eq!(given, [1.9e7, 1.9e7, 1.8e7, 1.7e7, 1.5e7, 1.5e7]);
    }
}
