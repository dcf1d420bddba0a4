//! The parameters as C sees them, and the one place where they become the core's.

use core::ffi::c_char;

use eft_core::{
    ConfigError, Learning, Levels, Mode, Parameters, PlausibilityParameters, ProtectionParameters,
    Realization, SignFrom, VelocitySource,
};

use crate::codes::{EFT_CORRUPT, of};
use crate::place::{Opaque, give, given, made, make};
use crate::tables::{constants, data};

/// most points of a flow table
pub const EFT_TABLE_CAPACITY: usize = 21;

constants! { u8:
    EFT_REALIZATION_DIGITAL = 0, "realization: the force loop is closed here; the output is the valve command";
    EFT_REALIZATION_ANALOG = 1, "realization: an analog controller closes it; the output is its compensation signal";
    EFT_MODE_OFF = 0, "mode: no compensation";
    EFT_MODE_LINEAR = 1, "mode: by the linear flow gain";
    EFT_MODE_NONLINEAR = 2, "mode: by the flow table, corrected for the load pressure";
    EFT_SIGN_FROM_SPOOL = 0, "sign_from: the measured spool, as in the paper";
    EFT_SIGN_FROM_DEMAND = 1, "sign_from: the demanded flow, which does not chatter near null";
    EFT_VELOCITY_SENSOR = 0, "velocity_source: a sensor";
    EFT_VELOCITY_DERIVATIVE = 1, "velocity_source: the filtered derivative of the displacement";
    EFT_VELOCITY_OBSERVER = 2, "velocity_source: an observer of displacement and force";
    EFT_VELOCITY_ACCELEROMETER = 3, "velocity_source: an observer of displacement and measured acceleration";
}

data! {
    /// What is learned during the test, and within which bounds.
    eft_learning {
        adaptive: u8, "0 or 1; estimate flow gain and valve";
        curve_correction: u8, "0 or 1; correct the flow table by direction and band of flow as well";
        guard: u8, "0 or 1; take the level back where overcompensation pumps the structure";
        excitation: f64, "1; opening below which nothing is learned";
        flow_gain_bounds: [f64; 2], "1; lowest and highest flow gain over the table's";
        valve_gain_bounds: [f64; 2], "1; the same of the valve gain over the configured one";
        response_delay_bounds: [f64; 2], "1; the same of the response delay over the configured one";
        age_limit: f64, "s; a calibration expires after this time without a new one, at least 0.02";
    }
}

data! {
    /// Whether the measurements must agree with each other, and what the protection takes for granted then.
    eft_plausibility {
        enabled: u8, "0 or 1; without it a sensor that lies is not noticed";
        force_noise: f64, "N; standard deviation of the noise per sample";
        displacement_noise: f64, "m";
        velocity_noise: f64, "m/s";
        spool_noise: f64, "1";
        false_alarms: f64, "1/h; false alarms that this noise may raise";
        settle_time: f64, "s; the piston follows the specimen for this time in a shutdown";
    }
}

data! {
    /// The protection of the specimen; DBL_MAX in a level or time means none.
    eft_protection {
        enabled: u8, "0 or 1; without it no level, request or fault trips";
        force_warning: f64, "N";
        force_trip: f64, "N";
        displacement_warning: f64, "m";
        displacement_trip: f64, "m";
        velocity_warning: f64, "m/s";
        velocity_trip: f64, "m/s";
        spool_warning: f64, "1";
        spool_trip: f64, "1";
        start_time: f64, "s; from zero to the whole command at the start, 0 for none";
        ramp_time: f64, "s; from the whole command to zero after a trip or at the end";
        shutdown_time: f64, "s; from the whole valve command to zero in a shutdown";
        lost_samples: u32, "samples; so many lost in a row do not trip, at most 100000";
        fault_time: f64, "s; a fault that the controller reports may last so long";
        period_tolerance: f64, "1; share by which a measured sample period may be off";
        oscillation_limit: f64, "N; rms of the force error from 30 to 150 Hz that shuts down";
        plausibility: eft_plausibility, "Whether the measurements agree.";
    }
}

data! {
    /// The rig as its controller knows it, in SI units, and what of the controller is switched on. DBL_MAX in a limit or
    /// range means none.
    eft_parameters {
        sample_rate: f64, "Hz";
        realization: u8, "EFT_REALIZATION_...";
        mode: u8, "EFT_MODE_...";
        level: f64, "1; compensation level, 1 is full compensation";
        sign_from: u8, "EFT_SIGN_FROM_...";
        piston_area: f64, "m2";
        supply_pressure: f64, "Pa; at which the flow table holds";
        supply_correction: u8, "0 or 1; the supply pressure is measured and its departures are corrected";
        compressibility: f64, "m3/Pa; of the oil in the chambers";
        leakage: f64, "m3/(s Pa); across the piston";
        table_length: u32, "points of the flow table, from 2 to EFT_TABLE_CAPACITY";
        openings: [f64; EFT_TABLE_CAPACITY], "1; spool openings of the flow table, strictly increasing";
        flows: [f64; EFT_TABLE_CAPACITY], "m3/s; its flows, strictly increasing";
        flow_gain: f64, "m3/s at opening 1; of the linear scheme";
        valve_gain: f64, "opening per V";
        response_delay: f64, "s; delay of the valve, for which the lead network compensates";
        lead_alpha: f64, "1; the lead network's alpha";
        velocity_source: u8, "EFT_VELOCITY_...";
        corner: f64, "Hz; low-passes of EFT_VELOCITY_DERIVATIVE";
        gain_on_displacement: f64, "1; gains of the observers";
        gain_on_velocity: f64, "1/s";
        gain_on_drift: f64, "1/s2";
        mass: f64, "kg; that the force moves, of EFT_VELOCITY_OBSERVER";
        velocity_delay: f64, "s; delay of the velocity; a learning lead network compensates for it as well";
        computation_delay: u32, "samples; delay of the compensation by computation, at most 1000";
        feedforward: u8, "0 or 1; the command's own flow is demanded as well";
        look_ahead: u8, "0 or 1; the feedforward is given the next tick's command";
        force_sensitivity: f64, "V/N";
        proportional_gain: f64, "V/V";
        derivative_gain: f64, "s";
        integral_gain: f64, "1/s; of a force loop that is closed in the channel, 0 for none";
        valve_command: f64, "V; limit of the valve command";
        valve_command_rate: f64, "V/s; limit of its rate";
        spool_warning: f64, "1; opening that raises EFT_SPOOL_WARNING";
        velocity_range: f64, "m/s; beyond it a measurement is invalid";
        force_range: f64, "N";
        spool_range: f64, "1";
        gap_time: f64, "s; after this time without a valid sample the controller starts from rest";
        learning: eft_learning, "What is learned.";
        protection: eft_protection, "The protection.";
        stuck_samples: u32, "samples; a measurement may repeat to the last bit so often, 0: not watched";
    }
}

/// A byte that stands for one of `choices`.
fn choice<T: Copy>(parameter: &'static str, value: u8, choices: &[T]) -> Result<T, ConfigError> {
    choices.get(usize::from(value)).copied().ok_or(ConfigError::OutOfRange {
        parameter,
        value: f64::from(value),
        lowest: 0.0,
        highest: (choices.len() - 1) as f64,
    })
}

/// A byte that is 0 or 1.
fn switch(parameter: &'static str, value: u8) -> Result<bool, ConfigError> {
    choice(parameter, value, &[false, true])
}

impl eft_parameters {
    /// As the core takes them.
    pub(crate) fn core(&self) -> Result<Parameters<'_>, ConfigError> {
        let gains = [self.gain_on_displacement, self.gain_on_velocity, self.gain_on_drift];
        let velocity_sources = [
            VelocitySource::Sensor,
            VelocitySource::Derivative { corner: self.corner },
            VelocitySource::Observer { gains, mass: self.mass },
            VelocitySource::Accelerometer { gains },
        ];
        let (l, p, length) = (&self.learning, &self.protection, self.table_length as usize);
        let (Some(openings), Some(flows)) = (self.openings.get(..length), self.flows.get(..length)) else {
            let (parameter, longest) = ("table_length", EFT_TABLE_CAPACITY);
            return Err(ConfigError::Length { parameter, length, shortest: 2, longest });
        };
        let levels = |warning, trip| Levels { warning, trip };
        let protection = ProtectionParameters {
            force: levels(p.force_warning, p.force_trip),
            displacement: levels(p.displacement_warning, p.displacement_trip),
            velocity: levels(p.velocity_warning, p.velocity_trip),
            spool: levels(p.spool_warning, p.spool_trip),
            start_time: p.start_time,
            ramp_time: p.ramp_time,
            shutdown_time: p.shutdown_time,
            lost_samples: p.lost_samples,
            fault_time: p.fault_time,
            period_tolerance: p.period_tolerance,
            oscillation_limit: p.oscillation_limit,
            plausibility: switch("plausibility", p.plausibility.enabled)?.then_some(PlausibilityParameters {
                force_noise: p.plausibility.force_noise,
                displacement_noise: p.plausibility.displacement_noise,
                velocity_noise: p.plausibility.velocity_noise,
                spool_noise: p.plausibility.spool_noise,
                false_alarms: p.plausibility.false_alarms,
                settle_time: p.plausibility.settle_time,
            }),
        };
        Ok(Parameters {
            sample_rate: self.sample_rate,
            realization: choice(
                "realization",
                self.realization,
                &[Realization::Digital, Realization::Analog],
            )?,
            mode: choice("mode", self.mode, &[Mode::Off, Mode::Linear, Mode::Nonlinear])?,
            level: self.level,
            sign_from: choice("sign_from", self.sign_from, &[SignFrom::Spool, SignFrom::Demand])?,
            piston_area: self.piston_area,
            supply_pressure: self.supply_pressure,
            supply_correction: switch("supply_correction", self.supply_correction)?,
            compressibility: self.compressibility,
            leakage: self.leakage,
            openings,
            flows,
            flow_gain: self.flow_gain,
            valve_gain: self.valve_gain,
            response_delay: self.response_delay,
            lead_alpha: self.lead_alpha,
            velocity_source: choice("velocity_source", self.velocity_source, &velocity_sources)?,
            velocity_delay: self.velocity_delay,
            computation_delay: self.computation_delay,
            feedforward: switch("feedforward", self.feedforward)?,
            look_ahead: switch("look_ahead", self.look_ahead)?,
            force_sensitivity: self.force_sensitivity,
            proportional_gain: self.proportional_gain,
            derivative_gain: self.derivative_gain,
            integral_gain: self.integral_gain,
            valve_command: self.valve_command,
            valve_command_rate: self.valve_command_rate,
            spool_warning: self.spool_warning,
            velocity_range: self.velocity_range,
            force_range: self.force_range,
            spool_range: self.spool_range,
            gap_time: self.gap_time,
            learning: Learning {
                adaptive: switch("adaptive", l.adaptive)?,
                curve_correction: switch("curve_correction", l.curve_correction)?,
                guard: switch("guard", l.guard)?,
                excitation: l.excitation,
                flow_gain_bounds: l.flow_gain_bounds,
                valve_gain_bounds: l.valve_gain_bounds,
                response_delay_bounds: l.response_delay_bounds,
                age_limit: l.age_limit,
            },
            protection: switch("enabled", p.enabled)?.then_some(protection),
            stuck_samples: self.stuck_samples,
        })
    }
}

data! {
    /// Why a configuration was refused.
    eft_error {
        value: f64, "refused value or length; 0 where there is none";
        lowest: f64, "lowest value allowed";
        highest: f64, "highest value allowed";
        index: u32, "entry of a table";
        parameter: [c_char; 28], "name of the parameter, ended by a zero byte";
    }
}

impl eft_error {
    fn new(error: ConfigError) -> Self {
        let (name, value, lowest, highest, index) = match error {
            ConfigError::NotFinite { parameter } => (parameter, 0.0, 0.0, 0.0, 0),
            ConfigError::NotPositive { parameter, value } => (parameter, value, 0.0, 0.0, 0),
            ConfigError::OutOfRange { parameter, value, lowest, highest } => {
                (parameter, value, lowest, highest, 0)
            }
            ConfigError::NotIncreasing { parameter, index } | ConfigError::TooSteep { parameter, index } => {
                (parameter, 0.0, 0.0, 0.0, index)
            }
            ConfigError::Length { parameter, length, shortest, longest } => {
                (parameter, length as f64, shortest as f64, longest as f64, 0)
            }
            _ => ("", 0.0, 0.0, 0.0, 0),
        };
        let mut parameter = [0; 28];
        for (to, from) in parameter.iter_mut().take(27).zip(name.bytes()) {
            *to = from as c_char;
        }
        Self { value, lowest, highest, index: index as u32, parameter }
    }
}

/// Lends a configuration of the core, of its parameters, or says why it is refused.
pub(crate) type Lend<C> = fn(&Parameters, &mut dyn FnMut(&C)) -> Result<(), ConfigError>;

/// Lends a configuration of the parameters.
// By reference: moved into a closure, the core's parameters would be on the stack twice.
fn with<C>(parameters: &eft_parameters, lend: Lend<C>, take: &mut dyn FnMut(&C)) -> Result<(), ConfigError> {
    match &parameters.core() {
        Ok(core) => lend(core, take),
        Err(error) => Err(*error),
    }
}

/// Makes a configuration, or says why not. Each pointer is null or valid.
pub(crate) unsafe fn configure<O: Opaque<Value: Copy>>(
    lend: Lend<O::Value>,
    parameters: *const eft_parameters,
    place: *mut O,
    why: *mut eft_error,
) -> Result<(), u8> {
    let mut made = Ok(());
    // Safety: null or valid; where nobody asks for the reason none is given.
    unsafe {
        let refused = with(given(parameters)?, lend, &mut |configuration| made = make(place, *configuration));
        if let Err(error) = refused {
            _ = give(why, eft_error::new(error));
            return Err(of(&error));
        }
    }
    made
}

/// Whether a configuration is what its parameters make. Each pointer is null or valid.
pub(crate) unsafe fn check<O: Opaque<Value: PartialEq> + 'static>(
    lend: Lend<O::Value>,
    place: *const O,
    parameters: *const eft_parameters,
) -> Result<(), u8> {
    // Safety: null or valid.
    let (there, parameters) = unsafe { (made(place)?, given(parameters)?) };
    let mut equal = false;
    match with(parameters, lend, &mut |again| equal = again == there) {
        Ok(()) if equal => Ok(()),
        Ok(()) => Err(EFT_CORRUPT),
        Err(error) => Err(of(&error)),
    }
}
