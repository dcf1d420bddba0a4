//! Export of a rig's controller parameters as source text for firmware.

mod c;
mod fields;
mod notes;
mod parts;
mod rust;

use crate::closed_loop::{Precision, parameters};
use crate::{Error, Result, RigConfig, checks};
use parts::Parts;

pub use parts::Target;

/// Points a flow table may have in the C interface.
const C_CAPACITY: usize = 21;

/// The parameters of a rig's channel as a source file; the digital side runs at `controller.sample_rate`. The
/// first comment lists duties of the firmware that a constant cannot hold, such as measuring the supply
/// pressure or starting the soft end.
///
/// In C the constant is `EFT_RIG_` and the name, so that one program can contain several rigs. The default
/// name is that of the rig, with the letters that C allows.
///
/// # Errors
/// The name is not an identifier, the channel or its learner refuses the rig, or the rig has a computation
/// delay, which the timing of the firmware determines. For C, the flow table has more than 21 points.
pub fn export(rig: &RigConfig, name: Option<&str>, target: Target) -> Result<String> {
    let name = match name {
        Some(name) => identifier(name)?,
        None => rig.name.as_deref().unwrap_or("rig"),
    };
    let parameters = parameters(rig, rig.controller.sample_rate)?;
    <f32 as Precision>::channel(&parameters)?;
    if parameters.learning.is_on() {
        <f32 as Precision>::learner(&parameters)?;
    }
    exportable(rig)?;
    let points = parameters.openings.len();
    if target == Target::C && points > C_CAPACITY {
        let (own, more) = (rig.servovalve.flow_table.openings.len(), points - C_CAPACITY);
        let (key, value) = if own > C_CAPACITY {
            ("servovalve.flow_table", format!("{own} points"))
        } else {
            ("servovalve.overlap", rig.servovalve.overlap.to_string())
        };
        let allowed = format!(
            "needs {points} points, and C has {C_CAPACITY}: leave at least {more} of the {own} out of \
             `servovalve.flow_table`, or export for Rust"
        );
        return Err(Error::value(key, value, allowed));
    }
    let parts = Parts { rig, name, parameters };
    let mut out = String::new();
    let written = match target {
        Target::Rust => rust::write(&mut out, &parts),
        Target::C => c::write(&mut out, &parts),
    };
    written.map_err(|_| Error::value("name", name, "could not be written"))?;
    Ok(out)
}

/// Refuses a name that is not an identifier.
fn identifier(name: &str) -> Result<&str> {
    let digit_first = name.starts_with(|first: char| first.is_ascii_digit());
    let takes = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let allowed = "must be an identifier: letters, digits and _, no digit first";
    checks::require(!name.is_empty() && !digit_first && name.chars().all(takes), "name", name, allowed)?;
    Ok(name)
}

/// Refuses settings that only the firmware itself can realize.
pub(crate) fn exportable(rig: &RigConfig) -> Result<()> {
    if let Some(saved) = rig.calibration.of(0) {
        let allowed =
            "must be left out: firmware starts from it by `Learner::start_from` or `eft_start_from_f32`";
        return Err(Error::value("calibration.version", saved.version, allowed));
    }
    let delay = rig.compensation.computation_delay;
    checks::require(delay == 0, "compensation.computation_delay", delay, "must be 0 for firmware")
}

#[cfg(test)]
mod tests;
