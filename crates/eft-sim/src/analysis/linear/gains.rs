//! The slope of the flow curve that a linear model uses near rest.

use crate::config::{AtRest, Mode, RigConfig};
use crate::plant::Supply;
use crate::{Result, checks};

/// The flow gain of a linear model. Plant and nonlinear compensation use the same slope, so it cancels if the
/// compensation is exact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FlowGain {
    /// The configured `K_v` in plant and compensation, as in the paper.
    #[default]
    Nominal,
    /// The flow curve's steeper slope at the origin.
    Steeper,
    /// The flow curve's shallower slope at the origin.
    Shallower,
    /// The mean of the two slopes, which is the gain for a small symmetric signal.
    Mean,
}

/// Gains between velocity, spool opening and flow near rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gains {
    /// Flow per spool opening (m³/s), at the supply pressure at which a test begins.
    pub(super) flow: f64,
    /// The true valve about rest.
    pub(super) rest: AtRest,
    /// Required opening per demanded flow (s/m³), including the level.
    pub(super) opening_per_flow: f64,
    /// Area (m²) whose motion is compensated.
    pub(super) compensated_area: f64,
}

impl FlowGain {
    pub(super) fn gains(self, rig: &RigConfig) -> Result<Gains> {
        let nominal = rig.compensation.flow_gain;
        let of = |(shallower, steeper)| match self {
            Self::Steeper => steeper,
            Self::Shallower => shallower,
            Self::Nominal | Self::Mean => 0.5 * (shallower + steeper),
        };
        let plant = rig.plant();
        let valve = &plant.servovalve;
        let table = of(rig.servovalve.flow_table.slopes()?);
        // Areas and an underlap that the controller knows change its inverse as they change the valve. What an overlap does
        // near null no linear model has.
        let known = rig.at_rest(&rig.servovalve.flow_table)?;
        let known = of((known.shallower, known.steeper));
        let slope = if self == Self::Nominal { nominal * (known / table) } else { known };
        let rest = plant.at_rest(valve.true_curve())?;
        let true_over_known = of((rest.shallower, rest.steeper)) / known;
        let known = match rig.compensation.mode {
            Mode::Nonlinear | Mode::Off => slope,
            Mode::Linear => nominal,
        };
        let off = rig.compensation.mode == Mode::Off;
        // The flow curve holds at `supply.pressure`; a schedule may begin elsewhere.
        let pressure = Supply::<f64>::pack(&|_| plant).setting(0.0);
        let allowed = "must be positive at the start of the test for a linear model";
        checks::require(pressure > 0.0, "supply.schedule.pressures", pressure, allowed)?;
        let root = (pressure / plant.supply.pressure).sqrt();
        let corrected =
            if rig.compensation.supply_correction { measured_supply(rig, pressure).sqrt() } else { 1.0 };
        Ok(Gains {
            flow: slope * true_over_known * valve.flow_gain_scale * root,
            rest: AtRest { leakage: rest.leakage / root, ..rest },
            opening_per_flow: rig.compensation.level / (known * corrected),
            compensated_area: if off { 0.0 } else { rig.actuator.piston_area },
        })
    }
}

/// Share (1) of a small motion's flow that a rig's compensation supplies at the start of a test: the level, if the
/// controller knows valve and supply.
///
/// # Errors
/// A flow curve without a slope at rest; no supply pressure at the start.
pub(crate) fn compensated_share(rig: &RigConfig) -> Result<f64> {
    let gains = FlowGain::Mean.gains(rig)?;
    Ok(gains.flow * gains.opening_per_flow)
}

/// The ratio of measured and configured supply pressure with which the controller calculates.
fn measured_supply(rig: &RigConfig, pressure: f64) -> f64 {
    let sensor = &rig.plant().sensors.supply_pressure;
    let ratio = (sensor.gain * pressure + sensor.bias) / rig.supply.pressure;
    if (0.05..=4.0).contains(&ratio) { ratio } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBIC_INCH: f64 = 1.6387064e-5;

    #[test]
    fn slopes_of_table_2() {
        let rig = RigConfig::zhao2005();
        let flow = |gain: FlowGain| gain.gains(&rig).unwrap().flow / CUBIC_INCH;
        assert!((flow(FlowGain::Steeper) - 1022.0).abs() < 1e-9);
        assert!((flow(FlowGain::Shallower) - 1010.0).abs() < 1e-9);
        assert!((flow(FlowGain::Mean) - 1016.0).abs() < 1e-9);
        assert!((flow(FlowGain::Nominal) - 1000.8).abs() < 0.05);
    }

    #[test]
    fn the_linear_scheme_divides_by_its_own_gain_for_any_table() {
        let rig = RigConfig::zhao2005().with(|rig| {
            rig.compensation.mode = Mode::Linear;
            rig.compensation.level = 1.5;
            rig.servovalve.flow_gain_scale = 0.9;
        });
        let rig = rig.unwrap();
        let gains = FlowGain::Steeper.gains(&rig).unwrap();
        assert!((gains.flow - 0.9 * 1022.0 * CUBIC_INCH).abs() < 1e-12);
        assert_eq!(gains.opening_per_flow, 1.5 / 1.64e-2);
        let rig = rig.with(|rig| rig.compensation.mode = Mode::Off).unwrap();
        assert_eq!(FlowGain::Steeper.gains(&rig).unwrap().compensated_area, 0.0);
    }

    #[test]
    fn a_measured_supply_pressure_corrects_the_flow_as_far_as_its_sensor_tells_the_truth() {
        let rig = |changes: &[(&str, toml::Value)]| {
            let schedule = [
                ("supply.schedule.times", toml::Value::Array(vec![0.0.into()])),
                ("supply.schedule.pressures", toml::Value::Array(vec![(0.81 * 1.9e7).into()])),
            ];
            RigConfig::zhao2005().replace(&[&schedule, changes].concat()).unwrap()
        };
        let passed = |changes: &[(&str, toml::Value)]| compensated_share(&rig(changes)).unwrap();
        let on = ("compensation.supply_correction", true.into());
        assert!((passed(&[]) - 0.9).abs() < 1e-12);
        assert!((passed(std::slice::from_ref(&on)) - 1.0).abs() < 1e-12);
        assert!(
            (passed(&[on.clone(), ("sensors.supply_pressure.gain", 1.21.into())]) - 1.0 / 1.1).abs() < 1e-12
        );
        // The controller refuses a reading beyond four times the configured pressure.
        assert!((passed(&[on, ("sensors.supply_pressure.gain", 6.0.into())]) - 0.9).abs() < 1e-12);
    }
}
