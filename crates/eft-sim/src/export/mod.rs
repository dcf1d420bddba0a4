//! From a rig to a ready configuration for firmware, as source text.

use std::fmt::Write as _;

use eft_core::{AdaptiveParameters, CompensationParameters, Mode, SignFrom};

use crate::closed_loop::{Precision, adaptive_parameters, adapts, compensation_parameters};
use crate::config::{RigConfig, VelocitySource};
use crate::error::{Error, Result};

/// Points a flow table may have in the C interface.
const C_CAPACITY: usize = 21;

/// The language of the exported configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// A constant `eft_core::Controller` or `AdaptiveController`, checked by the compiler.
    Rust,
    /// A constant `eft_parameters` or `eft_adaptive_parameters` for `eft.h`, checked here and again by
    /// `eft_configure_f32` or `eft_adaptive_configure_f32`.
    C,
}

impl std::str::FromStr for Target {
    type Err = Error;
    fn from_str(name: &str) -> Result<Self> {
        match name {
            "rust" => Ok(Self::Rust),
            "c" => Ok(Self::C),
            other => Err(Error::value("target", other, "must be \"rust\" or \"c\"")),
        }
    }
}

/// The configuration of a rig's controller as a source file; the digital side runs at `controller.sample_rate`. A rig
/// with feedforward, estimators, guard or supply correction makes an adaptive controller.
///
/// # Errors
/// A rig that the controller refuses, in `f32` or at all; parts that firmware has to build itself (protection,
/// computation delay); for C, a flow table of more than 21 points.
pub fn export(rig: &RigConfig, name: &str, target: Target) -> Result<String> {
    rig.validate()?;
    let rate = rig.controller.sample_rate;
    <f32 as Precision>::controller(rig, rate)?;
    exportable(rig)?;
    let points = rig.servovalve.flow_table.openings.len();
    if target == Target::C && points > C_CAPACITY {
        return Err(Error::value("servovalve.flow_table", points, "must have at most 21 points for C"));
    }
    let asked = adapts(rig) || rig.compensation.feedforward;
    let adaptive = if asked { Some(adaptive_parameters(rig, rate)?) } else { None };
    if adaptive.is_some() {
        <f32 as Precision>::adaptive(rig, rate)?;
    }
    let mut out = String::new();
    let written = match target {
        Target::Rust => rust(&mut out, rig, name, &compensation_parameters(rig, rate), adaptive.as_ref()),
        Target::C => c(&mut out, rig, name, &compensation_parameters(rig, rate), adaptive.as_ref()),
    };
    written.map_err(|_| Error::value("name", name, "could not be written"))?;
    Ok(out)
}

/// Refuses what firmware has to build itself, around the controller.
fn exportable(rig: &RigConfig) -> Result<()> {
    if rig.protection.enabled {
        return Err(Error::value("protection.enabled", true, "must be false for firmware"));
    }
    let delay = rig.compensation.computation_delay;
    if delay != 0 {
        return Err(Error::value("compensation.computation_delay", delay, "must be 0 for firmware"));
    }
    if rig.controller.velocity_source != VelocitySource::Sensor {
        return Err(Error::value(
            "controller.velocity_source",
            "an estimate",
            "must be \"sensor\" for firmware",
        ));
    }
    Ok(())
}

/// Refuses a rig whose controller is more than one `eft_core::Controller`, by the first key that asks for more.
pub(crate) fn runs_on_firmware(rig: &RigConfig) -> Result<()> {
    let asked = [
        ("compensation.feedforward", rig.compensation.feedforward),
        ("compensation.adaptive", rig.compensation.adaptive),
        ("compensation.guard", rig.compensation.guard),
        ("compensation.supply_correction", rig.compensation.supply_correction),
    ];
    match asked.into_iter().find(|(_, on)| *on) {
        None => exportable(rig),
        Some((key, _)) => Err(Error::value(key, true, "must be false for firmware")),
    }
}

/// A number that reads back as itself, in both languages.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn list(values: &[f64]) -> String {
    values.iter().map(|&v| number(v)).collect::<Vec<_>>().join(", ")
}

fn rust(
    out: &mut String,
    rig: &RigConfig,
    name: &str,
    p: &CompensationParameters,
    adaptive: Option<&AdaptiveParameters>,
) -> std::fmt::Result {
    let table = &rig.servovalve.flow_table;
    let n = table.openings.len();
    let c = &rig.controller;
    let limit = |value: Option<f64>| value.map_or("f64::MAX".to_owned(), number);
    let mode = match p.mode {
        Mode::Off => "Off",
        Mode::Linear => "Linear",
        Mode::Nonlinear => "Nonlinear",
    };
    let sign_from = match p.sign_from {
        SignFrom::Spool => "Spool",
        SignFrom::Demand => "Demand",
    };
    writeln!(out, "//! The controller of `{name}` at {} Hz, exported by eft.", c.sample_rate)?;
    let parts = match adaptive {
        None => {
            "Compensation, CompensationParameters, Controller, FlowTable, Limiter, Mode,\n    ServovalveController, SignFrom"
        }
        Some(_) => {
            "AdaptiveCompensation, AdaptiveController, AdaptiveParameters, CompensationParameters, FlowTable,\n    Limiter, Mode, ServovalveController, SignFrom, Tuning"
        }
    };
    writeln!(out, "use eft_core::{{\n    {parts},\n}};\n")?;
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
        limit(rig.limits.valve_command),
        limit(rig.limits.valve_command_rate)
    )?;
    writeln!(out, "    }}\n}};")
}

fn c(
    out: &mut String,
    rig: &RigConfig,
    name: &str,
    p: &CompensationParameters,
    adaptive: Option<&AdaptiveParameters>,
) -> std::fmt::Result {
    let table = &rig.servovalve.flow_table;
    let limit = |value: Option<f64>| value.map_or("DBL_MAX".to_owned(), number);
    let mode = match p.mode {
        Mode::Off => "OFF",
        Mode::Linear => "LINEAR",
        Mode::Nonlinear => "NONLINEAR",
    };
    let sign_from = match p.sign_from {
        SignFrom::Spool => "SPOOL",
        SignFrom::Demand => "DEMAND",
    };
    let comment = name.replace("*/", "* /");
    writeln!(
        out,
        "/* The controller of {comment} at {} Hz, exported by eft. */",
        rig.controller.sample_rate
    )?;
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
        ("valve_command", limit(rig.limits.valve_command), "V"),
        ("valve_command_rate", limit(rig.limits.valve_command_rate), "V/s"),
    ] {
        writeln!(out, "  .{key} = {value}, /* {unit} */")?;
    }
    writeln!(
        out,
        "  .openings = {{{}}},\n  .flows = {{{}}}, /* m3/s */\n{}}};",
        list(&table.openings),
        list(&table.flows),
        if adaptive.is_some() { "} " } else { "" }
    )
}

/// What the adaptive controller knows besides, by the same names in both languages.
fn adaptive_fields(a: &AdaptiveParameters) -> [(&'static str, f64, &'static str); 3] {
    [
        ("compressibility", a.compressibility, "m3/Pa"),
        ("leakage", a.leakage, "m3/(s Pa)"),
        ("velocity_delay", a.velocity_delay, "s"),
    ]
}

/// The fields that both languages name alike.
fn fields(p: &CompensationParameters) -> [(&'static str, f64, &'static str); 11] {
    [
        ("level", p.level, "1"),
        ("piston_area", p.piston_area, "m2"),
        ("supply_pressure", p.supply_pressure, "Pa"),
        ("flow_gain", p.flow_gain, "m3/s"),
        ("valve_gain", p.valve_gain, "1/V"),
        ("response_delay", p.response_delay, "s"),
        ("lead_alpha", p.lead_alpha, "1"),
        ("spool_warning", p.spool_warning, "1"),
        ("velocity_range", p.velocity_range, "m/s"),
        ("force_range", p.force_range, "N"),
        ("spool_range", p.spool_range, "1"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// To take over a change: `EFT_WRITE_EXPORTS=1 cargo test -p eft-sim firmware_holds`.
    #[test]
    fn firmware_holds_what_its_rigs_export() {
        let firmware = concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/rigs");
        let uneven = std::fs::read_to_string(format!("{firmware}/uneven.toml")).unwrap();
        let adaptive = RigConfig::zhao2005()
            .replace::<&str>(&[
                ("compensation.feedforward", true.into()),
                ("compensation.adaptive", true.into()),
                ("limits.valve_command", 10.0.into()),
                ("limits.valve_command_rate", 2.0e4.into()),
                ("limits.velocity_range", 3.0.into()),
                ("limits.force_range", 2.0e5.into()),
                ("limits.spool_range", 1.2.into()),
            ])
            .unwrap();
        for (name, rig) in [
            ("zhao2005", RigConfig::zhao2005()),
            ("uneven", RigConfig::from_toml(&uneven).unwrap()),
            ("adaptive", adaptive),
        ] {
            for (target, path) in [(Target::Rust, format!("src/{name}.rs")), (Target::C, format!("{name}.h"))]
            {
                let (path, fresh) = (format!("{firmware}/{path}"), export(&rig, name, target).unwrap());
                if std::env::var_os("EFT_WRITE_EXPORTS").is_some() {
                    std::fs::write(&path, &fresh).unwrap();
                }
                assert_eq!(std::fs::read_to_string(&path).unwrap(), fresh, "{path}");
            }
        }
    }

    #[test]
    fn numbers_read_back_as_themselves() {
        for value in [0.0, -1.0, 8.212e-3, 1.9e7, 1.0 / 3.0, f64::MAX, 5.0e-324] {
            assert_eq!(number(value).parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
    }

    #[test]
    fn what_firmware_must_build_itself_is_refused() {
        let mut rig = RigConfig::zhao2005();
        rig.protection.enabled = true;
        let refusal = export(&rig, "rig", Target::C).unwrap_err().to_string();
        assert_eq!(refusal, "protection.enabled = true: must be false for firmware");
        rig = RigConfig::zhao2005();
        rig.compensation.computation_delay = 2;
        assert!(export(&rig, "rig", Target::Rust).is_err());
        rig = RigConfig::zhao2005();
        rig.compensation.level = -1.0;
        assert!(export(&rig, "rig", Target::Rust).is_err());
    }
}
