//! The limits of a watch, compared with numbers that were computed from noise, levels and rig without this code.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use super::const_math::{logarithm, share};
use super::*;
use crate::parameters::Levels;

fn near(name: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-5 * expected.abs(), "{name}: {found:e}, not {expected:e}");
}

fn put(
    p: &Parameters,
    protection: &ProtectionParameters,
    watch: &PlausibilityParameters,
) -> Result<Plausibility<f64, 21>, ConfigError> {
    let mut place = None;
    Plausibility::<f64, 21>::make_in(&mut place, p, protection, watch)?;
    Ok(place.unwrap())
}

#[test]
fn functions_in_constants_are_those_of_the_library() {
    for value in [1.0001, 1.9, 2.1, 1e3, 4e10, 1e300] {
        let (found, sound) = (logarithm(value), libm::log(value));
        assert!(found >= sound && found < sound + core::f64::consts::LN_2, "{value}: {found}");
    }
    for square in [1.0, 2.0, 49.9, 1e4] {
        near("root", root(square), libm::sqrt(square));
    }
    for power in [0.0, -0.3, -0.5, -0.6, -2.0, -24.9, -60.0] {
        near("exponential", exponential(power), libm::exp(power));
    }
    // The coefficient of a low-pass of 80 Hz at 4096 Hz is 11.6 %; for a corner beyond the rate it is 1.
    near("share", share(80.0, 4096.0), 0.1156239);
    assert_eq!(share(4096.0, 4096.0).to_bits(), 1.0_f64.to_bits());
}

#[test]
fn the_gate_of_a_displacement_that_shows_the_velocity_is_as_wide_as_noise_and_acceleration() {
    // Noise of 63.5 µm, and 1.5 times 1.2 m/s · 10 Hz/60 Hz/4096 Hz.
    let estimated =
        Parameters { velocity_source: VelocitySource::Derivative { corner: 80.0 }, ..Parameters::ZHAO2005 };
    let to = |trip: f64| Levels { warning: trip, trip };
    for (trip, jump) in [(0.115, 6.698712e-04), (0.3, 6.698712e-04), (f64::INFINITY, f32::MAX.into())] {
        let protection = ProtectionParameters {
            displacement: to(trip),
            velocity: to(1.2),
            ..ProtectionParameters::DEFAULT
        };
        let watch = put(&estimated, &protection, &PlausibilityParameters::DEFAULT).unwrap();
        near("near", watch.gate.displacement_tolerance, jump);
        near("bend", watch.gate.tolerance_growth, 7.324219e-05);
        // The area's square over compressibility and rate.
        near("kick", watch.force_jump, 2.177791e+04);
        // After the velocity's sensor has failed as well.
        let with_sensor = put(&Parameters::ZHAO2005, &protection, &PlausibilityParameters::DEFAULT).unwrap();
        assert_eq!(with_sensor.gate, watch.gate);
        assert_eq!(with_sensor.force_jump.to_bits(), 0);
    }
}

#[test]
fn a_sensor_that_jumped_must_agree_for_half_of_the_lost_samples_and_one_more() {
    for (lost_samples, expected) in [(0, 1), (3, 2), (10, 6), (100_000, 50_001)] {
        let protection = ProtectionParameters { lost_samples, ..ProtectionParameters::DEFAULT };
        let watch = put(&Parameters::ZHAO2005, &protection, &PlausibilityParameters::DEFAULT).unwrap();
        assert_eq!(watch.gate.confirmations, expected, "{lost_samples}");
    }
}

#[test]
fn the_levels_of_the_papers_rig_and_its_noise_make_these_limits() {
    // Noise of 78 N, 63.5 µm, 0.525 mm/s and 0.05 %, with one false alarm in a thousand hours at 4096 Hz. Four signals
    // have 2^36 readings in this time, so the exponent is 36·ln 2 = 24.953, which means 7.064 deviations.
    let to = |trip: f64| Levels { warning: trip, trip };
    let protection = ProtectionParameters {
        force: to(20e3),
        displacement: to(0.115),
        velocity: to(1.2),
        spool: to(0.8),
        ..ProtectionParameters::DEFAULT
    };
    let watch = put(&Parameters::ZHAO2005, &protection, &PlausibilityParameters::DEFAULT).unwrap();
    let Plausibility { balance, motion, stroke, following, zero_force: zero, .. } = watch;
    let all = [
        ("jumps", &watch.gate.tolerance[..], &[925.8231, 5.888863e-3, 2.334053e-2, 4.151340e-2][..]),
        ("still", &watch.gate.still_change, &[7.8, 6.35e-6, 5.25e-5, 5e-5]),
        ("friction", &[watch.gate.friction_jump, watch.gate.reversal_velocity], &[1560.28, 0.06]),
        ("gate", &[watch.gate.liveliness_gain, watch.gate.slope_gain], &[1.532805e-3, 8.798962e-2]),
        ("chance", &[watch.gate.still_probability], &[1.455192e-11]),
        ("oil", &[watch.leakage, watch.oil], &[1.583049e-9, 9.206040e-11]),
        ("shares", &[watch.low_gain, balance.high, watch.ratio_gain], &[0.1156239, 2.274800e-2, 2.274800e-2]),
        ("valve", &[stroke.lag, watch.spool_gain, watch.valve_gain], &[8.517888e-2, 7.640603e-3, 0.1]),
        ("decays", &[balance.fast_decay, watch.decay, following.fade], &[0.9975486, 0.9984672, 0.9534451]),
        ("flow's drifts", &[balance.drift, balance.fast_drift], &[4.419913e-4, 8.804801e-6]),
        ("flow's limits", &[balance.slow, balance.fast], &[2.668963e-5, 1.524783e-7]),
        ("turned", &[balance.wrong_sign, balance.null_drift], &[4.474831e-8, 1.757349e-4]),
        ("motion's drifts", &[motion.drift, motion.ratio_drift], &[1.600741e-4, 2.467811e-04]),
        ("motion's limits", &[motion.travel, motion.ratio], &[3.180331e-4, 1.910331e-4]),
        ("stroke's drifts", &[stroke.drift, stroke.against_drift], &[3.015245e-2, 1.524515e-4]),
        ("stroke's limits", &[stroke.difference, stroke.against], &[2.0e-3, 6e-4]),
        ("of velocity", &[watch.per_reversal, motion.latency], &[83.33333, 2e-3]),
        ("wrong sign", &[watch.reversal.slow, watch.reversal.limit], &[5.349941e-02, 2.123337e-04]),
        ("its drift", &[watch.reversal.drift], &[1.337485e-02]),
        ("force of zero", &[zero.offset, zero.noise, zero.change], &[8.767461e+02, 96.60610, 966.0610]),
        ("its motion", &[zero.path, zero.time, zero.mean_gain], &[3.175e-4, 0.012, 9.812660e-04]),
        ("force", &[watch.force_error_limit, watch.changes[0], watch.changes[1]], &[3780.0, 1180.0, 6.35e-4]),
        ("rates", &[watch.rate, watch.period, watch.area], &[4096.0, 2.44140625e-4, 8.212e-3]),
    ];
    for (name, found, expected) in all {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            near(name, *found, *expected);
        }
    }
    assert_eq!((watch.repeats, watch.lost_samples, watch.senses_velocity), (12, 10, true));
}

#[test]
fn a_sensor_and_an_accelerometer_show_fast_motions_without_the_displacement() {
    let gains = [0.01, 1.0, 10.0];
    for (velocity_source, fast_velocity) in [
        (VelocitySource::Sensor, true),
        (VelocitySource::Accelerometer { gains }, true),
        (VelocitySource::Observer { gains, mass: 7e3 }, false),
        (VelocitySource::Derivative { corner: 40.0 }, false),
    ] {
        let rig = Parameters { velocity_source, ..Parameters::ZHAO2005 };
        let watch = put(&rig, &ProtectionParameters::DEFAULT, &PlausibilityParameters::DEFAULT).unwrap();
        assert_eq!(watch.fast_velocity, fast_velocity, "{velocity_source:?}");
    }
}

#[test]
fn without_levels_capacity_and_greatest_flow_stand_in() {
    // At 300 Hz, the controller three samples late; a million alarms an hour.
    let rig = Parameters {
        sample_rate: 300.0,
        computation_delay: 3,
        velocity_source: VelocitySource::Derivative { corner: 40.0 },
        ..Parameters::ZHAO2005
    };
    let noise = PlausibilityParameters { false_alarms: 1e6, ..PlausibilityParameters::DEFAULT };
    let watch = put(&rig, &ProtectionParameters::DEFAULT, &noise).unwrap();
    // 3·ln 2 = 2.079; the displacement's gate is open.
    for (name, found, expected) in [
        ("jump of the force", watch.gate.tolerance[0], 5.501823e4),
        ("of the velocity", watch.gate.tolerance[2], 0.2255218),
        ("of the spool", watch.gate.tolerance[3], 0.6296747),
        ("chance", watch.gate.still_probability, 0.125),
        ("lag", watch.stroke.lag, 0.2666667),
        ("fade", watch.following.fade, 0.6),
        ("drift", watch.balance.drift, 4.808226e-4),
        ("limit", watch.balance.slow, 2.570526e-5),
        ("astray", watch.force_error_limit, 2.418420e4),
    ] {
        near(name, found, expected);
    }
    assert!(watch.gate.tolerance[1] >= f64::from(f32::MAX));
    // At least eight samples, and the delay.
    assert_eq!((watch.repeats, watch.senses_velocity), (11, false));
    // Almost every reading may raise an alarm, so the limit is about one deviation.
    let coarse =
        put(&Parameters { sample_rate: 60.0, ..rig }, &ProtectionParameters::DEFAULT, &noise).unwrap();
    near("chance", coarse.gate.still_probability, libm::exp(-1.0));
}

#[test]
fn what_is_out_of_range_is_named() {
    let sound = PlausibilityParameters::DEFAULT;
    let named = |watch: PlausibilityParameters| match put(
        &Parameters::ZHAO2005,
        &ProtectionParameters::DEFAULT,
        &watch,
    ) {
        Err(ConfigError::NotFinite { parameter } | ConfigError::OutOfRange { parameter, .. }) => parameter,
        Err(_) => "something else",
        Ok(_) => "nothing",
    };
    assert_eq!(named(sound), "nothing");
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(named(PlausibilityParameters { force_noise: bad, ..sound }), "force_noise");
        assert_eq!(named(PlausibilityParameters { velocity_noise: bad, ..sound }), "velocity_noise");
        assert_eq!(named(PlausibilityParameters { spool_noise: bad, ..sound }), "spool_noise");
        assert_eq!(named(PlausibilityParameters { false_alarms: bad, ..sound }), "false_alarms");
        let watch = PlausibilityParameters { load_pressure_tolerance: bad, ..sound };
        assert_eq!(named(watch), "load_pressure_tolerance");
    }
    // Without noise of the displacement every rounding error would be a contradiction.
    for bad in [-1.0, 0.0, f64::NAN, 1.1] {
        assert_eq!(named(PlausibilityParameters { displacement_noise: bad, ..sound }), "displacement_noise");
    }
}

#[test]
fn a_load_pressure_may_differ_by_its_tolerance_and_four_deviations_for_half_a_millisecond() {
    let watch = PlausibilityParameters {
        load_pressure_tolerance: 500.0,
        force_noise: 50.0,
        ..PlausibilityParameters::DEFAULT
    };
    let watch = put(&Parameters::ZHAO2005, &ProtectionParameters::DEFAULT, &watch).unwrap();
    let pressure = watch.load_pressure.unwrap();
    near("tolerance", pressure.tolerance, 700.0);
    near("limit", pressure.limit, 0.35);
    // 56 % of the gate for noise of 50 N over the area, and for a swing of the supply pressure at 30 Hz.
    near("jump", pressure.jump, 521_682.77);
    near("still", pressure.still, 608.865_08);
    near("samples of a delay of half a millisecond", pressure.latency, 2.048);
    near("area", pressure.area, 8.212e-3);
    for unlimited in [LARGEST, 2.0 * LARGEST] {
        let watch =
            PlausibilityParameters { load_pressure_tolerance: unlimited, ..PlausibilityParameters::DEFAULT };
        assert!(
            put(&Parameters::ZHAO2005, &ProtectionParameters::DEFAULT, &watch)
                .unwrap()
                .load_pressure
                .is_none()
        );
    }
}

#[test]
fn a_load_cell_without_noise_is_left_to_the_repetitions() {
    let watch = PlausibilityParameters { force_noise: 0.0, ..PlausibilityParameters::DEFAULT };
    let zero = put(&Parameters::ZHAO2005, &ProtectionParameters::DEFAULT, &watch).unwrap().zero_force;
    // Half a per cent of the capacity; no change is small enough.
    near("offset", zero.offset, 780.14);
    assert!(zero.noise < 0.0);
}
