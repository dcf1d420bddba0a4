//! The parameters in C, and their conversion to those of the core.

use core::ffi::c_char;
use core::mem::MaybeUninit;

use eft_core::{
    Channel, ConfigError, Learner, Learning, Levels, Mode, Parameters, PlausibilityParameters,
    ProtectionParameters, Realization, SignFrom, VelocitySource,
};

use crate::codes::*;
use crate::constants::constants;
use crate::macros::data;
use crate::opaque::{Opaque, give, given, made, mark, room};

/// The most points of a flow table.
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
    /// The quantities that are learned during the test, and their bounds.
    eft_learning {
        adaptive: u8, "0 or 1; estimate flow gain and valve";
        curve_correction: u8, "0 or 1; correct the flow table by direction and band of flow as well";
        guard: u8, "0 or 1; reduce the level if overcompensation excites the structure";
        excitation: f64, "1; opening below which nothing is learned";
        flow_gain_bounds: [f64; 2], "1; lowest and highest flow gain over the table's";
        valve_gain_bounds: [f64; 2], "1; lowest and highest valve gain over the configured one";
        response_delay_bounds: [f64; 2], "1; lowest and highest response delay over the configured one";
        age_limit: f64, "s; a calibration expires after this time without a new one, at least 0.02";
    }
}

data! {
    /// The plausibility watch, which compares the measurements with each other.
    eft_plausibility {
        enabled: u8, "0 or 1; without it a wrong sensor is not noticed";
        force_noise: f64, "N; standard deviation of the noise per sample";
        displacement_noise: f64, "m";
        velocity_noise: f64, "m/s";
        spool_noise: f64, "1";
        load_pressure_tolerance: f64, "N; force against load pressure times area; DBL_MAX: not measured";
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
        lost_samples: u32, "samples; this many lost in a row do not trip, at most 100000";
        fault_time: f64, "s; longest duration of a fault that the controller reports";
        period_tolerance: f64, "1; largest relative deviation of a measured sample period";
        oscillation_limit: f64, "N; rms of the force error from 30 to 150 Hz that causes a shutdown";
        plausibility: eft_plausibility, "the plausibility watch";
    }
}

data! {
    /// The rig as its controller knows it, in SI units, and the parts of the controller that are switched on. DBL_MAX
    /// in a limit or range means none.
    eft_parameters {
        sample_rate: f64, "Hz";
        realization: u8, "EFT_REALIZATION_...";
        mode: u8, "EFT_MODE_...";
        level: f64, "1; compensation level, 1 is full compensation";
        sign_from: u8, "EFT_SIGN_FROM_...";
        piston_area: f64, "m2";
        supply_pressure: f64, "Pa; at which the flow table holds";
        supply_correction: u8, "0 or 1; the supply pressure is measured and its deviations are corrected";
        compressibility: f64, "m3/Pa; of the oil in the chambers";
        leakage: f64, "m3/(s Pa); across the piston";
        friction: f64, "N; Coulomb friction of the seals, 0 for none";
        friction_velocity: f64, "m/s; below it the friction falls to zero";
        overlap: f64, "1; overlap of the spool's lands, which is not in the flow table, 0 for none";
        null_bias: f64, "1; opening without flow at no load, 0 for none";
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
        mass: f64, "kg; moved by the force, for EFT_VELOCITY_OBSERVER";
        velocity_delay: f64, "s; delay of the velocity; a learning lead network compensates for it as well";
        computation_delay: u32, "samples; delay of the compensation by computation, at most 1000";
        feedforward: u8, "0 or 1; demand the flow that the command needs as well";
        look_ahead: u8, "0 or 1; feedforward and load-pressure correction use the next tick's command";
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
        gap_time: f64, "s; after this time without a valid sample the controller resumes";
        learning: eft_learning, "what is learned";
        protection: eft_protection, "the protection";
        stuck_samples: u32, "samples; a measurement may repeat to the last bit this often, 0: not watched";
    }
}

/// The value that a byte stands for.
fn choice<V: Copy>(parameter: &'static str, byte: u8, choices: &[V]) -> Result<V, ConfigError> {
    let (value, highest) = (f64::from(byte), (choices.len() - 1) as f64);
    let refused = ConfigError::OutOfRange { parameter, value, lowest: 0.0, highest };
    choices.get(usize::from(byte)).copied().ok_or(refused)
}

/// A byte that is 0 or 1.
fn switch(parameter: &'static str, byte: u8) -> Result<bool, ConfigError> {
    choice(parameter, byte, &[false, true])
}

/// A struct of the core. What is copied or a switch (0 or 1) has the same name in C; the rest is given.
macro_rules! core {
    ($Core:ident, $c:expr; copied: $($same:ident)*; switches: $($switch:ident)*; $($given:tt)*) => {
        $Core {
            $($same: $c.$same,)*
            $($switch: switch(stringify!($switch), $c.$switch)?,)*
            $($given)*
        }
    };
}

impl eft_parameters {
    /// As the core takes them.
    fn core(&self) -> Result<Parameters<'_>, ConfigError> {
        let length = self.table_length as usize;
        let (Some(openings), Some(flows)) = (self.openings.get(..length), self.flows.get(..length)) else {
            let (parameter, longest) = ("table_length", EFT_TABLE_CAPACITY);
            return Err(ConfigError::Length { parameter, length, shortest: 2, longest });
        };
        let gains = [self.gain_on_displacement, self.gain_on_velocity, self.gain_on_drift];
        let velocity_sources = [
            VelocitySource::Sensor,
            VelocitySource::Derivative { corner: self.corner },
            VelocitySource::Observer { gains, mass: self.mass },
            VelocitySource::Accelerometer { gains },
        ];
        let levels = |warning, trip| Levels { warning, trip };
        let p = &self.protection;
        let plausibility = core! { PlausibilityParameters, p.plausibility;
            copied: force_noise displacement_noise velocity_noise spool_noise load_pressure_tolerance
                false_alarms settle_time;
            switches: ;
        };
        let protection = core! { ProtectionParameters, p;
            copied: start_time ramp_time shutdown_time lost_samples fault_time period_tolerance oscillation_limit;
            switches: ;
            force: levels(p.force_warning, p.force_trip),
            displacement: levels(p.displacement_warning, p.displacement_trip),
            velocity: levels(p.velocity_warning, p.velocity_trip),
            spool: levels(p.spool_warning, p.spool_trip),
            plausibility: switch("plausibility", p.plausibility.enabled)?.then_some(plausibility),
        };
        Ok(core! { Parameters, self;
            copied: sample_rate level piston_area supply_pressure compressibility leakage friction friction_velocity overlap
                null_bias flow_gain valve_gain response_delay lead_alpha velocity_delay computation_delay force_sensitivity proportional_gain
                derivative_gain integral_gain valve_command valve_command_rate spool_warning velocity_range force_range
                spool_range gap_time stuck_samples;
            switches: supply_correction feedforward look_ahead;
            realization: choice("realization", self.realization, &[Realization::Digital, Realization::Analog])?,
            mode: choice("mode", self.mode, &[Mode::Off, Mode::Linear, Mode::Nonlinear])?,
            sign_from: choice("sign_from", self.sign_from, &[SignFrom::Spool, SignFrom::Demand])?,
            openings,
            flows,
            velocity_source: choice("velocity_source", self.velocity_source, &velocity_sources)?,
            learning: core! { Learning, self.learning;
                copied: excitation flow_gain_bounds valve_gain_bounds response_delay_bounds age_limit;
                switches: adaptive curve_correction guard;
            },
            protection: switch("protection", p.enabled)?.then_some(protection),
        })
    }

    /// Calls `f` with the core's parameters.
    // By reference, because a move would put them on the stack twice.
    #[inline(always)]
    fn with<R>(&self, f: impl FnOnce(&Parameters) -> Result<R, ConfigError>) -> Result<R, ConfigError> {
        match &self.core() {
            Ok(core) => f(core),
            Err(error) => Err(*error),
        }
    }
}

data! {
    /// Why a configuration was refused.
    eft_error {
        value: f64, "refused value or length; 0 without one";
        lowest: f64, "lowest value allowed";
        highest: f64, "highest value allowed";
        index: u32, "entry of a table";
        parameter: [c_char; 52], "name of the parameter, terminated by a zero byte";
    }
}

/// The code and the details of a refused parameter.
fn refusal(error: ConfigError) -> (u8, eft_error) {
    let (code, name, [value, lowest, highest], index) = match error {
        ConfigError::NotFinite { parameter } => (EFT_NOT_FINITE, parameter, [0.0; 3], 0),
        ConfigError::NotPositive { parameter, value } => (EFT_NOT_POSITIVE, parameter, [value, 0.0, 0.0], 0),
        ConfigError::OutOfRange { parameter, value, lowest, highest } => {
            (EFT_OUT_OF_RANGE, parameter, [value, lowest, highest], 0)
        }
        ConfigError::Entry { parameter, index, value, lowest, highest } => {
            let code = if value.is_finite() { EFT_OUT_OF_RANGE } else { EFT_NOT_FINITE };
            (code, parameter, [value, lowest, highest], index)
        }
        ConfigError::NotIncreasing { parameter, index } => (EFT_NOT_INCREASING, parameter, [0.0; 3], index),
        ConfigError::TooSteep { parameter, index } => (EFT_TOO_STEEP, parameter, [0.0; 3], index),
        ConfigError::Length { parameter, length, shortest, longest } => {
            (EFT_LENGTH, parameter, [length, shortest, longest].map(|n| n as f64), 0)
        }
        _ => (EFT_REFUSED, "", [0.0; 3], 0),
    };
    let mut parameter = [0; 52];
    for (to, from) in parameter.iter_mut().take(51).zip(name.bytes()) {
        *to = from as c_char;
    }
    (code, eft_error { value, lowest, highest, index: index as u32, parameter })
}

/// A configuration of the core, constructed in place, because two of them do not fit on the stack.
pub(crate) trait Configuration: Sized {
    fn make_in(place: &mut MaybeUninit<Self>, p: &Parameters) -> Result<(), ConfigError>;
    /// Whether the parameters give the same configuration.
    // A learner is compared where `new` returns it: by `make_in` a check would take 0.6 kB more of stack.
    fn is_of(&self, p: &Parameters) -> Result<bool, ConfigError>;
}
macro_rules! configurations {
    ($($t:ident)*) => {$(
        impl Configuration for Channel<$t, EFT_TABLE_CAPACITY> {
            fn make_in(place: &mut MaybeUninit<Self>, p: &Parameters) -> Result<(), ConfigError> {
                Self::make_in(place, p).map(|_| ())
            }
            fn is_of(&self, p: &Parameters) -> Result<bool, ConfigError> {
                Self::make_in(&mut MaybeUninit::uninit(), p).map(|again| again == self)
            }
        }
        impl Configuration for Learner<$t, EFT_TABLE_CAPACITY> {
            fn make_in(place: &mut MaybeUninit<Self>, p: &Parameters) -> Result<(), ConfigError> {
                Self::new(p).map(|learner| _ = place.write(learner))
            }
            fn is_of(&self, p: &Parameters) -> Result<bool, ConfigError> {
                Self::new(p).as_ref().map(|again| again == self).map_err(|error| *error)
            }
        }
    )*};
}
configurations!(f32 f64);

/// Makes a configuration, or gives the reason for a refusal. Each pointer is null or valid.
pub(crate) unsafe fn configure<O: Opaque<Value: Configuration>>(
    parameters: *const eft_parameters,
    place: *mut O,
    why: *mut eft_error,
) -> Result<(), u8> {
    // Safety: null or valid.
    unsafe {
        let (parameters, room) = (given(parameters)?, room(place)?);
        parameters.with(|core| O::Value::make_in(room, core)).map_err(|error| refuse(error, why))?;
        mark(place);
    }
    Ok(())
}

/// Writes the reason of a refusal to `why`, which is null or valid, and returns its code.
pub(crate) unsafe fn refuse(error: ConfigError, why: *mut eft_error) -> u8 {
    let (code, reason) = refusal(error);
    // Safety: null or valid.
    _ = unsafe { give(why, reason) };
    code
}

/// Compares a configuration with one from its parameters. Each pointer is null or valid.
pub(crate) unsafe fn check<O: Opaque<Value: Configuration> + 'static>(
    place: *const O,
    parameters: *const eft_parameters,
) -> Result<(), u8> {
    // Safety: null or valid.
    let (configuration, parameters) = unsafe { (made(place)?, given(parameters)?) };
    match parameters.with(|core| configuration.is_of(core)) {
        Ok(true) => Ok(()),
        Ok(false) => Err(EFT_CORRUPT),
        Err(error) => Err(refusal(error).0),
    }
}
