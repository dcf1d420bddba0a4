//! The export in C: constants for `eft.h`.

use std::fmt::{Result, Write as _};

use eft_core::{Mode, SignFrom};

use super::notes::lines;
use super::{
    Parts, Target, Velocity, adaptive_fields, fields, levels, limit, list, number, protection_fields,
};

const NONE: &str = "DBL_MAX";

/// The whole file.
pub(super) fn write(out: &mut String, parts: &Parts) -> Result {
    let (rig, p, adaptive) = (parts.rig, &parts.compensation, parts.adaptive.as_ref());
    let table = &rig.servovalve.flow_table;
    let mode = match p.mode {
        Mode::Off => "OFF",
        Mode::Linear => "LINEAR",
        Mode::Nonlinear => "NONLINEAR",
    };
    let sign_from = match p.sign_from {
        SignFrom::Spool => "SPOOL",
        SignFrom::Demand => "DEMAND",
    };
    for (n, line) in lines(parts, Target::C).iter().enumerate() {
        let start = if n == 0 { "/*" } else { " *" };
        writeln!(out, "{}", format!("{start} {line}").trim_end())?;
    }
    writeln!(out, " */")?;
    writeln!(out, "#include <float.h>\n#include \"eft.h\"\n")?;
    match adaptive {
        None => writeln!(out, "static const eft_parameters EFT_RIG = {{")?,
        Some(a) => {
            writeln!(out, "static const eft_adaptive_parameters EFT_RIG = {{")?;
            for (key, value, unit) in adaptive_fields(a) {
                writeln!(out, "  .{key} = {}, /* {unit} */", number(value))?;
            }
            writeln!(out, "  .computation_delay = {}, /* samples */", a.computation_delay)?;
            let parts = [
                (a.feedforward, "EFT_FEEDFORWARD"),
                (a.adaptive, "EFT_ESTIMATORS"),
                (a.correct_curve, "EFT_CURVE"),
                (a.guard, "EFT_GUARD"),
            ];
            let on: Vec<_> = parts.iter().filter(|part| part.0).map(|part| part.1).collect();
            let on = if on.is_empty() { "0".to_owned() } else { on.join(" | ") };
            writeln!(out, "  .parts = {on},\n  .rig = {{")?;
        }
    }
    writeln!(out, "  .table_length = {},", table.openings.len())?;
    writeln!(out, "  .mode = EFT_MODE_{mode},\n  .sign_from = EFT_SIGN_FROM_{sign_from},")?;
    for (key, value, unit) in fields(p) {
        writeln!(out, "  .{key} = {}, /* {unit} */", number(value))?;
    }
    for (key, value, unit) in [
        ("sample_rate", number(p.sample_rate), "Hz"),
        ("proportional_gain", number(p.proportional_gain), "V/V"),
        ("force_sensitivity", number(rig.controller.force_sensitivity), "V/N"),
        ("derivative_gain", number(rig.controller.derivative_gain), "s"),
        ("valve_command", limit(rig.limits.valve_command.unwrap_or(f64::MAX), NONE), "V"),
        ("valve_command_rate", limit(rig.limits.valve_command_rate.unwrap_or(f64::MAX), NONE), "V/s"),
    ] {
        writeln!(out, "  .{key} = {value}, /* {unit} */")?;
    }
    writeln!(
        out,
        "  .openings = {{{}}},\n  .flows = {{{}}}, /* m3/s */\n{}}};",
        list(&table.openings),
        list(&table.flows),
        if adaptive.is_some() { "} " } else { "" }
    )?;
    around(out, parts)
}

/// What stands around the controller.
fn around(out: &mut String, parts: &Parts) -> Result {
    let rate = number(parts.compensation.sample_rate);
    match parts.velocity {
        None => {}
        Some(Velocity::Derivative(corner)) => {
            writeln!(out, "\nstatic const eft_derivative_parameters EFT_VELOCITY = {{")?;
            writeln!(out, "  .sample_rate = {rate}, /* Hz */")?;
            writeln!(out, "  .corner = {}, /* Hz */\n}};", number(corner))?;
        }
        Some(Velocity::Observer([displacement, velocity, drift], per_mass)) => {
            writeln!(out, "\nstatic const eft_observer_parameters EFT_VELOCITY = {{")?;
            writeln!(out, "  .sample_rate = {rate}, /* Hz */")?;
            writeln!(out, "  .gain_on_displacement = {}, /* 1 */", number(displacement))?;
            writeln!(out, "  .gain_on_velocity = {}, /* 1/s */", number(velocity))?;
            writeln!(out, "  .gain_on_drift = {}, /* 1/s2 */\n}};", number(drift))?;
            match per_mass {
                Some(per_mass) => {
                    writeln!(out, "/* Times the force, the acceleration that the observer takes, 1/kg. */")?;
                    writeln!(out, "static const double EFT_PER_MASS = {};", number(per_mass))?;
                }
                None => writeln!(out, "/* It takes the accelerometer's reading, m/s2. */")?,
            }
        }
    }
    let Some(p) = &parts.protection else { return Ok(()) };
    writeln!(out, "\nstatic const eft_protection_parameters EFT_PROTECTION = {{")?;
    writeln!(out, "  .sample_rate = {rate}, /* Hz */")?;
    for (signal, levels, unit) in levels(p) {
        writeln!(out, "  .{signal}_warning = {}, /* {unit} */", limit(levels.warning, NONE))?;
        writeln!(out, "  .{signal}_trip = {}, /* {unit} */", limit(levels.trip, NONE))?;
    }
    for (key, value, unit) in protection_fields(p) {
        writeln!(out, "  .{key} = {}, /* {unit} */", limit(value, NONE))?;
    }
    writeln!(out, "}};")
}
