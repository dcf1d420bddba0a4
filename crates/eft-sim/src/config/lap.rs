//! The flow curve that a controller inverts for a spool with overlap or underlap.
//!
//! With an overlap `o` the valve at the opening `x` passes `f(x − sat(x, o))`, so that the flow `f(y)` needs the opening
//! `y + o·sgn(y)`. The step at null would cause chatter, so it is replaced by a straight line over the width
//! `δ = 4·o`:
//! `x = y + o·sat(y/δ)`. With an underlap `u` the valve passes `f(max(x + u, 0)) + f(min(x − u, 0))` at no
//! load, which is continuous and is inverted exactly.

use super::{FlowCurve, RigConfig};
use crate::error::{Error, Result};
use crate::plant::TABLE_CAPACITY;

/// Width `δ` of the smooth step over the overlap. The compensation's gain near null is larger by the inverse
/// of this, a quarter. With a smaller width the loop through the piston's motion may oscillate when the force
/// loop has already opened the valve.
const WIDTH_OVER_OVERLAP: f64 = 4.0;
/// Points closer to each other than this share of their opening are merged.
const APART: f64 = 1e-6;

impl FlowCurve {
    /// The curve (opening to no-load flow) of a valve with this curve and an overlap, smoothed as the module
    /// describes.
    fn lapped(&self, overlap: f64) -> Self {
        if overlap < 0.0 { self.underlapped(-overlap) } else { self.overlapped(overlap) }
    }

    fn overlapped(&self, overlap: f64) -> Self {
        let width = WIDTH_OVER_OVERLAP * overlap;
        let gain = 1.0 + overlap / width;
        let widened =
            |inner: f64| if inner.abs() < width { gain * inner } else { inner + overlap.copysign(inner) };
        let end = if width + overlap < 1.0 { 1.0 - overlap } else { 1.0 / gain };
        let last = self.openings.len() - 1;
        let (lowest, highest) = (self.openings[0].max(-end), self.openings[last].min(end));
        let further = [lowest, -width, width, highest];
        let inner = sorted(self.openings.iter().copied().chain(further), lowest, highest);
        Self {
            flows: inner.iter().map(|inner| self.at(*inner)).collect(),
            openings: inner.into_iter().map(widened).collect(),
        }
    }

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

    /// Flow (m³/s) at an opening (1), constant beyond the ends.
    fn at(&self, opening: f64) -> f64 {
        interpolated(&self.openings, &self.flows, opening)
    }
}

impl RigConfig {
    /// The flow curve that the controller of this rig inverts: the flow table with the configured lap.
    pub(crate) fn controller_curve(&self) -> &FlowCurve {
        self.lapped.as_ref().unwrap_or(&self.servovalve.flow_table)
    }

    /// Computes the controller's curve if a lap is configured.
    ///
    /// # Errors
    /// The table has no room for the points of the lap.
    pub(super) fn lap(&mut self) -> Result<()> {
        let valve = &self.values.servovalve;
        if valve.overlap == 0.0 {
            return Ok(());
        }
        let curve = valve.flow_table.lapped(valve.overlap);
        if curve.openings.len() > TABLE_CAPACITY {
            let points = format!("{} values", valve.flow_table.openings.len());
            let allowed = format!("must have at most {} values with an overlap", TABLE_CAPACITY - 2);
            return Err(Error::value("servovalve.flow_table.openings", points, allowed));
        }
        self.lapped = Some(curve);
        Ok(())
    }

    /// Learned no-load flows (m³/s) at the openings of the flow table, for a controller whose curve contains
    /// the lap. `found` returns them at openings of the spool.
    pub fn found_flows(&self, found: impl FnOnce(&[f64]) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
        let table = &self.servovalve.flow_table;
        let Some(curve) = &self.lapped else {
            return found(&table.openings);
        };
        let opening = |flow: &f64| interpolated(&curve.flows, &curve.openings, *flow);
        let openings: Vec<f64> = table.flows.iter().map(opening).collect();
        let flows = found(&openings)?;
        // Beyond the curve's ends the last ratio continues.
        let ratio = |(found, opening): (f64, &f64)| found / curve.at(*opening);
        let ratios = flows.into_iter().zip(&openings).map(ratio);
        Some(
            table
                .flows
                .iter()
                .zip(ratios)
                .map(|(flow, r)| if *flow == 0.0 { 0.0 } else { flow * r })
                .collect(),
        )
    }
}

/// These numbers within two, ascending, each once.
fn sorted(of: impl Iterator<Item = f64>, lowest: f64, highest: f64) -> Vec<f64> {
    let mut within: Vec<f64> = of.filter(|x| (lowest..=highest).contains(x)).collect();
    within.sort_by(f64::total_cmp);
    within.dedup_by(|next, x| *next - *x <= APART * x.abs());
    within
}

/// Linear between the points, constant beyond them.
fn interpolated(at: &[f64], values: &[f64], x: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    const OPENINGS: [f64; 7] = [-0.05, -0.01, -0.002, 0.003, 0.02, 0.4, -0.7];

    fn with_overlap(overlap: f64) -> RigConfig {
        RigConfig::zhao2005().with(|rig| rig.servovalve.overlap = overlap).unwrap()
    }

    /// No-load flow of the true valve.
    fn passed(rig: &RigConfig, x: f64) -> f64 {
        let (o, f) = (rig.servovalve.overlap, &rig.servovalve.flow_table);
        if o > 0.0 { f.at(x - x.clamp(-o, o)) } else { f.at((x - o).max(0.0)) + f.at((x + o).min(0.0)) }
    }

    #[test]
    fn beyond_the_smooth_step_the_controller_has_the_curve_of_the_valve() {
        for overlap in [1e-3, 5e-3, 0.03, -2e-3, -0.02] {
            let rig = with_overlap(overlap);
            let curve = rig.controller_curve();
            for x in OPENINGS.into_iter().filter(|x| overlap < 0.0 || x.abs() >= 5.0 * overlap) {
                let error = (curve.at(x) - passed(&rig, x)).abs();
                assert!(error < 1e-15, "{overlap} {x}: {error}");
            }
        }
    }

    #[test]
    fn within_the_smooth_step_the_flow_is_at_most_the_demand_and_the_gain_a_quarter_larger() {
        let rig = with_overlap(2e-3);
        let (curve, table) = (rig.controller_curve(), &rig.servovalve.flow_table);
        for n in (-40..=40).filter(|n| *n != 0) {
            let inner = f64::from(n) * 2e-4;
            let flow = table.at(inner);
            let opening = interpolated(&curve.flows, &curve.openings, flow);
            let through = passed(&rig, opening);
            assert!(through.abs() <= flow.abs() + 1e-18 && through * flow >= 0.0, "{n}");
            assert!((opening / inner - 1.25).abs() < 1e-9, "{n}");
        }
        assert_eq!(interpolated(&curve.flows, &curve.openings, 0.0), 0.0);
    }

    #[test]
    fn a_table_without_space_for_the_lap_is_refused_by_name() {
        let openings: Vec<f64> = (0..63).map(|n| f64::from(n - 31) / 31.0).collect();
        let rig = RigConfig::zhao2005().with(|rig| {
            rig.servovalve.flow_table.flows = openings.iter().map(|x| 1e-2 * x).collect();
            rig.servovalve.flow_table.openings = openings;
            rig.servovalve.overlap = 1e-3;
        });
        let message = rig.unwrap_err().to_string();
        assert!(message.contains("servovalve.flow_table.openings") && message.contains("62"), "{message}");
        // Wide laps leave only the end points, which must stay in order.
        for overlap in [0.5, 0.3, 0.1, 0.025, -0.025, -0.1, -0.5] {
            let rig = with_overlap(overlap);
            let curve = rig.controller_curve();
            for list in [&curve.openings, &curve.flows] {
                assert!(list.windows(2).all(|pair| pair[0] < pair[1]), "{overlap}: {list:?}");
            }
            assert!(curve.openings.iter().all(|x| x.abs() <= 1.0 + 1e-12), "{overlap}");
        }
    }

    #[test]
    fn found_flows_exclude_the_lap() {
        for overlap in [0.0, 2e-3, 0.05, -2e-3] {
            let rig = with_overlap(overlap);
            let table = &rig.servovalve.flow_table;
            // A valve that passes 5 % more.
            let found =
                rig.found_flows(|x| Some(x.iter().map(|x| 1.05 * rig.controller_curve().at(*x)).collect()));
            for (found, flow) in found.unwrap().iter().zip(&table.flows) {
                assert!((found - 1.05 * flow).abs() <= 1e-12 * flow.abs(), "{overlap}: {found} {flow}");
            }
        }
    }
}
