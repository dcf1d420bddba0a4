//! The demands of a test on a rig, compared with the rig's capacity before the test.

use crate::Result;
use crate::analysis::linear::{
    FlowGain, Time, designed_for, deviation, largest_stable_level, linearize, stability_margin_up_to,
};
use crate::closed_loop::{SimulateOptions, ideal_responses};
use crate::config::{Mode, Realization, RigConfig, VelocitySource};
use crate::ground_motion::excitation::Command;
use crate::plant::Supply;
use crate::state_space::AT_REST;

/// Beyond this opening the paper advises against a test.
const ADVISED_OPENING: f64 = 0.6;
/// Up to this opening and this share of the supply pressure the paper finds the linear scheme viable.
const LINEAR_OPENING: f64 = 0.1;
const LINEAR_PRESSURE: f64 = 0.05;
/// Share of the stall force beyond which the valve passes little flow.
const ADVISED_FORCE: f64 = 0.67;
/// Least advised peak of a command, as a share of the actuator's capacity or of the load cell's range: about the
/// error of a good load cell, and half of the friction of good seals.
const LEAST_FORCE: f64 = 1e-3;
/// The demand of all actuators together.
const MEAN_FLOW: &str = "mean flow of the pump";
/// Drop of the force between 0.1 and 10 Hz without compensation up to which no compensation is needed.
const TOLERATED_DROP: f64 = 0.05;

/// The demand of a test on one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Demand {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Largest demand of the test.
    pub required: f64,
    /// Capacity of the rig.
    pub available: f64,
    /// Advised limit.
    pub advised: f64,
}

/// The result of [`check_feasibility`].
#[derive(Debug, Clone, PartialEq)]
pub struct Feasibility {
    /// Force, displacement, velocity, flow, opening and power; also the mean flow if the pump's flow is
    /// known, and what sensors, converter and limits of the controller must let pass.
    pub demands: Vec<Demand>,
    /// The simplest scheme that suffices.
    pub scheme: Mode,
    /// The largest stable compensation level at the command's sample rate (1); `None` if no level is stable.
    pub margin: Option<f64>,
    /// The smallest tried sample rate (Hz) from which on the loop is stable and has enough of a margin: the largest
    /// stable level exceeds the rig's own by `verdict.caution.level_margin`, or by half of what it does at 12,800 Hz. With
    /// self-calibration a stable loop is enough. `None` if the loop is unstable at 12,800 Hz.
    pub smallest_sample_rate: Option<f64>,
    /// The lowest supply pressure (Pa) while the valves draw the flow of the demands, without their leakage.
    pub lowest_supply_pressure: f64,
}

/// Compares the demands of force commands, one per actuator, with the capacities of a rig. With
/// self-calibration or the guard, margin and sample rate are those of the loop before any calibration.
///
/// # Errors
/// An invalid command, or a wrong number of commands.
pub fn check_feasibility(rig: &RigConfig, commands: &[Command]) -> Result<Feasibility> {
    let Asked { demands, pressure, drawn } = asked(rig, commands)?;
    let rate = Time::Sampled(commands.first().map_or(rig.controller.sample_rate, |first| first.sample_rate));
    Ok(Feasibility {
        scheme: scheme(rig, &demands, pressure)?,
        margin: largest_stable_level(&*designed_for(rig, rate)?, FlowGain::Steeper, rate)?,
        smallest_sample_rate: smallest_sample_rate(rig)?,
        lowest_supply_pressure: lowest_pressure(rig, &drawn, commands),
        demands,
    })
}

/// The demands of force commands, one per actuator, from the structure's response to exactly those forces.
/// Each demand is that of the actuator with the largest; the pump's mean flow is that of all actuators.
///
/// # Errors
/// As [`check_feasibility`].
pub fn demands(rig: &RigConfig, commands: &[Command]) -> Result<Vec<Demand>> {
    Ok(asked(rig, commands)?.demands)
}

/// The least advised peak (N) of a command: a thousandth of the actuator's capacity or of the load cell's range,
/// and so much that noise and resolution of the load cell are `verdict.caution.force_error` of it.
pub fn smallest_force(rig: &RigConfig) -> f64 {
    let plant = rig.plant();
    let capacity = plant.actuator.piston_area * plant.supply.pressure;
    let whole = plant.sensors.force.range.filter(|range| *range > capacity).unwrap_or(capacity);
    (LEAST_FORCE * whole).max(deviation(&plant.sensors.force) / rig.verdict.caution.force_error)
}

struct Asked {
    demands: Vec<Demand>,
    /// The largest force over the stall force.
    pressure: f64,
    /// Flow (m³/s) that all actuators together draw from the supply.
    drawn: Vec<f64>,
}

fn asked(rig: &RigConfig, commands: &[Command]) -> Result<Asked> {
    let options = SimulateOptions::default();
    let ideals = ideal_responses(rig, commands, &options)?;
    let (mut demands, mut pressure, mut drawn) = (Vec::new(), 0.0_f64, Vec::new());
    for (command, ideal) in commands.iter().zip(&ideals) {
        let (asked, share) = demands_of(rig, command, &ideal.displacement, &ideal.velocity, &mut drawn)?;
        merge(&mut demands, asked);
        pressure = pressure.max(share);
    }
    Ok(Asked { demands, pressure, drawn })
}

/// The lowest pressure (Pa) of the supply, which delivers these flows (m³/s), one per sample.
fn lowest_pressure(rig: &RigConfig, drawn: &[f64], commands: &[Command]) -> f64 {
    let of_plant = &rig.plant().supply;
    let supply = Supply::<f64>::pack(&|_| rig.plant());
    let step = commands.first().map_or(1.0, |first| 1.0 / first.sample_rate);
    let mut lowest = supply.setting(0.0);
    let mut pressure = lowest;
    for (i, flow) in drawn.iter().enumerate() {
        let setting = supply.setting(i as f64 * step);
        pressure = match (of_plant.accumulator, of_plant.droop) {
            (Some(capacity), Some(droop)) => {
                // The backward Euler step, stable for an accumulator of any size.
                let per_flow = step / capacity;
                let free = (pressure + per_flow * (setting / droop - flow)) / (1.0 + per_flow / droop);
                pressure + per_flow * (supply.pump_flow(setting, free, *flow) - flow)
            }
            _ => setting,
        };
        lowest = lowest.min(pressure);
    }
    lowest.max(0.0)
}

/// Includes the demands of another actuator.
fn merge(all: &mut Vec<Demand>, asked: Vec<Demand>) {
    if all.is_empty() {
        *all = asked;
        return;
    }
    for (sum, demand) in all.iter_mut().zip(asked) {
        let together = sum.name == MEAN_FLOW;
        sum.required =
            if together { sum.required + demand.required } else { sum.required.max(demand.required) };
    }
}

/// The demands on one actuator, and its largest force over the stall force. Adds the flow that it draws.
fn demands_of(
    rig: &RigConfig,
    command: &Command,
    x: &[f64],
    v: &[f64],
    drawn: &mut Vec<f64>,
) -> Result<(Vec<Demand>, f64)> {
    // Demand and capacity are those of the true plant, not of the controller's model.
    let (limited, rig) = (rig, rig.plant());
    let actuator = &rig.actuator;
    let valve = &rig.servovalve;
    let curve = valve.true_curve().table()?;
    // Capacities in the pushing and in the pulling direction.
    let scale = valve.flow_gain_scale;
    let [pulling, pushing] = actuator.flow_factors().map(|factor| scale * factor);
    let (least, most) = (curve.flow(-1.0), curve.flow(1.0));
    let stall = actuator.piston_area * rig.supply.pressure;
    let compressibility = rig.measured_compressibility();
    let (mut force, mut stroke, mut velocity) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut flow, mut opening, mut mean) = (0.0_f64, 0.0_f64, 0.0_f64);
    drawn.resize(command.values.len(), 0.0);
    for (i, now) in command.values.iter().enumerate() {
        let before = if i == 0 { *now } else { command.values[i - 1] };
        let rate = (now - before) * command.sample_rate;
        let pushed = (compressibility * rate + actuator.leakage * now) / actuator.piston_area;
        let q = actuator.piston_area * v[i] + pushed;
        let (side, factor) = if q < 0.0 { (actuator.area_ratio, pushing) } else { (1.0, pulling) };
        let radicand = 1.0 - q.signum() * now / (side * stall);
        // An opening beyond 1 means a flow that no opening passes.
        let no_load = q / factor / radicand.max(1e-6).sqrt();
        let end = if no_load < 0.0 { least } else { most };
        let beyond = no_load / end;
        let lap = if no_load == 0.0 { 0.0 } else { valve.overlap * no_load.signum() };
        let needed =
            if beyond > 1.0 { beyond } else { (curve.opening(no_load) + lap + valve.null_bias).abs() };
        force = force.max(now.abs());
        stroke = stroke.max(x[i].abs());
        velocity = velocity.max(v[i].abs());
        flow = flow.max(q.abs());
        drawn[i] += q.abs();
        opening = opening.max(needed);
        mean += q.abs() / command.values.len() as f64;
    }
    let passed = (pulling * most).min(-pushing * least);
    let stall = stall * actuator.area_ratio.min(1.0);
    let demand = |name, unit, required, available: f64, advised: f64| Demand {
        name,
        unit,
        required,
        available,
        advised: advised * available,
    };
    let fastest = passed / actuator.piston_area;
    let mut all = vec![
        demand("force", "N", force, stall, ADVISED_FORCE),
        demand("displacement", "m", stroke, actuator.stroke, 0.95),
        demand("velocity", "m/s", velocity, fastest, 1.0),
        demand("flow", "m³/s", flow, passed, 1.0),
        demand("spool opening", "", opening, 1.0, ADVISED_OPENING),
        demand("hydraulic power", "W", flow * rig.supply.pressure, passed * rig.supply.pressure, 1.0),
    ];
    if let Some(pump) = rig.supply.pump_flow {
        all.push(demand(MEAN_FLOW, "m³/s", mean, pump, 1.0));
    }
    let volts = opening * valve.spool_sensitivity * valve.spool_stroke;
    let passages = passages(limited, force, stroke, velocity, volts).into_iter();
    all.extend(
        passages.filter_map(|(name, unit, required, range)| Some(demand(name, unit, required, range?, 1.0))),
    );
    Ok((all, force / stall))
}

/// What must pass sensors, converter and limits: name, unit, size, and the range if there is one. `volts` is the largest
/// valve command at low frequencies.
fn passages(
    rig: &RigConfig,
    force: f64,
    stroke: f64,
    velocity: f64,
    volts: f64,
) -> Vec<(&'static str, &'static str, f64, Option<f64>)> {
    let (limits, plant) = (&rig.limits, rig.plant());
    let sensors = &plant.sensors;
    let cell = sensors.force.gain.abs() * force + sensors.force.bias.abs();
    let mut passages = vec![
        ("force within sensors.force.range", "N", cell, sensors.force.range),
        ("force within limits.force_range", "N", cell, limits.force_range),
    ];
    if rig.controller.velocity_source == VelocitySource::Sensor {
        let sensor = &sensors.velocity;
        let read = sensor.gain.abs() * velocity + sensor.bias.abs();
        passages.push(("velocity within sensors.velocity.range", "m/s", read, sensor.range));
        passages.push(("velocity within limits.velocity_range", "m/s", read, limits.velocity_range));
    } else {
        let sensor = &sensors.displacement;
        let read = sensor.gain.abs() * stroke + sensor.bias.abs();
        passages.push(("displacement within sensors.displacement.range", "m", read, sensor.range));
    }
    // An analog force loop amplifies the controller's output.
    let output = match (rig.controller.realization, rig.compensation.mode) {
        (Realization::Digital, _) => volts,
        (Realization::Analog, Mode::Off) => return passages,
        (Realization::Analog, _) => volts / rig.controller.proportional_gain,
    };
    passages.push(("valve command within limits.valve_command", "V", output, limits.valve_command));
    passages.push(("valve command within dac.range", "V", output, plant.dac.range));
    passages
}

fn scheme(rig: &RigConfig, demands: &[Demand], pressure: f64) -> Result<Mode> {
    let off = rig.with(|rig| rig.compensation.mode = Mode::Off)?;
    let model = linearize(&off, FlowGain::Nominal, Time::Continuous)?;
    let own = |frequency: f64| -> Result<Vec<f64>> {
        let forces = model.outputs.iter().filter(|name| name.starts_with("force"));
        let pairs = model.inputs.iter().zip(forces);
        pairs.map(|(input, output)| Ok(model.response_to(input, output, frequency)?.norm())).collect()
    };
    // A structure without a spring has a pole there, and takes no constant force.
    let rest = own(0.0).ok();
    let drops = |frequency: f64| -> Result<bool> {
        let Some(rest) = &rest else { return Ok(true) };
        let mut pairs = own(frequency)?.into_iter().zip(rest);
        Ok(pairs.any(|(here, rest)| here < (1.0 - TOLERATED_DROP) * rest))
    };
    for i in 0..=200 {
        if drops(0.1 * 100.0_f64.powf(f64::from(i) / 200.0))? {
            let opening =
                demands.iter().find(|demand| demand.unit.is_empty()).map_or(1.0, |demand| demand.required);
            let linear = opening <= LINEAR_OPENING && pressure <= LINEAR_PRESSURE;
            return Ok(if linear { Mode::Linear } else { Mode::Nonlinear });
        }
    }
    Ok(Mode::Off)
}

fn smallest_sample_rate(rig: &RigConfig) -> Result<Option<f64>> {
    let rates: Vec<f64> = (0..=36).map(|i| 200.0 * 2.0_f64.powf(f64::from(i) / 6.0)).collect();
    let own = rig.compensation.level;
    // Infinite where it is found to be more than `most`.
    let surplus = |rate: f64, most: f64| -> Result<f64> {
        // A designed force loop may not exist at another rate than the rig's own.
        let Ok(rig) = rig.at_rate(rate) else { return Ok(f64::NEG_INFINITY) };
        let growth = linearize(&rig, FlowGain::Steeper, Time::Sampled(rate))?.growth_rate()?;
        if growth > AT_REST {
            return Ok(f64::NEG_INFINITY);
        }
        let far = own * (1.0 + 1.01 * most);
        Ok(stability_margin_up_to(&rig, FlowGain::Steeper, Time::Sampled(rate), far)? / own - 1.0)
    };
    let advised = if rig.compensation.adaptive { 0.0 } else { rig.verdict.caution.level_margin - 1.0 };
    let enough = advised.min(0.5 * surplus(rates[rates.len() - 1], 2.0 * advised)?).max(0.0);
    let mut smallest = None;
    for rate in rates.into_iter().rev() {
        if surplus(rate, enough)? < enough {
            break;
        }
        smallest = Some(rate);
    }
    Ok(smallest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground_motion::excitation::sine_sweep;

    fn sweep(amplitude: f64) -> Command {
        sine_sweep(amplitude, 0.0, 10.0, 32.0, 4096.0).unwrap()
    }

    #[test]
    fn the_papers_sweep_demands_the_reported_opening() {
        let answer = check_feasibility(&RigConfig::zhao2005(), &[sweep(8900.0)]).unwrap();
        let opening = answer.demands.iter().find(|d| d.name == "spool opening").unwrap();
        assert!((opening.required - 0.55).abs() < 0.06, "{opening:?}");
        assert!(answer.demands.iter().all(|demand| demand.required < demand.advised), "{answer:?}");
        assert_eq!(answer.scheme, Mode::Nonlinear);
        assert!((answer.margin.unwrap() - 1.037).abs() < 2e-3);
        assert!(answer.smallest_sample_rate.unwrap() < 4096.0);
    }

    #[test]
    fn excessive_demands_and_unstable_loops_are_reported() {
        let over = |amplitude: f64| -> Vec<&str> {
            let asked = demands(&RigConfig::zhao2005(), &[sweep(amplitude)]).unwrap();
            asked
                .iter()
                .filter(|demand| demand.required > demand.available)
                .map(|demand| demand.name)
                .collect()
        };
        assert!(over(40e3).contains(&"displacement") && over(8900.0).is_empty());
        let rig = RigConfig::zhao2005().with(|rig| rig.controller.force_sensitivity *= 20.0).unwrap();
        let answer = check_feasibility(&rig, &[sweep(100.0)]).unwrap();
        assert_eq!((answer.margin, answer.smallest_sample_rate), (None, None));
        assert_eq!(answer.scheme, Mode::Linear, "a sweep of 100 N stays in the linear range");
    }

    #[test]
    fn a_rate_is_safe_with_a_margin_that_the_verdict_accepts() {
        // The largest stable level is 1.13 at 1024 Hz, 1.98 at 2048 Hz and 2.86 at 12,800 Hz.
        let rig = RigConfig::zhao2005().replace(&[("controller.force_loop", "robust".into())]).unwrap();
        assert!(smallest_sample_rate(&rig).unwrap().unwrap() < 1024.0);
        let strict = rig.with(|rig| rig.verdict.caution.level_margin = 1.5).unwrap();
        assert!((1024.0..2048.0).contains(&smallest_sample_rate(&strict).unwrap().unwrap()));
        let strictest = rig.with(|rig| rig.verdict.caution.level_margin = 100.0).unwrap();
        assert!((1900.0..2048.0).contains(&smallest_sample_rate(&strictest).unwrap().unwrap()));
        // A level of 0.5 may double, so it has more margin than the whole level.
        let half = strict.with(|rig| rig.compensation.level = 0.5).unwrap();
        assert!(smallest_sample_rate(&half).unwrap() < smallest_sample_rate(&strict).unwrap());
    }

    #[test]
    fn a_rate_without_a_designed_loop_ends_the_search_for_the_smallest() {
        // At the lowest rates with half of the margin this leakage leaves no designed loop.
        let rig = RigConfig::zhao2005()
            .replace(&[("controller.force_loop", "robust".into()), ("actuator.leakage", 5.2e-11.into())]);
        let answer = check_feasibility(&rig.unwrap(), &[sweep(2000.0)]).unwrap();
        assert!((200.0..4096.0).contains(&answer.smallest_sample_rate.unwrap()), "{answer:?}");
    }
}
