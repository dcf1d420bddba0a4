//! Stability over two settings of a rig.

use toml::Value;

use super::largest_stable_level;
use super::{FlowGain, Time, linearize};
use crate::{Result, RigConfig, checks};

/// The quantity of a stability map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapQuantity {
    /// Growth rate (1/s) of the least damped mode; the loop is stable where it is negative.
    GrowthRate,
    /// The largest stable compensation level (1); NaN if no level makes the loop stable.
    Level,
}

/// A setting, by its dotted key, and its values along an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct MapAxis {
    /// The dotted key of the configuration.
    pub key: String,
    /// Its values, in the key's own unit.
    pub values: Vec<Value>,
}

/// A quantity of the exactly sampled loop over two settings, at each rig's own `controller.sample_rate`. The
/// result has one row for each value of `vertical`.
///
/// # Errors
/// An unknown key, the same key twice, a value that the key does not allow, an axis without values,
/// or [`Error::Interrupted`](crate::Error::Interrupted) within [`interruptible`](crate::interruptible).
pub fn stability_map(
    rig: &RigConfig,
    horizontal: &MapAxis,
    vertical: &MapAxis,
    quantity: MapQuantity,
    gain: FlowGain,
) -> Result<Vec<Vec<f64>>> {
    let allowed = "must be another key than that of the horizontal";
    checks::require(horizontal.key != vertical.key, "vertical", &vertical.key, allowed)?;
    for (name, axis) in [("horizontal", horizontal), ("vertical", vertical)] {
        checks::require(!axis.values.is_empty(), name, &axis.key, "must have at least one value")?;
    }
    let mut rows = Vec::with_capacity(vertical.values.len());
    for y in &vertical.values {
        let point = |x: &Value| {
            let changed = rig.replace(&[(&horizontal.key, x.clone()), (&vertical.key, y.clone())])?;
            at(&changed, quantity, gain)
        };
        rows.push(horizontal.values.iter().map(point).collect::<Result<_>>()?);
    }
    Ok(rows)
}

fn at(rig: &RigConfig, quantity: MapQuantity, gain: FlowGain) -> Result<f64> {
    let time = Time::Sampled(rig.controller.sample_rate);
    match quantity {
        MapQuantity::GrowthRate => linearize(rig, gain, time)?.growth_rate(),
        MapQuantity::Level => Ok(largest_stable_level(rig, gain, time)?.unwrap_or(f64::NAN)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::linear::stability_margin;
    use crate::config::RigValues;

    fn axis(key: &str, values: &[f64]) -> MapAxis {
        MapAxis { key: key.into(), values: values.iter().map(|v| (*v).into()).collect() }
    }

    #[test]
    fn every_point_of_a_map_is_the_rig_with_both_settings() {
        let rig = RigConfig::zhao2005();
        let (levels, dampings) = ([0.9, 1.0, 1.05], [2000.0, 8000.0]);
        let map = |quantity| {
            let (x, y) = (axis("compensation.level", &levels), axis("structure.damping", &dampings));
            stability_map(&rig, &x, &y, quantity, FlowGain::Nominal).unwrap()
        };
        let (growth, level) = (map(MapQuantity::GrowthRate), map(MapQuantity::Level));
        let time = Time::Sampled(rig.controller.sample_rate);
        for (j, damping) in dampings.into_iter().enumerate() {
            for (i, value) in levels.into_iter().enumerate() {
                let setting = |rig: &mut RigValues| {
                    (rig.compensation.level, rig.structure.damping) = (value, damping);
                };
                let changed = rig.with(setting).unwrap();
                let model = linearize(&changed, FlowGain::Nominal, time).unwrap();
                assert_eq!(growth[j][i], model.growth_rate().unwrap());
                let margin = stability_margin(&changed, FlowGain::Nominal, time).unwrap();
                assert_eq!(level[j][i], margin);
                assert_eq!(growth[j][i] < 0.0, value < margin, "{value} at {damping}");
            }
        }
    }

    #[test]
    fn settings_that_cannot_be_mapped_are_refused() {
        let rig = RigConfig::zhao2005();
        let text = |x: &MapAxis, y: &MapAxis, go_on: bool| {
            let map = || stability_map(&rig, x, y, MapQuantity::GrowthRate, FlowGain::Nominal);
            crate::interruptible(move || go_on, map).unwrap_err().to_string()
        };
        let (level, damping) = (axis("compensation.level", &[1.0]), axis("structure.damping", &[1e3]));
        assert!(text(&level, &level, true).starts_with("vertical = compensation.level"));
        assert!(text(&level, &axis("structure.damping", &[]), true).contains("at least one value"));
        assert!(text(&level, &axis("structure.dumping", &[1.0]), true).contains("structure.damping"));
        assert!(
            text(&level, &axis("structure.damping", &[-1.0]), true).starts_with("structure.damping = -1")
        );
        assert_eq!(text(&level, &damping, false), "interrupted");
    }
}
