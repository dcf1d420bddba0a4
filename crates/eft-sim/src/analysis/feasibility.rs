//! Before the pumps start: what a test asks of a rig, and whether the rig has it.

use eft_core::FlowTable;

use crate::closed_loop::{SimulateOptions, ideal_responses};
use eft_core::Short;

use crate::analysis::linear::{FlowGain, Time, linearize, stability_margin};
use crate::config::{Mode, RigConfig};
use crate::error::Result;
use crate::ground_motion::excitation::Command;
use crate::plant::TABLE_CAPACITY;

/// Beyond this opening the paper advises against a test.
const ADVISED_OPENING: f64 = 0.6;
/// Up to this opening and this share of the supply pressure the paper finds the linear scheme viable.
const LINEAR_OPENING: f64 = 0.1;
const LINEAR_PRESSURE: f64 = 0.05;
/// Share of the stall force beyond which the valve passes little flow.
const ADVISED_FORCE: f64 = 0.67;
/// A stability margin of the level below this leaves no room for the flow gain's own uncertainty.
const ADVISED_MARGIN: f64 = 1.02;
/// What the actuators ask for together.
const MEAN_FLOW: &str = "mean flow of the pump";
/// Without compensation the force may fall by this much within 0.1 to 10 Hz before it counts.
const TOLERATED_DROP: f64 = 0.05;

/// One quantity the test asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct Demand {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What the test asks for at most.
    pub required: f64,
    /// What the rig has.
    pub available: f64,
    /// What one should stay below.
    pub advised: f64,
}

/// How the answer reads in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Nothing speaks against it.
    Go,
    /// Possible, but beyond what is advised.
    Caution,
    /// The rig cannot do it, or the loop is not stable and the controller does not calibrate itself.
    No,
}

/// The answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Feasibility {
    /// In a word.
    pub verdict: Verdict,
    /// Why, one sentence each; empty for a plain go.
    pub reasons: Vec<String>,
    /// Force, displacement, velocity, flow, opening, power and, where the pump's flow is known, its mean.
    pub demands: Vec<Demand>,
    /// The simplest scheme that suffices.
    pub scheme: Mode,
    /// The largest stable compensation level at the command's sample rate (1).
    pub margin: f64,
    /// The smallest sample rate (Hz) of those tried from which on the loop stays stable with at least half of the
    /// margin it has at the highest; none if there is none.
    pub smallest_sample_rate: Option<f64>,
}

/// Checks a rig against force commands, one an actuator, from the structure's response to exactly those forces. The
/// demands are those of the actuator that is asked for most; the pump's mean flow is that of all together.
///
/// Where the controller calibrates itself or guards its level, stability is that of the loop before it does so, and
/// advice: only a test on the virtual rig tells what becomes of it.
///
/// # Errors
/// An invalid command, not one command an actuator, or a loop that no level makes stable.
pub fn check_feasibility(rig: &RigConfig, commands: &[Command]) -> Result<Feasibility> {
    let options = SimulateOptions::default();
    let ideals = ideal_responses(rig, commands, &options)?;
    let mut demands = Vec::new();
    let mut pressure = 0.0_f64;
    let mut sample_rate = 0.0;
    for (command, ideal) in commands.iter().zip(&ideals) {
        let (asked, share) = self::demands(rig, command, &ideal.displacement, &ideal.velocity)?;
        merge(&mut demands, asked);
        pressure = pressure.max(share);
        sample_rate = command.sample_rate;
    }
    let scheme = scheme(rig, &demands, pressure)?;
    let margin = stability_margin(rig, FlowGain::Steeper, Time::Sampled(sample_rate))?;
    let smallest_sample_rate = smallest_sample_rate(rig)?;
    let mut feasibility = Feasibility {
        verdict: Verdict::Go,
        reasons: Vec::new(),
        demands,
        scheme,
        margin,
        smallest_sample_rate,
    };
    judge(&mut feasibility, rig, sample_rate)?;
    Ok(feasibility)
}

/// Takes what another actuator asks for into account.
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

fn demands(rig: &RigConfig, command: &Command, x: &[f64], v: &[f64]) -> Result<(Vec<Demand>, f64)> {
    // What the test asks for and what is there, whatever the controller believes of it.
    let rig = rig.plant();
    let actuator = &rig.actuator;
    let table = rig.servovalve.true_curve();
    let curve = FlowTable::<f64, TABLE_CAPACITY>::new(&table.openings, &table.flows)?;
    let (least, most) = (curve.flow(-1.0), curve.flow(1.0));
    let stall = actuator.piston_area * rig.supply.pressure;
    let scale = rig.servovalve.flow_gain_scale;
    let (mut force, mut stroke, mut velocity) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut flow, mut opening, mut mean) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (i, now) in command.values.iter().enumerate() {
        let before = if i == 0 { *now } else { command.values[i - 1] };
        let rate = (now - before) * command.sample_rate;
        let pushed = (actuator.compressibility * rate + actuator.leakage * now) / actuator.piston_area;
        let q = actuator.piston_area * v[i] + pushed;
        let radicand = 1.0 - q.signum() * now / stall;
        // Opening beyond 1 stands for what no opening passes.
        let no_load = q / scale / radicand.max(1e-6).sqrt();
        let end = if no_load < 0.0 { least } else { most };
        let needed = if no_load / end > 1.0 { no_load / end } else { curve.opening(no_load).abs() };
        force = force.max(now.abs());
        stroke = stroke.max(x[i].abs());
        velocity = velocity.max(v[i].abs());
        flow = flow.max(q.abs());
        opening = opening.max(needed);
        mean += q.abs() / command.values.len() as f64;
    }
    let passed = scale * most.min(-least);
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
    Ok((all, force / stall))
}

fn scheme(rig: &RigConfig, demands: &[Demand], pressure: f64) -> Result<Mode> {
    let off = rig.with(|rig| rig.compensation.mode = Mode::Off)?;
    let model = linearize(&off, FlowGain::Nominal, Time::Continuous)?;
    let own = |frequency: f64| -> Result<Vec<f64>> {
        let forces = model.outputs.iter().filter(|name| name.starts_with("force"));
        let pairs = model.inputs.iter().zip(forces);
        pairs.map(|(input, output)| Ok(model.response_to(input, output, frequency)?.norm())).collect()
    };
    let rest = own(0.0)?;
    for i in 0..=200 {
        let frequency = 0.1 * 100.0_f64.powf(f64::from(i) / 200.0);
        let drops = own(frequency)?.into_iter().zip(&rest);
        if drops.into_iter().any(|(here, rest)| here < (1.0 - TOLERATED_DROP) * rest) {
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
    let surplus = |rate: f64| -> Result<f64> {
        let growth = linearize(rig, FlowGain::Steeper, Time::Sampled(rate))?.growth_rate()?;
        if growth > 0.0 {
            return Ok(f64::NEG_INFINITY);
        }
        Ok(stability_margin(rig, FlowGain::Steeper, Time::Sampled(rate))? - 1.0)
    };
    let highest = surplus(rates[rates.len() - 1])?;
    let mut smallest = None;
    for rate in rates.into_iter().rev() {
        let here = surplus(rate)?;
        // An infinite margin is as good as another one.
        if here == f64::NEG_INFINITY || here < 0.5 * highest && here.is_finite() {
            break;
        }
        smallest = Some(rate);
    }
    Ok(smallest)
}

/// Four digits, written as a person would.
fn rounded(value: f64) -> Short {
    Short(format!("{value:.3e}").parse().unwrap_or(value))
}

fn judge(answer: &mut Feasibility, rig: &RigConfig, sample_rate: f64) -> Result<()> {
    let mut say = |verdict: Verdict, reason: String| {
        answer.verdict = answer.verdict.max(verdict);
        answer.reasons.push(reason);
    };
    for demand in &answer.demands {
        let part = |limit: f64| {
            let unit = if demand.unit.is_empty() { String::new() } else { format!(" {}", demand.unit) };
            format!("{}{unit} of {}{unit}", rounded(demand.required), rounded(limit))
        };
        if demand.required > demand.available {
            say(Verdict::No, format!("{} exceeds what the rig has: {}", demand.name, part(demand.available)));
        } else if demand.required > demand.advised {
            say(
                Verdict::Caution,
                format!("{} exceeds what is advised: {}", demand.name, part(demand.advised)),
            );
        }
    }
    let growth = linearize(rig, FlowGain::Steeper, Time::Sampled(sample_rate))?.growth_rate()?;
    // What a controller makes of itself, no linear model knows: only a test on the virtual rig tells.
    let before = match (rig.compensation.adaptive, rig.compensation.guard) {
        (true, _) => "before self-calibration ",
        (false, true) => "before the guard acts ",
        (false, false) => "",
    };
    if growth > 0.0 {
        let verdict = if before.is_empty() { Verdict::No } else { Verdict::Caution };
        let text = format!("{before}the loop is unstable at {sample_rate} Hz: it grows at {growth:.3} 1/s");
        say(verdict, text);
    } else if answer.margin / rig.compensation.level.max(1e-12) < ADVISED_MARGIN {
        let text = format!(
            "{before}the largest stable level is {:.4}: the flow gain must be known that well",
            answer.margin
        );
        say(Verdict::Caution, text);
    }
    let rank = |mode: Mode| match mode {
        Mode::Off => 0,
        Mode::Linear => 1,
        Mode::Nonlinear => 2,
    };
    if rank(rig.compensation.mode) < rank(answer.scheme) {
        say(
            Verdict::Caution,
            format!("{:?} compensation is needed, {:?} is set", answer.scheme, rig.compensation.mode),
        );
    }
    match answer.smallest_sample_rate {
        None => say(
            Verdict::Caution,
            format!("{before}no sample rate from 200 to 12800 Hz keeps half of the stability margin"),
        ),
        Some(rate) if rate > sample_rate => {
            say(
                Verdict::Caution,
                format!("the sample rate {sample_rate} Hz is below the smallest safe one, {rate:.0} Hz"),
            );
        }
        Some(_) => (),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground_motion::excitation::sine_sweep;

    fn sweep(amplitude: f64) -> Command {
        sine_sweep(amplitude, 0.0, 10.0, 32.0, 4096.0).unwrap()
    }

    #[test]
    fn the_paper_s_sweep_is_a_go_with_the_opening_it_reports() {
        let answer = check_feasibility(&RigConfig::zhao2005(), &[sweep(8900.0)]).unwrap();
        let opening = answer.demands.iter().find(|d| d.name == "spool opening").unwrap().required;
        assert!((opening - 0.55).abs() < 0.06, "{opening}");
        assert_eq!(answer.scheme, Mode::Nonlinear);
        assert!((answer.margin - 1.037).abs() < 2e-3);
        assert_eq!(answer.verdict, Verdict::Go, "{:?}", answer.reasons);
        assert!(answer.smallest_sample_rate.unwrap() < 4096.0);
    }

    #[test]
    fn too_much_is_refused_with_the_reason() {
        let answer = check_feasibility(&RigConfig::zhao2005(), &[sweep(40e3)]).unwrap();
        assert_eq!(answer.verdict, Verdict::No);
        assert!(answer.reasons.iter().any(|r| r.starts_with("displacement exceeds")), "{:?}", answer.reasons);
        let rig = RigConfig::zhao2005().with(|rig| rig.compensation.level = 1.1).unwrap();
        let answer = check_feasibility(&rig, &[sweep(100.0)]).unwrap();
        assert_eq!(answer.verdict, Verdict::No);
        assert!(answer.reasons[0].contains("unstable"), "{:?}", answer.reasons);
        assert_eq!(answer.scheme, Mode::Linear, "a sweep of 100 N stays in the linear range");
        let advised = |answer: &Feasibility, words: &str| {
            assert_eq!(answer.verdict, Verdict::Caution, "{:?}", answer.reasons);
            assert!(answer.reasons[0].starts_with(words), "{:?}", answer.reasons);
        };
        let rig = rig.with(|rig| rig.compensation.guard = true).unwrap();
        advised(
            &check_feasibility(&rig, &[sweep(100.0)]).unwrap(),
            "before the guard acts the loop is unstable",
        );
        let rig = rig.with(|rig| rig.compensation.adaptive = true).unwrap();
        let answer = check_feasibility(&rig, &[sweep(100.0)]).unwrap();
        advised(&answer, "before self-calibration the loop is unstable");
    }
}
