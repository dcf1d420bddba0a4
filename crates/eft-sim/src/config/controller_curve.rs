//! The flow curve that a controller inverts for a piston with unequal areas and a spool with underlap.
//!
//! Unequal areas scale the flow of each direction. With an underlap `u` the valve passes
//! `f(max(x + u, 0)) + f(min(x − u, 0))` at no load, which is continuous and is inverted exactly. An overlap is a
//! parameter of the controller of its own.

use super::sections::interpolated;
use super::{FlowCurve, RigConfig, TABLE_CAPACITY};
use crate::{Result, checks};

/// Points closer to each other than this share of their opening are merged.
const APART: f64 = 1e-6;

impl FlowCurve {
    /// The curve (opening to no-load flow) of a valve with this curve and an underlap.
    fn underlapped(&self, underlap: f64) -> Self {
        let pulling = self.openings.iter().filter(|x| **x >= 0.0).map(|x| x - underlap);
        let pushing = self.openings.iter().filter(|x| **x <= 0.0).map(|x| x + underlap);
        let last = self.openings.len() - 1;
        let openings = sorted(
            pulling.chain(pushing),
            (self.openings[0] + underlap).min(-underlap),
            (self.openings[last] - underlap).max(underlap),
        );
        let flow = |x: f64| self.at((x + underlap).max(0.0)) + self.at((x - underlap).min(0.0));
        Self { flows: openings.iter().map(|x| flow(*x)).collect(), openings }
    }

    /// The curve with factors (1) on the flows of a pulling and a pushing piston.
    fn scaled(&self, [pulling, pushing]: [f64; 2]) -> Self {
        let factor = |flow: f64| if flow < 0.0 { pushing } else { pulling };
        let flows = self.flows.iter().map(|flow| factor(*flow) * flow).collect();
        Self { openings: self.openings.clone(), flows }
    }

    /// Flow (m³/s) at an opening (1), constant beyond the ends.
    fn at(&self, opening: f64) -> f64 {
        interpolated(&self.openings, &self.flows, opening)
    }
}

impl RigConfig {
    /// The flow curve that the controller of this rig inverts: the flow table with the configured areas and underlap.
    pub(crate) fn controller_curve(&self) -> &FlowCurve {
        self.inverted.as_ref().unwrap_or(&self.servovalve.flow_table)
    }

    /// The flow table (m³/s) with the configured areas of the piston.
    fn piston_curve(&self) -> FlowCurve {
        self.values.servovalve.flow_table.scaled(self.values.actuator.flow_factors())
    }

    /// Computes the controller's curve if the areas are unequal or an underlap is configured.
    ///
    /// # Errors
    /// The table has no room for the points of the underlap.
    pub(super) fn set_controller_curve(&mut self) -> Result<()> {
        let underlap = (-self.values.servovalve.overlap).max(0.0);
        let mut curve = self.piston_curve();
        if underlap > 0.0 {
            curve = curve.underlapped(underlap);
        }
        let fits = curve.openings.len() <= TABLE_CAPACITY;
        let points = format!("{} values", self.values.servovalve.flow_table.openings.len());
        let allowed = format!("must have at most {} values with an underlap", TABLE_CAPACITY - 1);
        checks::require(fits, "servovalve.flow_table.openings", points, allowed)?;
        self.inverted = (curve != self.values.servovalve.flow_table).then_some(curve);
        Ok(())
    }

    /// The spool opening (1) for one of a valve without overlap.
    pub(crate) fn add_overlap(&self, opening: f64) -> f64 {
        if opening == 0.0 { 0.0 } else { opening + self.servovalve.overlap.max(0.0).copysign(opening) }
    }

    /// Learned no-load flows (m³/s) at the openings of the flow table, for a controller that knows the areas and the
    /// lap. `found` returns them at openings of the spool.
    pub fn found_flows(&self, found: impl FnOnce(&[f64]) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
        let table = &self.servovalve.flow_table;
        let Some(curve) = &self.inverted else {
            return found(&table.openings.iter().map(|x| self.add_overlap(*x)).collect::<Vec<_>>());
        };
        let opening = |flow: &f64| interpolated(&curve.flows, &curve.openings, *flow);
        let openings: Vec<f64> = self.piston_curve().flows.iter().map(opening).collect();
        let flows = found(&openings.iter().map(|x| self.add_overlap(*x)).collect::<Vec<_>>())?;
        // Beyond the curve's ends the last ratio continues.
        let ratio = |(found, opening): (f64, &f64)| found / curve.at(*opening);
        let ratios = flows.into_iter().zip(&openings).map(ratio);
        let flow = |(flow, ratio): (&f64, f64)| if *flow == 0.0 { 0.0 } else { flow * ratio };
        Some(table.flows.iter().zip(ratios).map(flow).collect())
    }
}

/// These numbers within two, ascending, each once.
fn sorted(of: impl Iterator<Item = f64>, lowest: f64, highest: f64) -> Vec<f64> {
    let mut within: Vec<f64> = of.filter(|x| (lowest..=highest).contains(x)).collect();
    within.sort_by(f64::total_cmp);
    within.dedup_by(|next, x| *next - *x <= APART * x.abs());
    within
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPENINGS: [f64; 7] = [-0.05, -0.01, -0.002, 0.003, 0.02, 0.4, -0.7];

    fn with_overlap(overlap: f64) -> RigConfig {
        RigConfig::zhao2005().with(|rig| rig.servovalve.overlap = overlap).unwrap()
    }

    /// No-load flow of the true valve, for equal areas.
    fn passed(rig: &RigConfig, x: f64) -> f64 {
        let (o, f) = (rig.servovalve.overlap, &rig.servovalve.flow_table);
        if o > 0.0 { f.at(x - x.clamp(-o, o)) } else { f.at((x - o).max(0.0)) + f.at((x + o).min(0.0)) }
    }

    /// The rig with a piston whose pushing side has 1.4 times the area.
    fn pushing_more(rig: &RigConfig) -> RigConfig {
        rig.with(|rig| rig.actuator.area_ratio = 1.4).unwrap()
    }

    #[test]
    fn with_an_underlap_the_controller_has_the_curve_of_the_valve() {
        for overlap in [-2e-3, -0.02] {
            let rig = with_overlap(overlap);
            let curve = rig.controller_curve();
            for x in OPENINGS {
                let error = (curve.at(x) - passed(&rig, x)).abs();
                assert!(error < 1e-15, "{overlap} {x}: {error}");
            }
        }
    }

    #[test]
    fn the_controller_has_the_no_load_flow_of_unequal_areas() {
        // Two lands in series: the flow out of one side is 1.4 times the flow into the other.
        let (pulling, pushing) = ((2.0_f64 / 3.744).sqrt(), (2.8_f64 / 3.744).sqrt());
        for overlap in [0.0, -0.02] {
            let rig = with_overlap(overlap);
            let curve = pushing_more(&rig).controller_curve().clone();
            for x in [-0.7, -0.05, 0.05, 0.4] {
                let factor = if x < 0.0 { pushing } else { pulling };
                let error = (curve.at(x) - factor * passed(&rig, x)).abs();
                assert!(error < 1e-15, "{overlap} {x}: {error}");
            }
        }
    }

    #[test]
    fn an_opening_over_the_overlap_passes_the_flow_of_the_table() {
        for overlap in [0.0, 1e-3, 0.03] {
            let rig = with_overlap(overlap);
            for y in OPENINGS.into_iter().chain([0.0]) {
                let error = (passed(&rig, rig.add_overlap(y)) - rig.servovalve.flow_table.at(y)).abs();
                assert!(error < 1e-15, "{overlap} {y}: {error}");
            }
        }
        assert_eq!(with_overlap(-0.02).add_overlap(0.01), 0.01);
    }

    #[test]
    fn a_table_without_space_for_the_lap_is_refused_by_name() {
        let openings: Vec<f64> = (0..64).map(|n| f64::from(n - 32) / 32.0).collect();
        let rig = RigConfig::zhao2005().with(|rig| {
            rig.servovalve.flow_table.flows = openings.iter().map(|x| 1e-2 * x).collect();
            rig.servovalve.flow_table.openings = openings;
            rig.servovalve.overlap = -1e-3;
        });
        let message = rig.unwrap_err().to_string();
        assert!(message.contains("servovalve.flow_table.openings") && message.contains("63"), "{message}");
        // Wide laps leave only the end points, which must stay in order.
        for overlap in [-0.025, -0.1, -0.5] {
            let rig = with_overlap(overlap);
            let curve = rig.controller_curve();
            for list in [&curve.openings, &curve.flows] {
                assert!(list.windows(2).all(|pair| pair[0] < pair[1]), "{overlap}: {list:?}");
            }
            assert!(curve.openings.iter().all(|x| x.abs() <= 1.0 + 1e-12), "{overlap}");
        }
    }

    #[test]
    fn found_flows_exclude_the_lap_and_the_areas() {
        for (overlap, unequal) in
            [(0.0, false), (2e-3, false), (0.05, false), (-2e-3, false), (0.0, true), (2e-3, true)]
        {
            let plain = with_overlap(overlap);
            let rig = if unequal { pushing_more(&plain) } else { plain };
            let [pulling, pushing] = rig.actuator.flow_factors();
            // A valve that passes 5 % more.
            let passed = |x: &f64| 1.05 * passed(&rig, *x) * if *x < 0.0 { pushing } else { pulling };
            let found = rig.found_flows(|x| Some(x.iter().map(passed).collect()));
            for (found, flow) in found.unwrap().iter().zip(&rig.servovalve.flow_table.flows) {
                assert!(
                    (found - 1.05 * flow).abs() <= 1e-12 * flow.abs(),
                    "{overlap} {unequal}: {found} {flow}"
                );
            }
        }
    }
}
