//! The whole tick of one actuator, in the order that safety needs: velocity, protection of the command, controller,
//! protection of the output. The tick also adds up the learner's window.

mod between_ticks;
mod control;
mod lanes;
mod state;
#[cfg(test)]
mod tests;
mod trusted_signals;

pub use lanes::{ChannelLanes, ChannelLanesState};
pub use state::ChannelState;

use core::mem::MaybeUninit;

use crate::checksum::word;
use crate::controller::{Controller, gap};
use crate::error::{ConfigError, LARGEST, check, within};
use crate::integrity::integrity;
use crate::learning::{LOWEST_RATE, window_ticks};
use crate::number::Real;
use crate::parameters::{Parameters, ProtectionParameters, Realization, VelocitySource};
use crate::protection::{NEVER, Plausibility, Protection, StuckWatch, samples};
use crate::signals::{Input, Output};
use crate::status;
use crate::velocity::Velocity;
use state::TrustedSignals;

/// A channel's immutable configuration; one drives any number of actuators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel<T: Real, const N: usize> {
    controller: Controller<T, N>,
    velocity: Velocity<T>,
    protection: Option<Protection<T>>,
    plausibility: Option<Plausibility<T, N>>,
    stuck: Option<StuckWatch>,
    /// After more lost ticks than this the channel resumes at the new operating point.
    gap_ticks: u32,
    /// Whether there are windows for a learner.
    learns: bool,
    /// Ticks of a window, also if nothing is learned.
    window_ticks: u32,
    /// A calibration expires after this many windows.
    age_limit: u32,
    realization: Realization,
    /// Whether the feedforward uses the next tick's command.
    looks_ahead: bool,
    /// Whether it has none of the [`Parts`].
    plain: bool,
}
integrity!(
    Channel<T, N>: controller, velocity, protection, plausibility, stuck, gap_ticks, learns, window_ticks, age_limit,
    realization, looks_ahead, plain
);

/// The optional parts of a channel, apart from controller and learner.
#[derive(Clone, Copy)]
struct Parts<'a, T: Real, const N: usize> {
    velocity: &'a Velocity<T>,
    protection: Option<&'a Protection<T>>,
    plausibility: Option<&'a Plausibility<T, N>>,
    stuck: Option<&'a StuckWatch>,
    realization: Realization,
    measures_supply: bool,
    looks_ahead: bool,
    integrates: bool,
    has_friction: bool,
    has_overlap: bool,
}

impl<T: Real, const N: usize> Parts<'_, T, N> {
    /// A measured velocity, a force loop of its own without an integral part, and nothing else.
    const NONE: Self = Self {
        velocity: &Velocity::Sensor,
        protection: None,
        plausibility: None,
        stuck: None,
        realization: Realization::Digital,
        measures_supply: false,
        looks_ahead: false,
        integrates: false,
        has_friction: false,
        has_overlap: false,
    };
}

/// Shortest age limit of a calibration (s). A calibration that is published in time is younger.
const SHORTEST_AGE_LIMIT: f64 = 0.02;

/// A calibration expires after this many windows; [`NEVER`] for no limit.
const fn age_limit(p: &Parameters) -> Result<u32, ConfigError> {
    if !p.learning.is_on() {
        return Ok(NEVER);
    }
    let limit = check!(within("age_limit", p.learning.age_limit, SHORTEST_AGE_LIMIT, f64::MAX));
    let ticks = check!(samples("age_limit", limit, p.sample_rate));
    Ok(if ticks == NEVER { NEVER } else { ticks / window_ticks(p.sample_rate) })
}

/// Whether an estimate of the velocity can start from a displacement (m).
#[inline(always)]
fn is_valid<T: Real>(displacement: T) -> bool {
    displacement.abs() <= T::splat(LARGEST)
}

/// Starts an estimate of the velocity from a valid displacement, or resumes it after a gap.
#[cold]
#[inline(never)]
fn resume<T: Real>(velocity: &Velocity<T>, state: &mut ChannelState<T>, input: &Input<T>) {
    let gap = Some(state.velocity_gap).filter(|gap| *gap != NEVER);
    state.velocity = velocity.resumed(&state.velocity, input, gap);
    state.velocity_gap = 0;
}

/// Lets an estimate of the velocity go over a short gap before a valid displacement.
#[cold]
#[inline(never)]
fn bridge<T: Real>(velocity: &Velocity<T>, state: &mut ChannelState<T>, input: &Input<T>) {
    velocity.bridge(&mut state.velocity, input.displacement, T::from_u32(state.velocity_gap));
    state.velocity_gap = 0;
}

/// Whether a channel has none of the [`Parts`].
const fn is_plain(p: &Parameters) -> bool {
    matches!(
        p,
        Parameters {
            realization: Realization::Digital,
            velocity_source: VelocitySource::Sensor,
            protection: None,
            stuck_samples: 0,
            supply_correction: false,
            ..
        }
    ) && !(p.feedforward && p.look_ahead)
        && p.integral_gain == 0.0
        && p.friction == 0.0
        && p.overlap == 0.0
}

impl<T: Real, const N: usize> Channel<T, N> {
    /// One tick.
    ///
    /// # NaN
    /// An invalid supply pressure is replaced by the last valid one, and [`status::STUCK_MEASUREMENT`] is raised. An
    /// invalid next command is replaced likewise, and [`status::INVALID_COMMAND`] is raised if the channel looks ahead.
    /// With another invalid measurement or an invalid command (not finite, or beyond its range) the last output is
    /// held, the controller's state stays and [`status::INVALID_COMMAND`] or [`status::INVALID_MEASUREMENT`] is raised;
    /// the first good tick recovers. After more than [`gap_time`](Parameters::gap_time) of such ticks it resumes at the
    /// new operating point. The change since the last good tick then does not count as that of one tick. After a trip a
    /// plausibility watch replaces a lost measurement by its last one, and this flag is not raised.
    ///
    /// # Cost
    /// Independent of history. The page on the loop's budget lists the instructions.
    // Each unit test would otherwise contain the whole tick.
    #[cfg_attr(not(test), inline(always))]
    pub fn step(&self, state: &mut ChannelState<T>, input: &Input<T>) -> Output<T> {
        self.step_via(state, input, |compensation| compensation)
    }

    /// Like [`step`](Self::step), with the compensation signal (V) passed through `path` before the force loop, for
    /// example through a simulated computation delay.
    #[inline(always)]
    pub fn step_via(
        &self,
        state: &mut ChannelState<T>,
        input: &Input<T>,
        path: impl FnOnce(T) -> T,
    ) -> Output<T> {
        // A plain channel has a second copy of the tick, without the checks for optional parts.
        if self.plain {
            self.tick(Parts::NONE, state, input, path)
        } else {
            self.tick(self.parts(), state, input, path)
        }
    }

    #[inline(always)]
    fn tick(
        &self,
        parts: Parts<'_, T, N>,
        state: &mut ChannelState<T>,
        input: &Input<T>,
        path: impl FnOnce(T) -> T,
    ) -> Output<T> {
        if self.learns && state.ticks_left == 0 {
            state.begin_window(self.window_ticks);
        }
        let gated_input;
        let input = match parts.plausibility {
            Some(watch) => {
                gated_input = watch.gate(&mut state.plausibility, input);
                &gated_input
            }
            None => input,
        };
        let velocity = self.velocity(parts, state, input);
        let stuck = match parts.stuck {
            Some(watch) => watch.step(&mut state.stuck, velocity, input.force, input.spool),
            None => 0,
        };
        let mut trusted = TrustedSignals {
            command: input.command,
            force: input.force,
            displacement: input.displacement,
            velocity,
            spool: input.spool,
            status: 0,
        };
        if let Some(watch) = parts.plausibility {
            trusted = self.select_trusted(watch, state, input, trusted);
        }
        let authority = self.limit_command(parts, state, input, &mut trusted);
        let out = self.control(parts, state, input, velocity, &trusted, path);
        let status = out.status | state.in_use.flags | stuck;
        let mut voltage = out.valve_command;
        if let Some(p) = parts.protection {
            // The loop goes on with the last valid supply pressure, so a failed transducer is only flagged.
            let faults = out.status & !status::STUCK_MEASUREMENT | state.in_use.flags | stuck;
            p.watch(&mut state.protection, faults);
            if parts.realization == Realization::Digital {
                voltage = self.closing(state, voltage, authority);
            }
        }
        let mut window = None;
        if self.learns {
            state.ticks_left -= 1;
            if state.ticks_left == 0 {
                window = Some(state.end_window());
            }
        }
        // The last next command replaces a lost one, so this does not count as a refused sample.
        let lost = parts.looks_ahead && !(input.next_command.abs() <= T::splat(LARGEST));
        Output {
            voltage,
            compensation: out.compensation,
            velocity,
            permitted_command: trusted.command,
            authority,
            status: status | trusted.status | if lost { status::INVALID_COMMAND } else { 0 },
            window,
        }
    }

    /// The velocity of this tick. At the start and after a gap an estimate starts from the displacement.
    #[inline(always)]
    fn velocity(&self, parts: Parts<'_, T, N>, state: &mut ChannelState<T>, input: &Input<T>) -> T {
        let estimates = !matches!(parts.velocity, Velocity::Sensor);
        if estimates && state.velocity_gap > 0 && is_valid(input.displacement) {
            if state.velocity_gap >= self.gap_ticks {
                resume(parts.velocity, state, input);
            } else {
                bridge(parts.velocity, state, input);
            }
        }
        parts.velocity.step(&mut state.velocity, input)
    }

    const fn parts(&self) -> Parts<'_, T, N> {
        Parts {
            velocity: &self.velocity,
            protection: self.protection.as_ref(),
            plausibility: self.plausibility.as_ref(),
            stuck: self.stuck.as_ref(),
            realization: self.realization,
            measures_supply: self.controller.measures_supply,
            looks_ahead: self.looks_ahead,
            integrates: self.controller.integrates(),
            has_friction: self.controller.friction.is_present(),
            has_overlap: self.controller.has_overlap(),
        }
    }

    /// The command (N) that the protection will permit at the next tick, if nothing new happens.
    #[inline(always)]
    pub fn preview(&self, state: &ChannelState<T>, next_command: T) -> T {
        match &self.protection {
            Some(p) => p.preview(&state.protection, next_command),
            None => next_command,
        }
    }

    /// A checksum of every number of the configuration. A different checksum means that memory has changed.
    ///
    /// # Cost
    /// Not for the tick: a rotation, an exclusive or and a multiplication for each number.
    pub fn integrity(&self) -> u32 {
        word(self)
    }

    /// Ticks of a window; 0 if nothing is learned.
    pub const fn window_ticks(&self) -> u32 {
        if self.learns { self.window_ticks } else { 0 }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> Channel<$t, N> {
            /// From the rig's parameters; its tables hold up to `N` points.
            ///
            /// # Errors
            /// A parameter that is not finite or out of its range, by name; a sample rate below 200 Hz if something is
            /// learned. In a `const` each is a compile error.
            pub const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                let mut channel = Self::EMPTY;
                check!(channel.fill(p));
                Ok(channel)
            }

            /// As [`new`](Self::new), in a given place: the stack holds no channel.
            ///
            /// # Errors
            /// Those of [`new`](Self::new).
            pub fn make_in<'a>(
                place: &'a mut MaybeUninit<Self>,
                p: &Parameters,
            ) -> Result<&'a mut Self, ConfigError> {
                let channel = place.write(Self::EMPTY);
                channel.fill(p)?;
                Ok(channel)
            }

            const EMPTY: Self = Self {
                controller: Controller::<$t, N>::EMPTY,
                velocity: Velocity::Sensor,
                protection: None,
                plausibility: None,
                stuck: None,
                gap_ticks: 0,
                learns: false,
                window_ticks: 0,
                age_limit: 0,
                realization: Realization::Digital,
                looks_ahead: false,
                plain: false,
            };

            /// Makes one part after the other in place, so that the stack holds only one of them.
            const fn fill(&mut self, p: &Parameters) -> Result<(), ConfigError> {
                if p.learning.is_on() {
                    check!(within("sample_rate", p.sample_rate, LOWEST_RATE, LARGEST));
                }
                check!(self.controller.fill(p));
                self.velocity = check!(Velocity::<$t>::new(p));
                if let Some(protection) = &p.protection {
                    check!(self.protect(protection, p.sample_rate));
                    if let Some(watch) = &protection.plausibility {
                        check!(Plausibility::<$t, N>::make_in(&mut self.plausibility, p, protection, watch));
                    }
                }
                if p.stuck_samples > 0 {
                    self.stuck = Some(check!(StuckWatch::new(p.stuck_samples)));
                }
                self.gap_ticks = check!(gap(p));
                self.learns = p.learning.is_on();
                self.window_ticks = window_ticks(p.sample_rate);
                self.age_limit = check!(age_limit(p));
                self.realization = p.realization;
                self.looks_ahead = p.feedforward && p.look_ahead;
                self.plain = is_plain(p);
                Ok(())
            }

            /// A separate function, so that its stack is free again when the next part is made.
            #[inline(never)]
            const fn protect(
                &mut self,
                p: &ProtectionParameters,
                sample_rate: f64,
            ) -> Result<(), ConfigError> {
                self.protection = Some(check!(Protection::<$t>::new(p, sample_rate)));
                Ok(())
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
