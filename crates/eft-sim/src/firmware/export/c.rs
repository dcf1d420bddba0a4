//! The export in C: a constant for `eft.h`.

use std::fmt::{Result, Write as _};

use eft_core::{PlausibilityParameters, ProtectionParameters, VelocitySource};

use super::fields::{Field, Value, fields, learning, list, number, plausibility, protection};
use super::notes::lines;
use super::parts::{Parts, Target};

const NONE: &str = "DBL_MAX";

/// Writes the whole file. The values are in the order of `eft_parameters`, because C++17 has no initialisers
/// by name.
pub(super) fn write(out: &mut String, parts: &Parts) -> Result {
    let constant = constant(parts.name);
    for (n, line) in lines(parts, Target::C).iter().enumerate() {
        let start = if n == 0 { "/*" } else { " *" };
        writeln!(out, "{}", format!("{start} {line}").trim_end())?;
    }
    let mut values = String::new();
    structure(&mut values, &fields(&parts.parameters), "  ")?;
    let checksum = checksum(&values);
    writeln!(out, " */\n#ifndef {constant}_H\n#define {constant}_H")?;
    writeln!(out, "#define {constant}_CHECKSUM {checksum}\n")?;
    writeln!(out, "#include <float.h>\n\n#include \"eft.h\"\n")?;
    writeln!(out, "static const eft_parameters {constant} = {{\n{values}}};\n")?;
    writeln!(out, "#elif {constant}_CHECKSUM != {checksum}")?;
    writeln!(out, "#error \"two rigs are called {constant}: export one of them with another --name\"\n#endif")
}

/// A checksum (FNV-1a) of the values as C writes it. A second rig of the same name is recognised by it.
fn checksum(values: &str) -> String {
    let step = |sum: u32, byte: u8| (sum ^ u32::from(byte)).wrapping_mul(0x0100_0193);
    format!("{:#010x}", values.bytes().fold(0x811c_9dc5, step))
}

/// The constant's name: `EFT_RIG`, followed by the rig's name with the letters that C allows.
fn constant(rig: &str) -> String {
    let of = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
    match rig {
        "rig" => "EFT_RIG".to_owned(),
        named => format!("EFT_RIG_{}", named.chars().map(of).collect::<String>()),
    }
}

fn structure(out: &mut String, fields: &[Field], indent: &str) -> Result {
    for (name, value, unit) in fields {
        let text = match value {
            Value::Number(value) => number(*value, NONE),
            Value::Count(value) => format!("{value}u"),
            Value::Switch(on) => u8::from(*on).to_string(),
            Value::Choice(of, choice) => format!("EFT_{}_{}", screaming(of), choice.to_uppercase()),
            Value::Numbers(values) => {
                if *name == "openings" {
                    writeln!(out, "{indent}{}u, /* table_length */", values.len())?;
                }
                format!("{{{}}}", list(values))
            }
            Value::Bounds(bounds) => format!("{{{}}}", list(bounds)),
            Value::Velocity(source) => {
                velocity(out, source, indent)?;
                continue;
            }
            Value::Limits(levels) => {
                for (level, value) in [("warning", levels.warning), ("trip", levels.trip)] {
                    writeln!(out, "{indent}{}, /* {name}_{level}, {unit} */", number(value, NONE))?;
                }
                continue;
            }
            Value::Learning(what) => {
                part(out, name, None, &learning(what), indent)?;
                continue;
            }
            Value::Protection(what) => {
                let fields = protection(&what.unwrap_or(ProtectionParameters::DEFAULT));
                part(out, name, Some(what.is_some()), &fields, indent)?;
                continue;
            }
            Value::Plausibility(what) => {
                let fields = plausibility(&what.unwrap_or(PlausibilityParameters::DEFAULT));
                part(out, name, Some(what.is_some()), &fields, indent)?;
                continue;
            }
        };
        let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
        writeln!(out, "{indent}{text}, /* {name}{unit} */")?;
    }
    Ok(())
}

/// A struct within the struct, with a switch if it may be absent.
fn part(out: &mut String, name: &str, enabled: Option<bool>, fields: &[Field], indent: &str) -> Result {
    let inside = format!("{indent}  ");
    writeln!(out, "{indent}{{ /* {name} */")?;
    if let Some(enabled) = enabled {
        writeln!(out, "{inside}{}, /* enabled */", u8::from(enabled))?;
    }
    structure(out, fields, &inside)?;
    writeln!(out, "{indent}}},")
}

/// An enumeration's name as C writes it.
fn screaming(name: &str) -> String {
    let mut out = String::new();
    for (n, c) in name.chars().enumerate() {
        if n > 0 && c.is_uppercase() {
            out.push('_');
        }
        out.extend(c.to_uppercase());
    }
    out
}

/// The velocity source, and the numbers of all sources; numbers of other sources are 0.
fn velocity(out: &mut String, source: &VelocitySource, indent: &str) -> Result {
    let (name, corner, gains, mass) = match *source {
        VelocitySource::Sensor => ("SENSOR", 0.0, [0.0; 3], 0.0),
        VelocitySource::Derivative { corner } => ("DERIVATIVE", corner, [0.0; 3], 0.0),
        VelocitySource::Observer { gains, mass } => ("OBSERVER", 0.0, gains, mass),
        VelocitySource::Accelerometer { gains } => ("ACCELEROMETER", 0.0, gains, 0.0),
    };
    let [displacement, velocity, drift] = gains;
    writeln!(out, "{indent}EFT_VELOCITY_{name}, /* velocity_source */")?;
    for (name, value, unit) in [
        ("corner", corner, "Hz"),
        ("gain_on_displacement", displacement, "1"),
        ("gain_on_velocity", velocity, "1/s"),
        ("gain_on_drift", drift, "1/s2"),
        ("mass", mass, "kg"),
    ] {
        writeln!(out, "{indent}{value:?}, /* {name}, {unit} */")?;
    }
    Ok(())
}
