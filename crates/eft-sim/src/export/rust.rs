//! The export in Rust: constants of `eft-core`.

use std::fmt::{Result, Write as _};

use eft_core::{Mode, SignFrom};

use super::notes::lines;
use super::{
    Parts, Target, Velocity, adaptive_fields, fields, levels, limit, list, number, protection_fields,
};

const NONE: &str = "f64::MAX";

/// The whole file.
pub(super) fn write(out: &mut String, parts: &Parts) -> Result {
    let (rig, p) = (parts.rig, &parts.compensation);
    let table = &rig.servovalve.flow_table;
    let n = table.openings.len();
    let c = &rig.controller;
    let mode = match p.mode {
        Mode::Off => "Off",
        Mode::Linear => "Linear",
        Mode::Nonlinear => "Nonlinear",
    };
    let sign_from = match p.sign_from {
        SignFrom::Spool => "Spool",
        SignFrom::Demand => "Demand",
    };
    for line in lines(parts, Target::Rust) {
        writeln!(out, "{}", format!("//! {line}").trim_end())?;
    }
    imports(out, parts)?;
    writeln!(
        out,
        "/// Points of the flow table.\npub const POINTS: usize = {n};\n/// Sample rate (Hz).\npub const SAMPLE_RATE: f64 = {};\n",
        number(c.sample_rate)
    )?;
    writeln!(
        out,
        "macro_rules! checked {{\n    ($made:expr) => {{\n        match $made {{\n            Ok(made) => made,\n            Err(_) => panic!(\"refused\"),\n        }}\n    }};\n}}\n"
    )?;
    writeln!(
        out,
        "/// Spool openings (1).\npub const OPENINGS: [f64; POINTS] = [{}];",
        list(&table.openings)
    )?;
    writeln!(out, "/// Flows (m³/s).\npub const FLOWS: [f64; POINTS] = [{}];\n", list(&table.flows))?;
    writeln!(out, "/// What the compensation is made from.")?;
    writeln!(out, "pub const PARAMETERS: CompensationParameters = CompensationParameters {{")?;
    writeln!(out, "    mode: Mode::{mode},\n    sign_from: SignFrom::{sign_from},")?;
    for (key, value, unit) in fields(p) {
        writeln!(out, "    {key}: {}, // {unit}", number(value))?;
    }
    writeln!(
        out,
        "    sample_rate: SAMPLE_RATE,\n    proportional_gain: {}, // V/V\n}};\n",
        number(p.proportional_gain)
    )?;
    controller(out, parts)?;
    around(out, parts)
}

/// What is used of `eft-core`, four or five names a line as rustfmt has them.
fn imports(out: &mut String, parts: &Parts) -> Result {
    let mut used: Vec<&str> = match parts.adaptive {
        None => vec!["Compensation", "CompensationParameters", "Controller"],
        Some(_) => vec![
            "AdaptiveCompensation",
            "AdaptiveController",
            "AdaptiveParameters",
            "CompensationParameters",
            "Tuning",
        ],
    };
    used.extend(["FlowTable", "Limiter", "Mode", "ServovalveController", "SignFrom"]);
    match parts.velocity {
        None => {}
        Some(Velocity::Derivative(_)) => used.push("FilteredDerivative"),
        Some(Velocity::Observer(..)) => used.push("VelocityObserver"),
    }
    if parts.protection.is_some() {
        used.extend(["Levels", "Protection", "ProtectionParameters"]);
    }
    used.sort_unstable();
    writeln!(out, "use eft_core::{{")?;
    let mut line = String::from("   ");
    for name in used {
        if line.len() + name.len() + 2 > 100 {
            writeln!(out, "{line}")?;
            line = String::from("   ");
        }
        write!(line, " {name},")?;
    }
    writeln!(out, "{line}\n}};\n")
}

/// The controller itself.
fn controller(out: &mut String, parts: &Parts) -> Result {
    let (rig, c, adaptive) = (parts.rig, &parts.rig.controller, parts.adaptive.as_ref());
    let adaptively = if adaptive.is_some() { "Adaptive" } else { "" };
    writeln!(out, "/// The controller.\npub static CONTROLLER: {adaptively}Controller<f32, POINTS> = {{")?;
    writeln!(out, "    let table = checked!(FlowTable::<f32, POINTS>::new(&OPENINGS, &FLOWS));")?;
    let parameters = if adaptive.is_some() { "adaptive" } else { "PARAMETERS" };
    if let Some(a) = adaptive {
        writeln!(out, "    let adaptive = AdaptiveParameters {{\n        compensation: PARAMETERS,")?;
        for (key, value, unit) in adaptive_fields(a) {
            writeln!(out, "        {key}: {}, // {unit}", number(value))?;
        }
        writeln!(out, "        force_sensitivity: {}, // V/N", number(a.force_sensitivity))?;
        writeln!(out, "        computation_delay: {}, // samples", a.computation_delay)?;
        for (key, on) in [
            ("feedforward", a.feedforward),
            ("adaptive", a.adaptive),
            ("correct_curve", a.correct_curve),
            ("guard", a.guard),
        ] {
            writeln!(out, "        {key}: {on},")?;
        }
        writeln!(out, "        tuning: Tuning::DEFAULT,\n    }};")?;
    }
    writeln!(out, "    {adaptively}Controller {{")?;
    writeln!(
        out,
        "        compensation: checked!({adaptively}Compensation::<f32, POINTS>::new(&{parameters}, &table)),"
    )?;
    writeln!(
        out,
        "        // Force sensitivity (V/N), proportional gain (V/V), derivative gain (s).\n        servovalve: checked!(ServovalveController::<f32>::new({}, {}, {}, SAMPLE_RATE)),",
        number(c.force_sensitivity),
        number(c.proportional_gain),
        number(c.derivative_gain)
    )?;
    writeln!(
        out,
        "        // Largest valve command (V) and rate (V/s).\n        limiter: checked!(Limiter::<f32>::new({}, {}, SAMPLE_RATE)),",
        limit(rig.limits.valve_command.unwrap_or(f64::MAX), NONE),
        limit(rig.limits.valve_command_rate.unwrap_or(f64::MAX), NONE)
    )?;
    writeln!(out, "    }}\n}};")
}

/// What stands around the controller.
fn around(out: &mut String, parts: &Parts) -> Result {
    match parts.velocity {
        None => {}
        Some(Velocity::Derivative(corner)) => {
            writeln!(out, "\n/// The velocity (m/s) of the measured displacement (m), by its corner (Hz).")?;
            writeln!(out, "pub static VELOCITY: FilteredDerivative<f32> =")?;
            writeln!(out, "    checked!(FilteredDerivative::<f32>::new({}, SAMPLE_RATE));", number(corner))?;
        }
        Some(Velocity::Observer(gains, per_mass)) => {
            let beside = if per_mass.is_some() { "force" } else { "acceleration (m/s²)" };
            writeln!(
                out,
                "\n/// The velocity (m/s) of the measured displacement (m) and {beside}, by gains on displacement (1), velocity (1/s)\n/// and drift (1/s²)."
            )?;
            writeln!(out, "pub static VELOCITY: VelocityObserver<f32> =")?;
            writeln!(out, "    checked!(VelocityObserver::<f32>::new([{}], SAMPLE_RATE));", list(&gains))?;
            if let Some(per_mass) = per_mass {
                writeln!(out, "/// Times the force (N), the acceleration that the observer takes: 1/kg.")?;
                writeln!(out, "pub const PER_MASS: f32 = {:?};", per_mass as f32)?;
            }
        }
    }
    let Some(p) = &parts.protection else { return Ok(()) };
    writeln!(out, "\n/// The protection of the specimen.")?;
    writeln!(
        out,
        "pub static PROTECTION: Protection<f32> = checked!(Protection::<f32>::new(&ProtectionParameters {{"
    )?;
    for (signal, levels, unit) in levels(p) {
        let (warning, trip) = (limit(levels.warning, NONE), limit(levels.trip, NONE));
        writeln!(out, "    {signal}: Levels {{ warning: {warning}, trip: {trip} }}, // {unit}")?;
    }
    for (key, value, unit) in protection_fields(p) {
        writeln!(out, "    {key}: {}, // {unit}", limit(value, NONE))?;
    }
    writeln!(out, "    sample_rate: SAMPLE_RATE,\n}}));")
}
