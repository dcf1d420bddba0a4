//! Duties of the firmware that constants cannot hold, for the first comment of the exported file.

use eft_core::{Levels, ProtectionParameters, Realization, VelocitySource};

use crate::closed_loop::soft_end_ticks;

use super::parts::{Parts, Target};

/// Longest line of a comment, without comment marks.
const WIDTH: usize = 96;

/// The lines of the first comment.
pub(super) fn lines(parts: &Parts, target: Target) -> Vec<String> {
    let rate = parts.rig.controller.sample_rate;
    let name = match target {
        Target::Rust => format!("`{}`", printable(parts.name)),
        Target::C => printable(parts.name),
    };
    let mut lines = vec![format!("The controller of {name} at {rate} Hz, exported by eft."), String::new()];
    lines.extend(wrapped(&notes(parts, target).join(" ")));
    lines
}

/// One sentence or two about each key that a constant cannot hold.
fn notes(parts: &Parts, target: Target) -> Vec<String> {
    let (rig, p) = (parts.rig, &parts.parameters);
    let (step, end) = match target {
        Target::Rust => ("`CHANNEL.step`", "`ChannelState::end`"),
        Target::C => ("eft_step", "eft_request_end"),
    };
    let mut notes = Vec::new();
    match p.realization {
        Realization::Digital => {
            notes.push(format!("The force loop is closed here: {step} gives the valve command, V."));
        }
        Realization::Analog => {
            notes.push(format!(
                "An analog controller closes the force loop of this rig: {step} gives the compensation signal, V, that \
                 is added to its force error."
            ));
            if p.learning.is_on() {
                notes.push("The analog controller's valve command, V, is sampled with the rest.".to_owned());
            }
            if p.protection.is_some() {
                let protected = "It follows the command that the protection permits, and its valve command is \
                     multiplied by the protection's authority.";
                notes.push(protected.to_owned());
            }
        }
    }
    if p.feedforward && p.look_ahead {
        notes.push("The next tick's command, N, is given with this one's.".to_owned());
    }
    if rig.controller.force_delay > 0.0 {
        let late = rig.controller.force_delay;
        let (milliseconds, samples) = (1e3 * late, late * p.sample_rate);
        notes.push(format!(
            "The command is played {milliseconds:.3} ms ({samples} samples) later, which is the load cell's latency. It is \
             interpolated linearly between its samples, and 0 N before the first."
        ));
        if p.feedforward && p.look_ahead {
            notes.push(match p.realization {
                Realization::Digital => "The next tick's command is given without this delay.".to_owned(),
                Realization::Analog => "The next tick's command has the same delay.".to_owned(),
            });
        }
    }
    let estimated = !matches!(p.velocity_source, VelocitySource::Sensor);
    let accelerometer = matches!(p.velocity_source, VelocitySource::Accelerometer { .. });
    let limited = |q: &ProtectionParameters| q.displacement != Levels::NONE || q.plausibility.is_some();
    let pressure =
        |q: &ProtectionParameters| q.plausibility.is_some_and(|w| w.load_pressure_tolerance < f64::MAX);
    for (signal, given) in [
        ("displacement, m", estimated || p.protection.is_some_and(|q| limited(&q))),
        ("acceleration, m/s2", accelerometer),
        ("supply pressure, Pa", p.supply_correction),
        ("load pressure, Pa", p.protection.is_some_and(|q| pressure(&q))),
    ] {
        if given {
            notes.push(format!("The measured {signal}, is given with every sample."));
        }
    }
    if p.protection.is_none() {
        notes.push("The protection is off: no level, fault or request trips.".to_owned());
    }
    if p.protection.is_some() && rig.protection.soft_end {
        let ticks = soft_end_ticks(rig, p.sample_rate);
        notes.push(format!("The command fades at its end: {end} is called before its last {ticks} ticks."));
    }
    notes
}

/// A name on one line, without character sequences that begin or end a comment in either language.
fn printable(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        match c {
            '\'' | '"' | '\\' => out.push(c),
            _ => out.extend(c.escape_debug()),
        }
    }
    out.replace("*/", "* /").replace("/*", "/ *")
}

/// A text wrapped to the width.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) if line.chars().count() + 1 + word.chars().count() <= WIDTH => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
