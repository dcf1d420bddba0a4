//! Servovalve and actuator with every effect, from the valve command to the force on the structure.

use eft_core::Scalar;

use crate::lanes::Num;
use crate::plant::bypass_valve::BypassValve;
use crate::plant::end_stop::EndStop;
use crate::plant::friction::Friction;
use crate::plant::load_cell::LoadCell;
use crate::plant::torque_motor::TorqueMotor;
use crate::plant::valve_leakage::{Leak, ValveLeakage};
use crate::plant::{Actuator, ActuatorState, AnyDrive, EnergyBalance, LoadFlow, PilotValve, Spool};
use crate::{Result, RigConfig};

/// One servovalve and its actuator.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ServoActuator<S: Num> {
    torque_motor: TorqueMotor<S>,
    pilot_valve: PilotValve<S>,
    spool: Spool<S>,
    /// Spool opening `b` (1) at which the valve is at null: `Q_L = f(x_v − b)·√…`.
    null_bias: S,
    load_flow: LoadFlow<S>,
    valve_leakage: ValveLeakage<S>,
    actuator: Actuator<S>,
    pub(crate) bypass_valve: BypassValve<S>,
    friction: Friction<S>,
    end_stop: EndStop<S>,
    load_cell: LoadCell<S>,
}

/// Flows of the oil at one state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hydraulics<S> {
    load_flow: S,
    leak: Leak<S>,
    drawn: S,
    bypassed: S,
    pressure_rate: S,
    filling_rate: S,
}

impl<S: Num> Hydraulics<S> {
    /// Flow (m³/s) drawn from the supply.
    #[inline(always)]
    pub(crate) fn drawn(&self) -> S {
        self.drawn + self.leak.drawn
    }
}

impl<S: Num> ServoActuator<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Result<Self> {
        Ok(Self {
            torque_motor: TorqueMotor::pack(rig),
            pilot_valve: PilotValve::pack(rig),
            spool: Spool::pack(rig),
            null_bias: S::from_lanes(|i| rig(i).servovalve.null_bias),
            load_flow: LoadFlow::pack(rig)?,
            valve_leakage: ValveLeakage::pack(rig),
            actuator: Actuator::pack(rig),
            bypass_valve: BypassValve::pack(rig),
            friction: Friction::pack(rig),
            end_stop: EndStop::pack(rig),
            load_cell: LoadCell::pack(rig),
        })
    }

    /// Force (N) on the structure.
    #[inline(always)]
    pub(crate) fn force(&self, state: &ActuatorState<S>) -> S {
        self.actuator.force(state.load_pressure)
            - self.friction.force(state.velocity)
            - self.end_stop.force(state.displacement, state.velocity)
    }

    /// Flows of the oil at a supply pressure (Pa).
    #[inline(always)]
    pub(crate) fn hydraulics(&self, state: &ActuatorState<S>, supply_pressure: S) -> Hydraulics<S> {
        let ActuatorState { load_pressure, displacement, velocity, .. } = *state;
        let opening = Spool::stop(state.spool) - self.null_bias;
        let (load_flow, drawn) = self.load_flow.flow_at(opening, load_pressure, supply_pressure);
        let leak = self.valve_leakage.leak(opening, load_pressure, supply_pressure);
        let bypassed = self.bypass_valve.flow(load_pressure);
        let net_flow = load_flow - leak.lost - bypassed;
        let [pressure_rate, filling_rate] =
            self.actuator.rates_at(net_flow, load_pressure, displacement, velocity);
        Hydraulics { load_flow, leak, drawn, bypassed, pressure_rate, filling_rate }
    }

    /// The valve command (V) of `driver` a time (s) into its interval, at the force and the load cell's state
    /// (N).
    #[inline(always)]
    pub(crate) fn valve_command(
        &self,
        state: &ActuatorState<S>,
        [force, reading]: [S; 2],
        hydraulics: &Hydraulics<S>,
        acceleration: S,
        driver: &AnyDrive<S>,
        time: S,
    ) -> S {
        let force_rate = self.actuator.force(hydraulics.pressure_rate)
            - self.friction.slope(state.velocity) * acceleration
            - self.end_stop.rate(state.displacement, state.velocity, acceleration);
        let cell_rate = self.load_cell.rate(force, acceleration, reading);
        driver.valve_command(
            time,
            self.load_cell.select(reading, force),
            self.load_cell.select(cell_rate, force_rate),
        )
    }

    /// The rates of state and torque motor under a valve command (V) at an acceleration (m/s²) of the structure.
    /// In place of the load pressure's rate it has that of the filling.
    #[inline(always)]
    pub(crate) fn rate(
        &self,
        state: &ActuatorState<S>,
        motor: [S; 2],
        hydraulics: &Hydraulics<S>,
        acceleration: S,
        valve_command: S,
    ) -> (ActuatorState<S>, [S; 2]) {
        let (valve, motor) = self.valve_rate(state, motor, valve_command);
        let state = ActuatorState {
            load_pressure: hydraulics.filling_rate,
            displacement: state.velocity,
            velocity: acceleration,
            ..valve
        };
        (state, motor)
    }

    /// The rates of pilot, spool and torque motor under a valve command (V); they do not depend on the oil.
    #[inline(always)]
    pub(crate) fn valve_rate(
        &self,
        state: &ActuatorState<S>,
        motor: [S; 2],
        valve_command: S,
    ) -> (ActuatorState<S>, [S; 2]) {
        let demanded_flow = self.pilot_valve.demanded_flow(valve_command, state.spool);
        let pilot_demand = self.torque_motor.output(motor, demanded_flow);
        let rate = ActuatorState {
            pilot_flow: self.pilot_valve.rate_towards(pilot_demand, state.pilot_flow),
            spool: self.spool.rate(state.pilot_flow, state.spool),
            ..ActuatorState::default()
        };
        (rate, self.torque_motor.rate(motor, demanded_flow))
    }

    /// The state from the numbers of a plant, which have the filling in place of the load pressure.
    #[inline(always)]
    pub(crate) fn state(&self, numbers: &[S]) -> ActuatorState<S> {
        let state = ActuatorState::from_slice(numbers);
        ActuatorState { load_pressure: self.actuator.load_pressure(state.load_pressure), ..state }
    }

    /// Displacement (m) and velocity (m/s) at the measured side, at a filling and a supply pressure (Pa).
    #[inline(always)]
    pub(crate) fn measured_motion(&self, state: &ActuatorState<S>, filling: S, supply_pressure: S) -> [S; 2] {
        let at_structure = [state.displacement, state.velocity];
        if !self.actuator.measures_at_piston {
            return at_structure;
        }
        let Hydraulics { pressure_rate, filling_rate, .. } = self.hydraulics(state, supply_pressure);
        let pressure = [state.load_pressure, pressure_rate];
        self.actuator.measured_motion(at_structure, pressure, [filling, filling_rate])
    }

    /// Rate (N/s) of the load cell's state, at the force and the cell's state (N).
    #[inline(always)]
    pub(crate) fn cell_rate(&self, [force, reading]: [S; 2], acceleration: S) -> S {
        self.load_cell.rate(force, acceleration, reading)
    }

    /// The load cell's reading (N): its state in lanes with a lag, the force in the others.
    #[inline(always)]
    pub(crate) fn shown(&self, [force, reading]: [S; 2]) -> S {
        self.load_cell.select(reading, force)
    }

    /// Adds the powers (W) of valve and actuator at a supply pressure (Pa).
    #[inline(always)]
    pub(crate) fn add_powers(
        &self,
        powers: &mut EnergyBalance<S>,
        state: &ActuatorState<S>,
        hydraulics: &Hydraulics<S>,
        supply_pressure: S,
    ) {
        let ActuatorState { load_pressure, displacement, velocity, .. } = *state;
        let Hydraulics { leak, load_flow, drawn, bypassed, .. } = *hydraulics;
        let across = self.actuator.leakage_loss(load_pressure) + load_pressure * bypassed;
        let leakage = supply_pressure * leak.drawn + load_pressure * leak.lost + across;
        powers.swept = powers.swept + self.actuator.swept_power(load_pressure, displacement, velocity);
        powers.valve = powers.valve + (supply_pressure * drawn - load_pressure * load_flow);
        powers.leakage = powers.leakage + leakage;
        powers.friction = powers.friction + self.friction.force(velocity) * velocity;
        powers.stops = powers.stops + self.end_stop.loss(displacement, velocity);
    }

    /// Energy (J) in the oil and in the stops.
    pub(crate) fn stored(&self, state: &ActuatorState<S>) -> S {
        self.actuator.stored(state.load_pressure, state.displacement)
            + self.end_stop.stored(state.displacement)
    }

    /// Lanes with the spool at a stop, and lanes with the piston beyond its stroke.
    #[inline(always)]
    pub(crate) fn at_limits(&self, state: &ActuatorState<S>) -> (<S as Scalar>::Mask, <S as Scalar>::Mask) {
        (Spool::at_stop(state.spool), self.actuator.beyond_stroke(state.displacement))
    }
}
