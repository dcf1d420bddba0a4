//! How far a setting may go until the linear loop is no longer stable.

use std::borrow::Cow;

use super::gains::FlowGain;
use super::sampled::MOST_STATES;
use super::{Time, linearize};
use crate::config::{Mode, Realization, RigConfig, RigValues};
use crate::state_space::{AT_REST, per_second};
use crate::{Error, Result};

/// The largest level that a controller takes.
const HIGHEST_LEVEL: f64 = 10.0;
/// The longest response delay (s) that a controller takes.
const LONGEST_RESPONSE_DELAY: f64 = 1.0;
/// Largest and smallest factor on a gain that is tried.
const LARGEST_FACTOR: f64 = 1e3;
const SMALLEST_FACTOR: f64 = 1e-3;
/// Additional samples of delay that are tried.
const MOST_SAMPLES: u32 = 64;
/// Relative length of a step of the search: an unstable range shorter than this can be missed.
const STEP: f64 = 0.02;
/// Relative distance between the last stable value and the first unstable one.
const RESOLUTION: f64 = 1e-12;

/// The stable range of each setting of the linear loop, changed alone; infinite if no value destabilises the
/// loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Margins {
    /// Growth rate (1/s) of the least damped mode of the configured rig.
    pub growth_rate: f64,
    /// The largest stable compensation level (1).
    pub level: f64,
    /// The other margins; `None` if the configured loop is unstable.
    pub around: Option<MarginsAround>,
}

/// Margins about a stable configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct MarginsAround {
    /// Stable range of the response delay (s) given to the lead network.
    pub response_delay: (f64, f64),
    /// Shortest additional delay (s), in whole samples, that makes the loop unstable. It is a delay of the
    /// compensation alone or of the whole valve command. It is infinite if up to 64 samples are stable, or as
    /// many as the model of a building can hold.
    pub dead_time: f64,
    /// Largest stable factor (1) on the force loop's gain.
    pub loop_gain: f64,
    /// Stable range of the true flow gain (1) over the configured one.
    pub flow_gain: (f64, f64),
}

/// Range in which margins are searched for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Factor (1) on the rig's compensation level.
    pub level: f64,
    /// Additional delay, s.
    pub dead_time: f64,
    /// Factor (1) on the force loop's gain.
    pub loop_gain: f64,
}

/// The largest stable compensation level (1) of the linear model: the upper end of the stable range at or
/// below the rig's own level, or else of the next one above. It is infinite if no level up to 10 is unstable,
/// as without compensation.
///
/// # Errors
/// No level makes the loop stable.
pub fn stability_margin(rig: &RigConfig, gain: FlowGain, time: Time) -> Result<f64> {
    stability_margin_up_to(rig, gain, time, f64::INFINITY)
}

/// As [`stability_margin`], but infinite if it is found to be `enough` or more, which may take one step of the search.
pub(crate) fn stability_margin_up_to(
    rig: &RigConfig,
    gain: FlowGain,
    time: Time,
    enough: f64,
) -> Result<f64> {
    let rig = &*designed_for(rig, time)?;
    if let Some(level) = stable_level_up_to(rig, gain, time, enough)? {
        return Ok(level);
    }
    let rate = growth_with(rig, gain, time, |_| ())?;
    let allowed = format!("no compensation level from 0 to {HIGHEST_LEVEL} makes the loop stable");
    Err(Error::value("growth rate", per_second(rate), allowed))
}

/// As [`stability_margin`], but `None` if no level makes the loop stable.
pub(crate) fn largest_stable_level(rig: &RigConfig, gain: FlowGain, time: Time) -> Result<Option<f64>> {
    stable_level_up_to(rig, gain, time, f64::INFINITY)
}

fn stable_level_up_to(rig: &RigConfig, gain: FlowGain, time: Time, enough: f64) -> Result<Option<f64>> {
    let growth = |level: f64| growth_with(rig, gain, time, |rig| rig.compensation.level = level);
    let own = rig.compensation.level;
    if rig.compensation.mode == Mode::Off {
        return Ok((growth(own)? <= AT_REST).then_some(f64::INFINITY));
    }
    let seek_stable = Search { smallest: 0.5, seek: Stability::Stable, enough: f64::INFINITY };
    let below = edge(own, 0.0, seek_stable, growth)?;
    let stable = match below {
        None => edge(own, HIGHEST_LEVEL, seek_stable, growth)?,
        below => below,
    };
    let Some(stable) = stable else { return Ok(None) };
    let end = edge(stable, HIGHEST_LEVEL, Search { smallest: 0.5, enough, ..UNSTABLE }, growth)?;
    Ok(Some(end.unwrap_or(f64::INFINITY)))
}

/// Every margin of the linear model.
///
/// # Errors
/// As [`stability_margin`].
pub fn stability_margins(rig: &RigConfig, gain: FlowGain, time: Time) -> Result<Margins> {
    let rig = &*designed_for(rig, time)?;
    let growth_rate = growth_with(rig, gain, time, |_| ())?;
    let level = stability_margin(rig, gain, time)?;
    let around = if growth_rate > AT_REST { None } else { Some(around(rig, gain, time)?) };
    Ok(Margins { growth_rate, level, around })
}

/// The margins within a reach, infinite beyond it, and the growth rate (1/s). An unstable configured loop has
/// no margins. The search is much faster than [`stability_margins`] if no margin lies within the reach.
///
/// # Errors
/// As [`linearize`].
pub fn margins_within(
    rig: &RigConfig,
    gain: FlowGain,
    time: Time,
    reach: Reach,
) -> Result<(f64, Option<Reach>)> {
    let rig = &*designed_for(rig, time)?;
    let growth_rate = growth_with(rig, gain, time, |_| ())?;
    if growth_rate > AT_REST {
        return Ok((growth_rate, None));
    }
    let by_level = |factor: f64| growth_with(rig, gain, time, |rig| rig.compensation.level *= factor);
    let level = edge(1.0, reach.level.max(1.0), UNSTABLE, by_level)?;
    let found = Reach {
        level: level.unwrap_or(f64::INFINITY),
        dead_time: dead_time(rig, gain, time, reach.dead_time)?,
        loop_gain: loop_gain(rig, gain, time, reach.loop_gain)?,
    };
    Ok((growth_rate, Some(found)))
}

/// The rig before a setting is varied, with its designed force loop fixed.
pub(crate) fn designed_for(rig: &RigConfig, time: Time) -> Result<Cow<'_, RigConfig>> {
    match time {
        Time::Continuous => Ok(Cow::Borrowed(rig)),
        Time::Sampled(rate) => rig.at_rate(rate),
    }
}

fn around(rig: &RigConfig, gain: FlowGain, time: Time) -> Result<MarginsAround> {
    let set = rig.compensation.response_delay;
    let by_delay = |delay: f64| growth_with(rig, gain, time, |rig| rig.compensation.response_delay = delay);
    let by_flow = |factor: f64| growth_with(rig, gain, time, |rig| rig.servovalve.flow_gain_scale *= factor);
    let unstable = |smallest| Search { smallest, ..UNSTABLE };
    let response_delay = match rig.compensation.mode {
        Mode::Off => (0.0, f64::INFINITY),
        _ => (
            edge(set, 0.0, unstable(1e-3), by_delay)?.unwrap_or(0.0),
            edge(set, LONGEST_RESPONSE_DELAY, unstable(1e-3), by_delay)?.unwrap_or(f64::INFINITY),
        ),
    };
    Ok(MarginsAround {
        response_delay,
        dead_time: dead_time(rig, gain, time, f64::INFINITY)?,
        loop_gain: loop_gain(rig, gain, time, LARGEST_FACTOR)?,
        flow_gain: (
            edge(1.0, SMALLEST_FACTOR, unstable(0.1), by_flow)?.unwrap_or(0.0),
            edge(1.0, LARGEST_FACTOR, unstable(1.0), by_flow)?.unwrap_or(f64::INFINITY),
        ),
    })
}

/// The largest stable factor on the force loop's gain, up to `most`.
fn loop_gain(rig: &RigConfig, gain: FlowGain, time: Time, most: f64) -> Result<f64> {
    let by_loop =
        |factor: f64| growth_with(rig, gain, time, |rig| rig.controller.force_sensitivity *= factor);
    Ok(edge(1.0, most.max(1.0), UNSTABLE, by_loop)?.unwrap_or(f64::INFINITY))
}

/// The shortest unstable delay up to `most` (s). For continuous time the loop sampled at the rig's own rate
/// is used, because a delay has no finite continuous model.
fn dead_time(rig: &RigConfig, gain: FlowGain, time: Time, most: f64) -> Result<f64> {
    let rate = match time {
        Time::Continuous => rig.controller.sample_rate,
        Time::Sampled(rate) => rate,
    };
    let time = Time::Sampled(rate);
    // In the analog realization only the compensation is sampled.
    if rig.compensation.mode == Mode::Off && rig.controller.realization == Realization::Analog {
        return Ok(f64::INFINITY);
    }
    // Each sample of delay adds one state per actuator.
    let now = linearize(rig, gain, time)?;
    let room = (MOST_STATES - now.states.len()) / now.inputs.len();
    for more in (0..=MOST_SAMPLES).take(room + 1).take_while(|more| f64::from(*more) <= most * rate) {
        let compensation = growth_with(rig, gain, time, |rig| rig.compensation.computation_delay += more)?;
        let whole = growth_with(rig, gain, time, |rig| rig.dac.delay += more)?;
        if compensation.max(whole) > AT_REST {
            return Ok(f64::from(more) / rate);
        }
    }
    Ok(f64::INFINITY)
}

fn growth_with(rig: &RigConfig, gain: FlowGain, time: Time, change: impl Fn(&mut RigValues)) -> Result<f64> {
    linearize(&rig.varied(change), gain, time)?.growth_rate()
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stability {
    Stable,
    Unstable,
}

/// The stability that [`edge`] searches for, the value below which its steps get no shorter, and the value from which on
/// it need not search.
#[derive(Debug, Clone, Copy)]
struct Search {
    smallest: f64,
    seek: Stability,
    enough: f64,
}

/// Towards an unstable factor, from 1.
const UNSTABLE: Search = Search { smallest: 1.0, seek: Stability::Unstable, enough: f64::INFINITY };

/// The stable end of the first change to the sought stability from `from` to `to`, to a relative distance of
/// [`RESOLUTION`]; `None` if there is no change.
fn edge(from: f64, to: f64, search: Search, growth: impl Fn(f64) -> Result<f64>) -> Result<Option<f64>> {
    // Negative at the values that are sought.
    let sign = if search.seek == Stability::Stable { 1.0 } else { -1.0 };
    let excess = |value: f64| -> Result<f64> { Ok(sign * (growth(value)? - AT_REST)) };
    let found = |excess: f64| if sign > 0.0 { excess <= 0.0 } else { excess < 0.0 };
    let mut before = (from, excess(from)?);
    let mut here = before;
    while !found(here.1) {
        if here.0 == to || here.0 >= search.enough {
            return Ok(None);
        }
        before = here;
        let step = STEP * here.0.max(search.smallest);
        let next = if to > from { (here.0 + step).min(to) } else { (here.0 - step).max(to) };
        here = (next, excess(next)?);
    }
    let mut widest = (here.0 - before.0).abs();
    loop {
        let width = here.0 - before.0;
        let middle = before.0 + 0.5 * width;
        if width.abs() <= RESOLUTION * here.0.abs() || middle == before.0 || middle == here.0 {
            return Ok(Some(if sign > 0.0 { here.0 } else { before.0 }));
        }
        // The secant, moved a little towards the middle so that both ends come near. It is the middle itself
        // where the last two steps did not halve the interval.
        let secant = before.0 + width * (before.1 / (before.1 - here.1));
        let moved = secant + 0.01 * (middle - secant);
        let next = if width.abs() > widest || !moved.is_finite() { middle } else { moved };
        widest = 0.5 * width.abs();
        let excess = excess(next)?;
        if found(excess) { here = (next, excess) } else { before = (next, excess) }
    }
}

#[cfg(test)]
mod tests;
