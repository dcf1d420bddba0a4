//! The drive of the servovalve between two samples.

use eft_core::Mask;

use crate::config::RigConfig;
use crate::lanes::Num;

/// A source of the valve command between two samples.
pub(crate) trait Drive<S: Num>: Copy {
    /// Valve command (V) a time (s) after the sample, at the force (N) and its rate (N/s) then, before any
    /// limit. It is linear in time, force and rate.
    fn demand(&self, time: S, force: S, force_rate: S) -> S;

    /// Difference of the demand (V) at zero force and rate, a time (s) after the sample, from a level (V).
    #[inline(always)]
    fn demand_difference(&self, level: S, time: S) -> S {
        self.demand(time, S::splat(0.0), S::splat(0.0)) - level
    }

    /// Rate (V/s) of the demand at constant force.
    fn slope(&self) -> S;

    /// Lanes in which the demand depends on force and rate as with a working load cell of this gain (1).
    #[inline(always)]
    fn has_nominal_cell(&self, _cell_gain: S) -> S::Mask {
        S::Mask::splat(true)
    }

    /// The limited demand (V).
    #[inline(always)]
    fn limit(&self, demand: S) -> S {
        demand
    }

    /// Whether [`limit`](Self::limit) may change a demand.
    #[inline(always)]
    fn has_limit(&self) -> bool {
        false
    }

    /// Lanes in which [`limit`](Self::limit) does not change a demand (V).
    #[inline(always)]
    fn is_unlimited(&self, _demand: S) -> S::Mask {
        S::Mask::splat(true)
    }

    /// Valve command (V) a time (s) after the sample, at the force (N) and its rate (N/s) then.
    #[inline(always)]
    fn valve_command(&self, time: S, force: S, force_rate: S) -> S {
        self.limit(self.demand(time, force, force_rate))
    }
}

/// The digital realization: the command is held.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held<S>(pub(crate) S);

impl<S: Num> Drive<S> for Held<S> {
    #[inline(always)]
    fn demand(&self, _: S, _: S, _: S) -> S {
        self.0
    }
    #[inline(always)]
    fn slope(&self) -> S {
        S::splat(0.0)
    }
}

/// The analog realization, Eq. (1) in continuous time: the command is linear between samples, and only the
/// compensation is held.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Analog<S> {
    proportional: S,
    derivative: S,
    gain: S,
    amplitude: S,
    /// Whether any lane has a limit of the amplitude.
    limited: bool,
    command: S,
    command_rate: S,
    compensation: S,
}

impl<S: Num> Analog<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let control = |i: usize| &rig(i).controller;
        Self {
            proportional: S::from_lanes(|i| control(i).proportional_gain * control(i).force_sensitivity),
            derivative: S::from_lanes(|i| control(i).derivative_gain * control(i).force_sensitivity),
            gain: S::from_lanes(|i| control(i).proportional_gain),
            amplitude: S::from_lanes(|i| rig(i).limits.valve_command.unwrap_or(f64::MAX)),
            limited: (0..S::LANES).any(|i| rig(i).limits.valve_command.is_some()),
            ..Self::default()
        }
    }

    /// The same controller in the next interval, with command (N), its rate (N/s) and compensation (V).
    #[inline(always)]
    pub(crate) fn at(&self, command: S, command_rate: S, compensation: S) -> Self {
        Self { command, command_rate, compensation, ..*self }
    }

    /// Difference of the demand (V), a time (s) after the sample, from a level (V) if the cell reads an
    /// offset (N) only.
    // The compensation is added last by one operation, because the loop waits for it. All cells use one
    // formula, so that an ideal cell changes no bit.
    #[inline(always)]
    fn demand_above(&self, level: S, time: S, offset: S) -> S {
        let error = self.command + self.command_rate * time - offset;
        let known = self.proportional * error + self.derivative * self.command_rate;
        (known - level).plus(self.gain, self.compensation)
    }

    /// The same controller with a load cell that reads `gain·force + offset`.
    #[inline(always)]
    pub(crate) fn with_cell(self, (gain, offset): (S, S)) -> AnalogWithCell<S> {
        AnalogWithCell { analog: self, gain, offset, authority: S::splat(1.0) }
    }
}

/// The analog realization with a load cell that is not ideal; the offset (N) is held between samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AnalogWithCell<S> {
    pub(crate) analog: Analog<S>,
    pub(crate) gain: S,
    pub(crate) offset: S,
    pub(crate) authority: S,
}

impl<S: Num> Drive<S> for AnalogWithCell<S> {
    #[inline(always)]
    fn demand(&self, time: S, force: S, force_rate: S) -> S {
        self.analog.demand(time, self.gain * force + self.offset, self.gain * force_rate)
    }
    #[inline(always)]
    fn demand_difference(&self, level: S, time: S) -> S {
        self.analog.demand_above(level, time, self.offset)
    }
    #[inline(always)]
    fn slope(&self) -> S {
        self.analog.slope()
    }
    #[inline(always)]
    fn has_nominal_cell(&self, cell_gain: S) -> S::Mask {
        self.gain.le(cell_gain) & self.gain.ge(cell_gain)
    }
    #[inline(always)]
    fn limit(&self, demand: S) -> S {
        self.authority * self.analog.limit(demand)
    }
    #[inline(always)]
    fn has_limit(&self) -> bool {
        true
    }
    #[inline(always)]
    fn is_unlimited(&self, demand: S) -> S::Mask {
        let limited = self.limit(demand);
        limited.le(demand) & limited.ge(demand)
    }
}

impl<S: Num> Drive<S> for Analog<S> {
    #[inline(always)]
    fn demand(&self, time: S, force: S, force_rate: S) -> S {
        let error = self.command + self.command_rate * time - force;
        let error_rate = self.command_rate - force_rate;
        self.proportional * error + self.gain * self.compensation + self.derivative * error_rate
    }
    #[inline(always)]
    fn demand_difference(&self, level: S, time: S) -> S {
        self.demand_above(level, time, S::splat(0.0))
    }
    #[inline(always)]
    fn slope(&self) -> S {
        self.proportional * self.command_rate
    }
    #[inline(always)]
    fn limit(&self, demand: S) -> S {
        if self.limited { demand.limit(-self.amplitude, self.amplitude) } else { demand }
    }
    #[inline(always)]
    fn has_limit(&self) -> bool {
        self.limited
    }
    #[inline(always)]
    fn is_unlimited(&self, demand: S) -> S::Mask {
        demand.abs().le(self.amplitude)
    }
}

/// Any of the drives. The kind is selected outside the integration step.
// One struct for all kinds, because an enum would be copied through memory every tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AnyDrive<S> {
    pub(crate) kind: DriveKind,
    /// The valve command (V) of [`DriveKind::Held`], zero for the other kinds.
    pub(crate) held: Held<S>,
    /// The controller of the other two kinds.
    pub(crate) cell: AnalogWithCell<S>,
}

/// Which drive it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DriveKind {
    /// The command is held.
    Held,
    /// An analog controller with an ideal load cell.
    Analog,
    /// An analog controller.
    AnalogWithCell,
}

impl<S: Num> AnyDrive<S> {
    /// A held command (V).
    #[inline(always)]
    pub(crate) fn held(command: S) -> Self {
        let zero = S::splat(0.0);
        let idle = Analog::default();
        Self { kind: DriveKind::Held, held: Held(command), cell: idle.with_cell((S::splat(1.0), zero)) }
    }

    /// Valve command (V) a time (s) after the sample, at the force (N) and its rate (N/s) then.
    #[inline(always)]
    pub(crate) fn valve_command(&self, time: S, force: S, force_rate: S) -> S {
        match self.kind {
            DriveKind::Held => self.held.valve_command(time, force, force_rate),
            DriveKind::Analog => self.cell.analog.valve_command(time, force, force_rate),
            DriveKind::AnalogWithCell => self.cell.valve_command(time, force, force_rate),
        }
    }

    /// An analog controller with its load cell, which may be ideal.
    #[inline(always)]
    pub(crate) fn analog(cell: AnalogWithCell<S>, ideal: bool) -> Self {
        let kind = if ideal { DriveKind::Analog } else { DriveKind::AnalogWithCell };
        Self { kind, held: Held(S::splat(0.0)), cell }
    }
}
