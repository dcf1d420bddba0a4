#![allow(clippy::float_cmp, reason = "bits are compared on purpose")]

mod configuration;
mod learning;
mod parts;
mod samples;
mod trips;
mod trusted_signals;

use super::*;
use crate::cause::Cause;
use crate::parameters::{Learning, PlausibilityParameters, ProtectionParameters};

const RIG: Parameters =
    Parameters { protection: Some(ProtectionParameters::DEFAULT), ..Parameters::ZHAO2005 };

/// A protection with a plausibility watch.
const WATCHED: Option<ProtectionParameters> = Some(ProtectionParameters {
    plausibility: Some(PlausibilityParameters::DEFAULT),
    ..ProtectionParameters::DEFAULT
});

fn swing(tick: u32) -> Input<f64> {
    let x = libm::sin(0.01 * f64::from(tick));
    Input { command: 3e3 * x, velocity: 0.2 * x, force: 2.9e3 * x, spool: 0.15 * x, ..Input::default() }
}

fn still(_: u32) -> Input<f64> {
    Input { displacement: 0.0, ..swing(0) }
}

/// The first tick at which a channel has tripped.
fn until_tripped(
    state: &mut ChannelState<f64>,
    channel: &Channel<f64, 21>,
    of: impl Fn(u32) -> Input<f64>,
) -> u32 {
    let tripped = |tick: &u32| channel.step(state, &of(*tick)).status & status::TRIPPED != 0;
    (0..20_000).find(tripped).unwrap_or(u32::MAX)
}
