//! The export in Rust: constants of `eft-core`.

use std::fmt::{Result, Write as _};

use eft_core::VelocitySource;

use super::fields::{Field, Value, fields, learning, list, number, plausibility, protection};
use super::notes::lines;
use super::parts::{Parts, Target};

const NONE: &str = "f64::MAX";

/// The whole file.
pub(super) fn write(out: &mut String, parts: &Parts) -> Result {
    let p = &parts.parameters;
    for line in lines(parts, Target::Rust) {
        writeln!(out, "{}", format!("//! {line}").trim_end())?;
    }
    let learns = p.learning.is_on();
    let used = [
        ("Channel", true),
        ("Learner", learns),
        ("Learning", true),
        ("Levels", p.protection.is_some()),
        ("Mode", true),
        ("Parameters", true),
        ("PlausibilityParameters", p.protection.is_some_and(|p| p.plausibility.is_some())),
        ("ProtectionParameters", p.protection.is_some()),
        ("Realization", true),
        ("SignFrom", true),
        ("VelocitySource", true),
    ];
    let used: Vec<_> = used.iter().filter(|name| name.1).map(|name| name.0).collect();
    writeln!(out, "use eft_core::{{\n    {},\n}};\n", used.join(", "))?;
    writeln!(out, "/// Points of the flow table.\npub const POINTS: usize = {};\n", p.openings.len())?;
    writeln!(out, "/// The parameters of channel and learner.")?;
    writeln!(out, "pub const PARAMETERS: Parameters = Parameters {{")?;
    structure(out, &fields(p), "    ")?;
    writeln!(out, "}};\n")?;
    constant(out, "The channel: the whole tick.", "CHANNEL", "Channel")?;
    if learns {
        writeln!(out)?;
        constant(out, "The learner, which calibrates the channel.", "LEARNER", "Learner")?;
    }
    Ok(())
}

/// A constant of the parameters, checked by the compiler.
fn constant(out: &mut String, says: &str, name: &str, kind: &str) -> Result {
    writeln!(out, "/// {says}\npub static {name}: {kind}<f32, POINTS> =")?;
    writeln!(out, "    match {kind}::<f32, POINTS>::new(&PARAMETERS) {{")?;
    writeln!(out, "        Ok(made) => made,\n        Err(_) => panic!(\"refused\"),\n    }};")
}

fn structure(out: &mut String, fields: &[Field], indent: &str) -> Result {
    for (name, value, unit) in fields {
        write!(out, "{indent}{name}: ")?;
        match value {
            Value::Number(value) => write!(out, "{}", number(*value, NONE))?,
            Value::Count(value) => write!(out, "{value}")?,
            Value::Switch(on) => write!(out, "{on}")?,
            Value::Choice(of, choice) => write!(out, "{of}::{choice}")?,
            Value::Numbers(values) => write!(out, "&[{}]", list(values))?,
            Value::Bounds(bounds) => write!(out, "[{}]", list(bounds))?,
            Value::Velocity(source) => velocity(out, source)?,
            Value::Limits(levels) => {
                let (warning, trip) = (number(levels.warning, NONE), number(levels.trip, NONE));
                write!(out, "Levels {{ warning: {warning}, trip: {trip} }}")?;
            }
            Value::Learning(what) => part(out, "Learning {", &learning(what), indent, "}")?,
            Value::Plausibility(None) | Value::Protection(None) => write!(out, "None")?,
            Value::Plausibility(Some(p)) => {
                part(out, "Some(PlausibilityParameters {", &plausibility(p), indent, "})")?;
            }
            Value::Protection(Some(p)) => {
                part(out, "Some(ProtectionParameters {", &protection(p), indent, "})")?;
            }
        }
        writeln!(out, "{}", if unit.is_empty() { ",".to_owned() } else { format!(", // {unit}") })?;
    }
    Ok(())
}

/// A struct within the struct.
fn part(out: &mut String, open: &str, fields: &[Field], indent: &str, close: &str) -> Result {
    writeln!(out, "{open}")?;
    structure(out, fields, &format!("{indent}    "))?;
    write!(out, "{indent}{close}")
}

fn velocity(out: &mut String, source: &VelocitySource) -> Result {
    match source {
        VelocitySource::Sensor => write!(out, "VelocitySource::Sensor"),
        VelocitySource::Derivative { corner } => {
            write!(out, "VelocitySource::Derivative {{ corner: {corner:?} }}")
        }
        VelocitySource::Observer { gains, mass } => {
            write!(out, "VelocitySource::Observer {{ gains: [{}], mass: {mass:?} }}", list(gains))
        }
        VelocitySource::Accelerometer { gains } => {
            write!(out, "VelocitySource::Accelerometer {{ gains: [{}] }}", list(gains))
        }
    }
}
