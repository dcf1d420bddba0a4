//! The parameters as a list of named values with their units, for both languages.

use eft_core::{
    Learning, Levels, Mode, Parameters, PlausibilityParameters, ProtectionParameters, Realization, SignFrom,
    VelocitySource,
};

/// A parameter's value.
pub(super) enum Value<'a> {
    Number(f64),
    Count(u32),
    Switch(bool),
    /// A value of an enumeration: name of the enumeration and name of the value.
    Choice(&'static str, &'static str),
    Numbers(&'a [f64]),
    Bounds([f64; 2]),
    Velocity(VelocitySource),
    Learning(Learning),
    Protection(Option<ProtectionParameters>),
    Plausibility(Option<PlausibilityParameters>),
}

/// Name, value and unit.
pub(super) type Field<'a> = (&'static str, Value<'a>, &'static str);

/// Every parameter, in the order of the struct.
// Destructured by name, so that the compiler reports a missing new one.
pub(super) fn fields<'a>(p: &Parameters<'a>) -> Vec<Field<'a>> {
    use Value::{Choice, Count, Number, Numbers, Switch};
    let Parameters {
        sample_rate,
        realization,
        mode,
        level,
        sign_from,
        piston_area,
        supply_pressure,
        supply_correction,
        compressibility,
        leakage,
        friction,
        friction_velocity,
        overlap,
        openings,
        flows,
        flow_gain,
        valve_gain,
        response_delay,
        lead_alpha,
        velocity_source,
        velocity_delay,
        computation_delay,
        feedforward,
        look_ahead,
        force_sensitivity,
        proportional_gain,
        derivative_gain,
        integral_gain,
        valve_command,
        valve_command_rate,
        spool_warning,
        velocity_range,
        force_range,
        spool_range,
        gap_time,
        learning,
        protection,
        stuck_samples,
    } = *p;
    let realization = match realization {
        Realization::Digital => "Digital",
        Realization::Analog => "Analog",
    };
    let mode = match mode {
        Mode::Off => "Off",
        Mode::Linear => "Linear",
        Mode::Nonlinear => "Nonlinear",
    };
    let sign_from = match sign_from {
        SignFrom::Spool => "Spool",
        SignFrom::Demand => "Demand",
    };
    vec![
        ("sample_rate", Number(sample_rate), "Hz"),
        ("realization", Choice("Realization", realization), ""),
        ("mode", Choice("Mode", mode), ""),
        ("level", Number(level), "1"),
        ("sign_from", Choice("SignFrom", sign_from), ""),
        ("piston_area", Number(piston_area), "m2"),
        ("supply_pressure", Number(supply_pressure), "Pa"),
        ("supply_correction", Switch(supply_correction), ""),
        ("compressibility", Number(compressibility), "m3/Pa"),
        ("leakage", Number(leakage), "m3/(s Pa)"),
        ("friction", Number(friction), "N"),
        ("friction_velocity", Number(friction_velocity), "m/s"),
        ("overlap", Number(overlap), "1"),
        ("openings", Numbers(openings), "1"),
        ("flows", Numbers(flows), "m3/s"),
        ("flow_gain", Number(flow_gain), "m3/s"),
        ("valve_gain", Number(valve_gain), "1/V"),
        ("response_delay", Number(response_delay), "s"),
        ("lead_alpha", Number(lead_alpha), "1"),
        ("velocity_source", Value::Velocity(velocity_source), ""),
        ("velocity_delay", Number(velocity_delay), "s"),
        ("computation_delay", Count(computation_delay), "samples"),
        ("feedforward", Switch(feedforward), ""),
        ("look_ahead", Switch(look_ahead), ""),
        ("force_sensitivity", Number(force_sensitivity), "V/N"),
        ("proportional_gain", Number(proportional_gain), "V/V"),
        ("derivative_gain", Number(derivative_gain), "s"),
        ("integral_gain", Number(integral_gain), "1/s"),
        ("valve_command", Number(valve_command), "V"),
        ("valve_command_rate", Number(valve_command_rate), "V/s"),
        ("spool_warning", Number(spool_warning), "1"),
        ("velocity_range", Number(velocity_range), "m/s"),
        ("force_range", Number(force_range), "N"),
        ("spool_range", Number(spool_range), "1"),
        ("gap_time", Number(gap_time), "s"),
        ("learning", Value::Learning(learning), ""),
        ("protection", Value::Protection(protection), ""),
        ("stuck_samples", Count(stuck_samples), "samples"),
    ]
}

/// The parameters of learning.
pub(super) fn learning(l: &Learning) -> Vec<Field<'static>> {
    use Value::{Bounds, Number, Switch};
    let Learning {
        adaptive,
        curve_correction,
        guard,
        excitation,
        flow_gain_bounds,
        valve_gain_bounds,
        response_delay_bounds,
        age_limit,
    } = *l;
    vec![
        ("adaptive", Switch(adaptive), ""),
        ("curve_correction", Switch(curve_correction), ""),
        ("guard", Switch(guard), ""),
        ("excitation", Number(excitation), "1"),
        ("flow_gain_bounds", Bounds(flow_gain_bounds), "1"),
        ("valve_gain_bounds", Bounds(valve_gain_bounds), "1"),
        ("response_delay_bounds", Bounds(response_delay_bounds), "1"),
        ("age_limit", Number(age_limit), "s"),
    ]
}

/// A protection's levels by signal, with their unit.
pub(super) fn levels(p: &ProtectionParameters) -> [(&'static str, Levels, &'static str); 4] {
    [
        ("force", p.force, "N"),
        ("displacement", p.displacement, "m"),
        ("velocity", p.velocity, "m/s"),
        ("spool", p.spool, "1"),
    ]
}

/// The other parameters of a protection.
pub(super) fn protection(p: &ProtectionParameters) -> Vec<Field<'static>> {
    use Value::{Count, Number};
    let ProtectionParameters {
        force: _,
        displacement: _,
        velocity: _,
        spool: _,
        start_time,
        ramp_time,
        shutdown_time,
        lost_samples,
        fault_time,
        period_tolerance,
        oscillation_limit,
        plausibility,
    } = *p;
    vec![
        ("start_time", Number(start_time), "s"),
        ("ramp_time", Number(ramp_time), "s"),
        ("shutdown_time", Number(shutdown_time), "s"),
        ("lost_samples", Count(lost_samples), "samples"),
        ("fault_time", Number(fault_time), "s"),
        ("period_tolerance", Number(period_tolerance), "1"),
        ("oscillation_limit", Number(oscillation_limit), "N"),
        ("plausibility", Value::Plausibility(plausibility), ""),
    ]
}

/// The parameters of a plausibility check.
pub(super) fn plausibility(p: &PlausibilityParameters) -> Vec<Field<'static>> {
    use Value::Number;
    let PlausibilityParameters {
        force_noise,
        displacement_noise,
        velocity_noise,
        spool_noise,
        load_pressure_tolerance,
        false_alarms,
        settle_time,
    } = *p;
    vec![
        ("force_noise", Number(force_noise), "N"),
        ("displacement_noise", Number(displacement_noise), "m"),
        ("velocity_noise", Number(velocity_noise), "m/s"),
        ("spool_noise", Number(spool_noise), "1"),
        ("load_pressure_tolerance", Number(load_pressure_tolerance), "N"),
        ("false_alarms", Number(false_alarms), "1/h"),
        ("settle_time", Number(settle_time), "s"),
    ]
}

/// A number that both languages read back exactly; `none` for an infinite limit.
pub(super) fn number(value: f64, none: &str) -> String {
    if value < f64::MAX { format!("{value:?}") } else { none.to_owned() }
}

pub(super) fn list(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(", ")
}
