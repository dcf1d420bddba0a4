//! `modelDescription.xml` in both versions, and the rig file of the FMU.

use std::collections::BTreeSet;
use std::fmt::Write;

use eft_sim::units::dimension;
use eft_sim::{Error, Result, RigConfig};

use crate::model::{Model, Part};
use crate::table::variables;
use crate::variables::{Role, Type, Variable};

/// Version of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    Three,
}

impl Version {
    /// The version 2 or 3.
    ///
    /// # Errors
    /// Another number.
    pub fn numbered(number: u32) -> Result<Self> {
        match number {
            2 => Ok(Self::Two),
            3 => Ok(Self::Three),
            _ => Err(Error::value("fmi", number, "must be 2 or 3")),
        }
    }
}

/// FNV-1a over bytes.
pub(crate) fn fnv(bytes: &[u8]) -> u64 {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, step)
}

/// The token that identifies the part of an instance, and that description and rig belong together.
pub(crate) fn token(part: Part, resource: &str) -> String {
    format!("eft-{}-{:016x}", part.name(), fnv(resource.as_bytes()))
}

/// The file `resources/rig.toml` of an FMU. For the virtual rig it has the true values, for the controller
/// the configured ones. The valve command is sampled for any `controller.realization`.
///
/// # Errors
/// A controller with a computation delay, which the importer realizes.
pub fn resource(rig: &RigConfig, part: Part) -> Result<String> {
    let delay = rig.compensation.computation_delay;
    if part == Part::Controller && delay > 0 {
        let allowed = "must be 0 for an FMU: its importer delays the valve command";
        return Err(Error::value("compensation.computation_delay", delay, allowed));
    }
    let own = match part {
        Part::Rig => rig.plant().clone(),
        Part::Controller => rig.without(&["truth"])?,
    };
    Ok(own.replace(&[("controller.realization", "digital".into())])?.to_toml())
}

/// The file `modelDescription.xml` of an FMU whose library is called `eft_rig` or `eft_controller`.
///
/// # Errors
/// As [`resource`]; a rig that cannot be run.
pub fn description(rig: &RigConfig, part: Part, version: Version) -> Result<String> {
    let resource = resource(rig, part)?;
    let own = RigConfig::from_toml(&resource)?;
    Model::new(part, &own, false)?;
    let (table, token) = (variables(part, &own), token(part, &resource));
    let period = 1.0 / own.controller.sample_rate;
    let name = escaped(&format!("{} {}", rig.name.as_deref().unwrap_or("eft"), part.name()));
    let tool = format!("eft {}", env!("CARGO_PKG_VERSION"));
    let part = part.name();
    let head = match version {
        Version::Two => format!(
            "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"{name}\" guid=\"{token}\" generationTool=\"{tool}\" \
             variableNamingConvention=\"structured\">\n  <CoSimulation modelIdentifier=\"eft_{part}\" \
             canHandleVariableCommunicationStepSize=\"false\" canNotUseMemoryManagementFunctions=\"true\" \
             canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\"/>\n"
        ),
        Version::Three => format!(
            "<fmiModelDescription fmiVersion=\"3.0\" modelName=\"{name}\" instantiationToken=\"{token}\" \
             generationTool=\"{tool}\" variableNamingConvention=\"structured\">\n  <CoSimulation \
             modelIdentifier=\"eft_{part}\" canHandleVariableCommunicationStepSize=\"false\" \
             fixedInternalStepSize=\"{period:?}\" canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\"/>\n"
        ),
    };
    let mut text = format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{head}");
    text += "  <UnitDefinitions>\n";
    for unit in table.iter().map(|one| one.unit).filter(|unit| !unit.is_empty()).collect::<BTreeSet<_>>() {
        text += &unit_definition(unit);
    }
    text += "  </UnitDefinitions>\n  <LogCategories>\n    <Category name=\"logStatusError\"/>\n  </LogCategories>\n";
    // Ten seconds, for importers that run a single FMU.
    text += &format!("  <DefaultExperiment startTime=\"0\" stopTime=\"10\" stepSize=\"{period:?}\"/>\n");
    text += "  <ModelVariables>\n";
    for (reference, variable) in table.iter().enumerate() {
        text += &element(reference, variable, version);
    }
    text += "  </ModelVariables>\n  <ModelStructure>\n";
    text += &structure(&table, version);
    text += "  </ModelStructure>\n</fmiModelDescription>\n";
    Ok(text)
}

/// A unit with its base units. A unit outside the SI, such as samples, has none.
fn unit_definition(unit: &str) -> String {
    let name = escaped(unit);
    let Some([kilograms, metres, seconds, volts]) = dimension(unit) else {
        return format!("    <Unit name=\"{name}\"/>\n");
    };
    // A volt is kg·m²/(s³·A).
    let exponents =
        [("kg", kilograms + volts), ("m", metres + 2 * volts), ("s", seconds - 3 * volts), ("A", -volts)];
    let mut text = format!("    <Unit name=\"{name}\"><BaseUnit");
    for (base, exponent) in exponents.into_iter().filter(|(_, exponent)| *exponent != 0) {
        let _ = write!(text, " {base}=\"{exponent}\"");
    }
    text + "/></Unit>\n"
}

/// A variable. The order of attributes is that of the version's schema.
fn element(reference: usize, variable: &Variable, version: Version) -> String {
    let Variable { name, unit, kind, role, start, doc, .. } = variable;
    let (causality, variability) = match role {
        Role::Time => ("independent", "continuous"),
        Role::Input => ("input", "discrete"),
        Role::Output => ("output", "discrete"),
        Role::Parameter => ("parameter", "fixed"),
    };
    let common = format!(
        "name=\"{name}\" valueReference=\"{reference}\" causality=\"{causality}\" variability=\"{variability}\" \
         description=\"{}\"",
        escaped(doc)
    );
    let mut own = String::new();
    if !unit.is_empty() && *kind == Type::Real {
        own += &format!(" unit=\"{}\"", escaped(unit));
    }
    if let Some((low, high)) = variable.range() {
        own += &match kind {
            Type::Real => format!(" min=\"{low:?}\" max=\"{high:?}\""),
            _ => format!(" min=\"{low}\" max=\"{high}\""),
        };
    }
    if matches!(role, Role::Input | Role::Parameter) {
        own += &match kind {
            Type::Real => format!(" start=\"{start:?}\""),
            Type::Integer => format!(" start=\"{start}\""),
            Type::Boolean => format!(" start=\"{}\"", *start != 0.0),
        };
    }
    match version {
        Version::Two => {
            format!("    <ScalarVariable {common}><{kind:?}{own}/></ScalarVariable>\n")
        }
        Version::Three => {
            let kind = match kind {
                Type::Real => "Float64",
                Type::Integer => "Int32",
                Type::Boolean => "Boolean",
            };
            format!("    <{kind} {common}{own}/>\n")
        }
    }
}

/// The outputs, which are known after the initialization.
fn structure(table: &[Variable], version: Version) -> String {
    let outputs = || (0..).zip(table).filter(|(_, one)| one.role == Role::Output).map(|(place, _)| place);
    let mut text = String::new();
    match version {
        Version::Two => {
            for section in ["Outputs", "InitialUnknowns"] {
                text += &format!("    <{section}>\n");
                outputs().for_each(|place: usize| {
                    text += &format!("      <Unknown index=\"{}\"/>\n", place + 1);
                });
                text += &format!("    </{section}>\n");
            }
        }
        Version::Three => {
            for element in ["Output", "InitialUnknown"] {
                outputs().for_each(|place: usize| {
                    text += &format!("    <{element} valueReference=\"{place}\"/>\n");
                });
            }
        }
    }
    text
}

/// A text inside an attribute.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for one in text.chars() {
        match one {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            // XML allows no other control character.
            one if one.is_control() => out.push(' '),
            one => out.push(one),
        }
    }
    out
}
