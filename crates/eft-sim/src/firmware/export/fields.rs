//! The parameters as a list of named values with their units, for both languages.

use std::fmt::Debug;

use eft_core::{
    Learning as LearningParameters, Levels, Parameters, PlausibilityParameters, ProtectionParameters,
    VelocitySource,
};

use Value::{
    Bounds, Choice, Count, Learning, Limits, Number, Numbers, Plausibility, Protection, Switch, Velocity,
};

/// A parameter's value.
pub(super) enum Value<'a> {
    Number(f64),
    Count(u32),
    Switch(bool),
    /// A value of an enumeration: name of the enumeration and name of the value.
    Choice(&'static str, String),
    Numbers(&'a [f64]),
    Bounds([f64; 2]),
    Limits(Levels),
    Velocity(VelocitySource),
    Learning(LearningParameters),
    Protection(Option<ProtectionParameters>),
    Plausibility(Option<PlausibilityParameters>),
}

/// Name, value and unit.
pub(super) type Field<'a> = (&'static str, Value<'a>, &'static str);

/// `name: kind, unit` of every field of a struct, in its order. A field that is missing does not compile.
macro_rules! list {
    ($of:ident: $Struct:ident { $($name:ident: $kind:expr, $unit:literal;)* }) => {{
        let $Struct { $($name),* } = *$of;
        vec![$((stringify!($name), $kind($name), $unit)),*]
    }};
}

/// A value of the enumeration of this name.
fn choice<'a, T: Debug>(of: &'static str) -> impl Fn(T) -> Value<'a> {
    move |value| Choice(of, format!("{value:?}"))
}

/// Every parameter.
pub(super) fn fields<'a>(p: &Parameters<'a>) -> Vec<Field<'a>> {
    list!(p: Parameters {
        sample_rate: Number, "Hz";
        realization: choice("Realization"), "";
        mode: choice("Mode"), "";
        level: Number, "1";
        sign_from: choice("SignFrom"), "";
        piston_area: Number, "m2";
        supply_pressure: Number, "Pa";
        supply_correction: Switch, "";
        compressibility: Number, "m3/Pa";
        leakage: Number, "m3/(s Pa)";
        friction: Number, "N";
        friction_velocity: Number, "m/s";
        overlap: Number, "1";
        null_bias: Number, "1";
        openings: Numbers, "1";
        flows: Numbers, "m3/s";
        flow_gain: Number, "m3/s";
        valve_gain: Number, "1/V";
        response_delay: Number, "s";
        lead_alpha: Number, "1";
        velocity_source: Velocity, "";
        velocity_delay: Number, "s";
        computation_delay: Count, "samples";
        feedforward: Switch, "";
        look_ahead: Switch, "";
        force_sensitivity: Number, "V/N";
        proportional_gain: Number, "V/V";
        derivative_gain: Number, "s";
        integral_gain: Number, "1/s";
        valve_command: Number, "V";
        valve_command_rate: Number, "V/s";
        spool_warning: Number, "1";
        velocity_range: Number, "m/s";
        force_range: Number, "N";
        spool_range: Number, "1";
        gap_time: Number, "s";
        learning: Learning, "";
        protection: Protection, "";
        stuck_samples: Count, "samples";
    })
}

/// The parameters of learning.
pub(super) fn learning(l: &LearningParameters) -> Vec<Field<'static>> {
    list!(l: LearningParameters {
        adaptive: Switch, "";
        curve_correction: Switch, "";
        guard: Switch, "";
        excitation: Number, "1";
        flow_gain_bounds: Bounds, "1";
        valve_gain_bounds: Bounds, "1";
        response_delay_bounds: Bounds, "1";
        age_limit: Number, "s";
    })
}

/// The parameters of a protection.
pub(super) fn protection(p: &ProtectionParameters) -> Vec<Field<'static>> {
    list!(p: ProtectionParameters {
        force: Limits, "N";
        displacement: Limits, "m";
        velocity: Limits, "m/s";
        spool: Limits, "1";
        start_time: Number, "s";
        ramp_time: Number, "s";
        shutdown_time: Number, "s";
        lost_samples: Count, "samples";
        fault_time: Number, "s";
        period_tolerance: Number, "1";
        oscillation_limit: Number, "N";
        plausibility: Plausibility, "";
    })
}

/// The parameters of a plausibility check.
pub(super) fn plausibility(p: &PlausibilityParameters) -> Vec<Field<'static>> {
    list!(p: PlausibilityParameters {
        force_noise: Number, "N";
        displacement_noise: Number, "m";
        velocity_noise: Number, "m/s";
        spool_noise: Number, "1";
        load_pressure_tolerance: Number, "N";
        false_alarms: Number, "1/h";
        settle_time: Number, "s";
    })
}

/// A number that both languages read back exactly; `none` for an infinite limit.
pub(super) fn number(value: f64, none: &str) -> String {
    if value < f64::MAX { format!("{value:?}") } else { none.to_owned() }
}

pub(super) fn list(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(", ")
}
