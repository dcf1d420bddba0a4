//! The whole tick of one actuator, in the order that safety needs: velocity, protection of the command, controller,
//! protection of the output; and behind the output the sums that the learner lives from.

use core::borrow::Borrow;

use crate::compensation::Calibration;
use crate::controller::{Controller, ControllerInput, ControllerState};
use crate::error::{ConfigError, LARGEST, check, within};
use crate::learning::{LOWEST_RATE, Moment, Window, window_ticks};
use crate::number::Real;
use crate::parameters::{Parameters, Realization};
use crate::protection::{
    Cause, DISPLACEMENT, FORCE, Known, Plausibility, PlausibilityState, Protection, ProtectionParameters,
    ProtectionState, SPOOL, StuckWatch, StuckWatchState, VELOCITY,
};
use crate::status;
use crate::velocity::{Velocity, VelocityState};

/// A channel's immutable configuration; one drives any number of actuators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel<T: Real, const N: usize> {
    controller: Controller<T, N>,
    velocity: Velocity<T>,
    protection: Option<Protection<T>>,
    plausibility: Option<Plausibility<T, N>>,
    stuck: Option<StuckWatch>,
    /// Ticks of a window; 0 where nothing is learned.
    window_ticks: u32,
    realization: Realization,
    /// Whether the feedforward is given the next tick's command.
    looks_ahead: bool,
}

/// One tick's command and measurements, in SI units. What is not given is NaN: nothing looks at it, or the tick is
/// flagged.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Input<T> {
    /// Force command (N).
    pub command: T,
    /// Piston velocity (m/s); looked at where a sensor measures it.
    pub velocity: T,
    /// Force (N).
    pub force: T,
    /// Spool opening (1).
    pub spool: T,
    /// Displacement (m); looked at by a protection, and where the velocity is made of it.
    pub displacement: T,
    /// Acceleration (m/s²); looked at by an observer that reads an accelerometer.
    pub acceleration: T,
    /// Supply pressure (Pa); looked at where its departures are corrected.
    pub supply_pressure: T,
    /// Force command (N) of the next tick; looked at where the feedforward looks ahead.
    pub next_command: T,
    /// Valve command (V) that stood when the others were sampled; looked at by a learner where an analog controller
    /// closes the force loop. Where it is lost nothing is learned.
    pub valve_command: T,
}

impl<T: Real> Default for Input<T> {
    fn default() -> Self {
        let none = T::splat(f64::NAN);
        Self {
            command: none,
            velocity: none,
            force: none,
            spool: none,
            displacement: none,
            acceleration: none,
            supply_pressure: none,
            next_command: none,
            valve_command: none,
        }
    }
}

/// One tick's result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output<T: Real> {
    /// What goes to the converter (V): the valve command, or the compensation signal for an analog controller.
    pub voltage: T,
    /// The compensation signal `v_c` (V).
    pub compensation: T,
    /// Velocity (m/s) that was measured or estimated.
    pub velocity: T,
    /// The force command (N) that the protection lets be followed: an analog controller's.
    pub permitted_command: T,
    /// Factor (1) that the protection puts on the valve command: in `voltage` already, but for an analog controller.
    pub authority: T,
    /// Bits of [`status`].
    pub status: u32,
    /// The window that closes with this tick, for the learner.
    pub window: Option<Window<T>>,
}

/// What of a tick's measurements the controller and the levels go by.
#[derive(Debug, Clone, Copy)]
struct Believed<T> {
    force: T,
    displacement: T,
    velocity: T,
    spool: T,
    status: u32,
}

/// What a channel remembers; made by [`Channel::at_rest`] or [`Channel::prime`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct ChannelState<T: Real> {
    controller: ControllerState<T>,
    velocity: VelocityState<T>,
    protection: ProtectionState<T>,
    plausibility: PlausibilityState<T>,
    /// Ticks of the window so far; behind the last one all of them, until the next begins.
    ticks: u32,
    window: Window<T>,
    /// Whether the second of the calibrations is in use, and whether it is the latest.
    second: bool,
    second_is_latest: bool,
    /// Flags of the calibration in use, and of the next one as far as it is known.
    flags: u32,
    next_flags: u32,
    calibrations: [Calibration<T>; 2],
    stuck: StuckWatchState<T>,
}

impl<T: Real, const N: usize> Channel<T, N> {
    /// A rig at rest, nothing learned yet.
    pub fn at_rest(&self) -> ChannelState<T> {
        ChannelState {
            controller: ControllerState::default(),
            velocity: VelocityState::default(),
            protection: ProtectionState::default(),
            plausibility: PlausibilityState::default(),
            ticks: 0,
            window: Window::first(0),
            second: false,
            second_is_latest: false,
            flags: 0,
            next_flags: 0,
            calibrations: [self.controller.nominal(); 2],
            stuck: StuckWatchState::default(),
        }
    }

    /// One tick.
    ///
    /// # NaN
    /// With an invalid measurement or command (not finite, or beyond its range) the last output is held, the state stays
    /// and [`status::INVALID_COMMAND`] or [`status::INVALID_MEASUREMENT`] is raised; the first good tick recovers.
    ///
    /// # Cost
    /// Independent of history; the budgets stand in the documentation of the loop's budget.
    #[inline(always)]
    pub fn step(&self, state: &mut ChannelState<T>, input: &Input<T>) -> Output<T> {
        self.step_via(state, input, |compensation| compensation)
    }

    /// As [`step`](Self::step), with the compensation signal (V) passed through `path` on its way to the force loop: a
    /// simulated computation delay, for example.
    #[inline(always)]
    pub fn step_via(
        &self,
        state: &mut ChannelState<T>,
        input: &Input<T>,
        path: impl FnOnce(T) -> T,
    ) -> Output<T> {
        let learns = self.window_ticks > 0;
        if learns && state.ticks == self.window_ticks {
            state.begin_window();
        }
        let gated;
        let input = match &self.plausibility {
            Some(watch) => {
                gated = watch.gate(&mut state.plausibility, input);
                &gated
            }
            None => input,
        };
        let velocity = self.velocity.step(&mut state.velocity, input);
        let stuck = match &self.stuck {
            Some(watch) => watch.step(&mut state.stuck, velocity, input.force, input.spool),
            None => 0,
        };
        let mut believed = Believed {
            force: input.force,
            displacement: input.displacement,
            velocity,
            spool: input.spool,
            status: 0,
        };
        if let Some(watch) = &self.plausibility {
            believed = self.believe(watch, state, input, believed);
        }
        let (mut command, mut authority, mut protection) = (input.command, T::splat(1.0), believed.status);
        if let Some(p) = &self.protection {
            let Believed { force, displacement, velocity, spool, .. } = believed;
            let protected = p.step(&mut state.protection, command, force, displacement, velocity, spool);
            (command, authority, protection) =
                (protected.command, protected.authority, protection | protected.status);
            if self.plausibility.is_some() {
                believed.velocity = believed.velocity * protected.level;
                if protected.open {
                    // Without an error the loop is open; the oil's spring is left to leakage.
                    believed.force = command;
                    protection |= status::FORCE_LOOP_OPEN;
                }
            }
        }
        let asked = ControllerInput {
            command,
            next_command: if self.looks_ahead { self.preview(state, input.next_command) } else { command },
            velocity: believed.velocity,
            force: believed.force,
            spool: believed.spool,
            supply_pressure: input.supply_pressure,
        };
        let stood = state.controller.valve_command();
        let supply = self.controller.supply(&asked);
        let out = if self.controller.accepts(&asked) & supply.valid {
            let calibration = pick(&state.calibrations, state.second);
            let out = self.controller.follow(&mut state.controller, &asked, supply, true, calibration, path);
            if learns && self.plausibility.is_some() && state.protection.is_tripped() {
                state.window.lose();
            } else if learns {
                // Behind the output: what the learner lives from.
                state.window.add(velocity, asked.spool, Moment { force: asked.force, command });
                if self.controller.measures_supply {
                    state.window.supply = supply.ratio;
                }
                match self.realization {
                    Realization::Digital => state.window.add_command(stood),
                    Realization::Analog => state.window.add_sampled_command(input.valve_command, asked.spool),
                }
            }
            out
        } else {
            if learns {
                state.window.lose();
            }
            self.controller.refuse(&mut state.controller, &asked, supply, path)
        };
        let status = out.status | state.flags | stuck;
        let mut voltage = out.valve_command;
        if let Some(p) = &self.protection {
            p.watch(&mut state.protection, status);
            if self.realization == Realization::Digital {
                voltage = voltage * authority;
            }
        }
        let mut window = None;
        if learns {
            state.ticks += 1;
            if state.ticks == self.window_ticks {
                window = Some(state.window);
            }
        }
        Output {
            voltage,
            compensation: out.compensation,
            velocity,
            permitted_command: command,
            authority,
            status: status | protection,
            window,
        }
    }

    /// What of the measurements is believed, and what stands in for the rest.
    #[inline(always)]
    fn believe(
        &self,
        watch: &Plausibility<T, N>,
        state: &mut ChannelState<T>,
        input: &Input<T>,
        mut believed: Believed<T>,
    ) -> Believed<T> {
        let calibration = pick(&state.calibrations, state.second);
        let supply = self.controller.supply_of(input.supply_pressure);
        let known = Known {
            command: input.command,
            valve_command: match self.realization {
                Realization::Digital => state.controller.valve_command(),
                Realization::Analog => input.valve_command,
            },
            flow_gain: calibration.flow_gain,
            valve_gain: calibration.valve_gain,
            supply,
        };
        let cause = watch.judge(&mut state.plausibility, input, believed.velocity, &known);
        state.plausibility.distrust(cause);
        match cause {
            Cause::ForceLost | Cause::ForceImplausible => state.protection.shut_down_by(cause),
            cause => state.protection.trip_by(cause),
        }
        let distrusted = state.plausibility.distrusted();
        let flags = [
            (FORCE, status::FORCE_DISTRUSTED),
            (DISPLACEMENT, status::DISPLACEMENT_DISTRUSTED),
            (VELOCITY, status::VELOCITY_DISTRUSTED),
            (SPOOL, status::SPOOL_DISTRUSTED),
        ];
        let doubted = |signal: usize| distrusted.get(signal).copied().unwrap_or(false);
        for (signal, flag) in flags {
            believed.status |= if doubted(signal) { flag } else { 0 };
        }
        let zero = T::splat(0.0);
        if doubted(FORCE) {
            believed.force = zero;
        }
        if doubted(DISPLACEMENT) {
            believed.displacement = zero;
        }
        if doubted(SPOOL) {
            believed.spool = state.plausibility.spool();
        }
        let estimated = !matches!(self.velocity, Velocity::Sensor);
        if doubted(DISPLACEMENT) && (doubted(VELOCITY) || estimated) {
            // Nothing is left to follow: the valve closes from where it stands.
            state.protection.shut_down_by(cause);
            state.protection.blind();
            believed.velocity = T::splat(f64::NAN);
        } else if doubted(VELOCITY) {
            believed.velocity = state.plausibility.velocity();
        }
        if state.plausibility.force_jumped() {
            believed.status |= status::FORCE_LOOP_OPEN;
        }
        believed
    }

    /// Gives a calibration to the tick, in the tick's context and between two of them: the one made of window k takes
    /// effect at the first tick of window k + 2. One that comes later takes effect at the next window's start; until
    /// the learner has caught up every tick raises [`status::CALIBRATION_LATE`].
    ///
    /// # Cost
    /// A copy of the calibration.
    #[inline(always)]
    pub fn publish(&self, state: &mut ChannelState<T>, calibration: impl Borrow<Calibration<T>>) {
        let calibration: &Calibration<T> = calibration.borrow();
        // Of the window that has just closed, while the one before it still waits: that one's time has come.
        if state.ticks == self.window_ticks && calibration.window == state.window.number {
            state.begin_window();
        }
        let [first, second] = &mut state.calibrations;
        *(if state.second { first } else { second }) = *calibration;
        state.second_is_latest = !state.second;
        let late = state.window.number.wrapping_sub(calibration.window) > 1;
        state.next_flags = calibration.status | if late { status::CALIBRATION_LATE } else { 0 };
    }

    /// Repeats the last output and raises [`status::HELD`]; the state stays. For several ticks give [`step`](Self::step)
    /// a measurement that is NaN instead, so that nothing is learned of the gap.
    pub fn hold(&self, state: &ChannelState<T>) -> Output<T> {
        let out = self.controller.hold(&state.controller);
        let authority = match &self.protection {
            Some(p) => p.authority(&state.protection),
            None => T::splat(1.0),
        };
        let digital = self.realization == Realization::Digital;
        Output {
            voltage: if digital { out.valve_command * authority } else { out.valve_command },
            compensation: out.compensation,
            velocity: T::splat(f64::NAN),
            permitted_command: T::splat(f64::NAN),
            authority,
            status: out.status,
            window: None,
        }
    }

    /// Goes to the state of a rig that has long been at this operating point: the next [`step`](Self::step) with the same
    /// input has no bump. What was learned stays in use, the protection goes on where it is, and a window begins. A
    /// velocity that is estimated is that of a displacement at rest. An invalid input gives the state of a rig at rest.
    pub fn prime(&self, state: &mut ChannelState<T>, input: &Input<T>) {
        let velocity;
        (state.velocity, velocity) = self.velocity.prime(input);
        let asked = ControllerInput {
            command: input.command,
            next_command: input.next_command,
            velocity,
            force: input.force,
            spool: input.spool,
            supply_pressure: input.supply_pressure,
        };
        state.controller = self.controller.prime(&asked, state.calibration());
        state.stuck = StuckWatchState::default();
        if self.window_ticks > 0 && state.ticks == self.window_ticks {
            state.begin_window();
        }
        (state.ticks, state.window) = (0, Window::first(state.window.number));
    }

    /// Goes on from a state under another configuration of the same sample rate, without a bump: where nothing is
    /// learned this configuration's calibration holds at once, else the one in use stays until its learner publishes.
    pub fn take_over(&self, state: &mut ChannelState<T>) {
        if self.window_ticks == 0 {
            let ChannelState { controller, velocity, protection, plausibility, stuck, .. } = *state;
            *state = ChannelState { controller, velocity, protection, plausibility, stuck, ..self.at_rest() };
        }
    }

    /// What the protection will make of the next tick's command (N) if nothing new happens.
    #[inline(always)]
    pub fn preview(&self, state: &ChannelState<T>, next_command: T) -> T {
        match &self.protection {
            Some(p) => p.preview(&state.protection, next_command),
            None => next_command,
        }
    }

    /// Ticks of a window; 0 where nothing is learned.
    pub const fn window_ticks(&self) -> u32 {
        self.window_ticks
    }
}

impl<T: Real> ChannelState<T> {
    /// The calibration in use.
    pub fn calibration(&self) -> &Calibration<T> {
        pick(&self.calibrations, self.second)
    }

    /// Trips the protection from outside, at the last command: an emergency stop, or another actuator of the same
    /// specimen.
    pub fn trip(&mut self) {
        self.protection.trip();
    }

    /// Asks the protection for the soft end: the command, still followed, fades along the ramp.
    pub fn end(&mut self) {
        self.protection.end();
    }

    /// What tripped the protection first.
    pub fn cause(&self) -> Cause {
        self.protection.cause()
    }

    /// Whether the protection's ramp has reached zero.
    pub fn is_down(&self) -> bool {
        self.protection.is_down()
    }

    /// The first tick of a window: what was published takes effect.
    #[inline(always)]
    fn begin_window(&mut self) {
        self.ticks = 0;
        self.window.go_on();
        self.second = self.second_is_latest;
        self.flags = self.next_flags;
        // For the window after this one, if none comes until then.
        self.next_flags |= status::CALIBRATION_LATE;
    }
}

#[inline(always)]
fn pick<C>(of: &[C; 2], second: bool) -> &C {
    let [first, _] = of;
    of.get(usize::from(second)).unwrap_or(first)
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> Channel<$t, N> {
            /// From the rig's parameters; its tables hold up to `N` points.
            ///
            /// # Errors
            /// A parameter that is not finite or out of its range, by name; a sample rate below 200 Hz where something
            /// is learned. In a `const` each is a compile error.
            pub const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                if p.learning.is_on() {
                    check!(within("sample_rate", p.sample_rate, LOWEST_RATE, LARGEST));
                }
                Ok(Self {
                    controller: check!(Controller::<$t, N>::new(p)),
                    velocity: check!(Velocity::<$t>::new(p)),
                    protection: match &p.protection {
                        Some(protection) => Some(check!(Protection::<$t>::new(protection, p.sample_rate))),
                        None => None,
                    },
                    plausibility: match &p.protection {
                        Some(protection @ ProtectionParameters { plausibility: Some(watch), .. }) => {
                            Some(check!(Plausibility::<$t, N>::new(p, protection, watch)))
                        }
                        _ => None,
                    },
                    stuck: match p.stuck_samples {
                        0 => None,
                        samples => Some(check!(StuckWatch::new(samples))),
                    },
                    window_ticks: if p.learning.is_on() { window_ticks(p.sample_rate) } else { 0 },
                    realization: p.realization,
                    looks_ahead: p.feedforward && p.look_ahead,
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "bits are compared on purpose")]
mod tests {
    use super::*;
    use crate::learning::Learner;
    use crate::parameters::Learning;
    use crate::protection::ProtectionParameters;

    const RIG: Parameters =
        Parameters { protection: Some(ProtectionParameters::DEFAULT), ..Parameters::ZHAO2005 };

    fn swing(tick: u32) -> Input<f64> {
        let x = libm::sin(0.01 * f64::from(tick));
        Input { command: 3e3 * x, velocity: 0.2 * x, force: 2.9e3 * x, spool: 0.15 * x, ..Input::default() }
    }

    #[test]
    fn a_state_goes_on_under_another_configuration() {
        let first = Channel::<f64, 21>::new(&RIG).unwrap();
        let second = Parameters { response_delay: 3.0e-3, valve_gain: 0.12, ..RIG };
        let second = Channel::<f64, 21>::new(&second).unwrap();
        let (mut state, mut expected) = (first.at_rest(), second.at_rest());
        state.trip();
        expected.trip();
        for tick in 0..1000 {
            first.step(&mut state, &swing(tick));
            second.step(&mut expected, &swing(tick));
        }
        second.take_over(&mut state);
        assert_eq!(state.calibration(), expected.calibration());
        // The lead network forgets what it did before in a few hundred ticks; the trip stays.
        for tick in 1000..2000 {
            let (out, like) =
                (second.step(&mut state, &swing(tick)), second.step(&mut expected, &swing(tick)));
            assert!((out.voltage - like.voltage).abs() < 0.1 * 0.9_f64.powi((tick - 1000) as i32) + 1e-12);
            assert_ne!(out.status & status::TRIPPED, 0);
        }
    }

    #[test]
    fn what_was_learned_stays_under_another_configuration() {
        let learning = Parameters { learning: Learning::ADAPTIVE, ..RIG };
        let channel = Channel::<f64, 21>::new(&learning).unwrap();
        let mut state = channel.at_rest();
        let found = Calibration { flow_gain: 1.1, window: 0, ..*state.calibration() };
        for tick in 0..=2 * channel.window_ticks() {
            let out = channel.step(&mut state, &swing(tick));
            if out.window.is_some_and(|window| window.number == 0) {
                channel.publish(&mut state, found);
            }
        }
        let before = state;
        Channel::<f64, 21>::new(&Parameters { level: 0.9, ..learning }).unwrap().take_over(&mut state);
        assert_eq!((state, state.calibration()), (before, &found));
    }

    #[test]
    fn window_numbers_wrap() {
        let learning = Parameters { feedforward: true, learning: Learning::ADAPTIVE, ..RIG };
        let channel = Channel::<f64, 21>::new(&learning).unwrap();
        let learner = Learner::<f64, 21>::new(&learning).unwrap();
        let run = |first: u32| {
            let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
            state.window.number = first;
            let mut sum = 0.0;
            for tick in 0..8000 {
                let x = libm::sin(0.0015 * f64::from(tick));
                let input =
                    Input { command: 0.0, velocity: 0.2 * x, force: 0.0, spool: 0.1 * x, ..Input::default() };
                let out = channel.step(&mut state, &input);
                assert_eq!(out.status & status::CALIBRATION_LATE, 0);
                sum += out.voltage;
                if let Some(window) = out.window {
                    channel.publish(&mut state, learner.update(&mut memory, &window));
                }
            }
            (sum, state.window.number.wrapping_sub(first), state.calibration().flow_gain)
        };
        assert_eq!(run(0), run(u32::MAX - 50));
        assert!((run(0).2 - 1.0).abs() > 1e-3, "nothing was learned");
    }
}
