//! The rig, the noise and the trip levels from which the limits follow, in SI units.

use super::const_math::{logarithm, root, share};
use crate::compensation::null_bias;
use crate::error::{ConfigError, LARGEST, SMALLEST, check, positive, range, within};
use crate::parameters::{Parameters, PlausibilityParameters, ProtectionParameters, VelocitySource};

/// Corner (Hz) of the residuals, and of the velocity that replaces a sensor's.
pub(super) const RESIDUAL_CORNER: f64 = 80.0;

/// A value of each signal: N, m, m/s and 1.
pub(super) struct Signals {
    pub(super) force: f64,
    pub(super) displacement: f64,
    pub(super) velocity: f64,
    pub(super) spool: f64,
}

/// The checked parameters of a watch.
pub(super) struct Scales {
    /// Sample rate (Hz).
    pub(super) rate: f64,
    /// Piston area (m²), and its capacity (N) at the supply pressure.
    pub(super) area: f64,
    pub(super) capacity: f64,
    /// Compressibility (m⁵/N), and leakage (m³/s per N) over the area.
    pub(super) compressibility: f64,
    pub(super) leakage: f64,
    /// Flow (m³/s) of the fully open valve, its gain (1/V), known null bias (1) and response delay (s).
    pub(super) full_flow: f64,
    pub(super) valve_gain: f64,
    pub(super) null_bias: f64,
    pub(super) response_delay: f64,
    /// In samples.
    pub(super) computation_delay: f64,
    /// Standard deviation of the sensors' noise.
    pub(super) noise: Signals,
    /// Trip levels, each with a replacement where none is configured.
    pub(super) trip: Signals,
    /// Warning level (N) of the force; that of the trip without one, and infinite without both.
    pub(super) force_warning: f64,
    /// Whether the displacement has a trip level. Without one every reading is within reach.
    pub(super) limits_displacement: bool,
    pub(super) senses_velocity: bool,
    /// Difference (N) of force and load pressure; at least [`LARGEST`] without a measured pressure.
    pub(super) load_pressure_tolerance: f64,
    /// Logarithm of the number of readings in the time of one false alarm.
    pub(super) readings: f64,
    /// Number of standard deviations that Gaussian noise exceeds once in these readings: `P(|x| > z·σ) ≤ exp(−z²/2)`.
    pub(super) deviations: f64,
}

impl Scales {
    /// # Errors
    /// A parameter that is not finite or out of its range, by name.
    pub(super) const fn new(
        p: &Parameters,
        protection: &ProtectionParameters,
        watch: &PlausibilityParameters,
    ) -> Result<Self, ConfigError> {
        let rate = check!(positive("sample_rate", p.sample_rate));
        let area = check!(positive("piston_area", p.piston_area));
        let pressure = check!(positive("supply_pressure", p.supply_pressure));
        let compressibility = check!(positive("compressibility", p.compressibility));
        let noise = Signals {
            force: check!(within("force_noise", watch.force_noise, 0.0, LARGEST)),
            displacement: check!(within("displacement_noise", watch.displacement_noise, SMALLEST, 1.0)),
            velocity: check!(within("velocity_noise", watch.velocity_noise, 0.0, 1e3)),
            spool: check!(within("spool_noise", watch.spool_noise, 0.0, 1.0)),
        };
        let alarm_rate = check!(within("false_alarms", watch.false_alarms, 1e-12, 1e6));
        let readings = logarithm(4.0 * 3600.0 * rate / alarm_rate);
        let readings = if readings > 1.0 { readings } else { 1.0 };
        let full_flow = p.greatest_flow();
        let capacity = area * pressure;
        Ok(Self {
            rate,
            area,
            capacity,
            compressibility,
            leakage: check!(within("leakage", p.leakage, 0.0, LARGEST)) / area,
            full_flow,
            valve_gain: check!(positive("valve_gain", p.valve_gain)),
            null_bias: check!(null_bias(p)),
            response_delay: check!(within("response_delay", p.response_delay, 0.0, 1.0)),
            computation_delay: p.computation_delay as f64,
            noise,
            trip: Signals {
                force: level(protection.force.trip, capacity),
                // The displacement in a tenth of a second at full flow.
                displacement: level(protection.displacement.trip, 0.1 * full_flow / area),
                velocity: level(protection.velocity.trip, full_flow / area),
                spool: level(protection.spool.trip, 1.0),
            },
            force_warning: level(protection.force.warning, protection.force.trip),
            limits_displacement: protection.displacement.trip < LARGEST,
            senses_velocity: matches!(p.velocity_source, VelocitySource::Sensor),
            load_pressure_tolerance: check!(range("load_pressure_tolerance", watch.load_pressure_tolerance)),
            readings,
            deviations: root(2.0 * readings),
        })
    }

    /// Coefficient (1) of a low-pass with this corner (Hz).
    pub(super) const fn share(&self, corner: f64) -> f64 {
        share(corner, self.rate)
    }

    /// Angle (rad) of a frequency (Hz) in a sample.
    pub(super) const fn angle(&self, frequency: f64) -> f64 {
        core::f64::consts::TAU * frequency / self.rate
    }

    /// Deviations (1) that a reading's difference from its prediction exceeds by a false alarm only. The prediction has noise
    /// as well, so there is a third more.
    pub(super) const fn spread(&self) -> f64 {
        1.33 * self.deviations
    }

    /// Noise (m³/s) of the flow's residual.
    pub(super) const fn flow_noise(&self) -> f64 {
        self.area * self.noise.velocity + self.full_flow * self.noise.spool
    }

    /// Three standard deviations of white noise after the low-pass of the residuals, per deviation before it (1). The range of
    /// the sums of the remaining noise is in it.
    pub(super) const fn drift_factor(&self) -> f64 {
        let low = self.share(RESIDUAL_CORNER);
        3.0 * root(1.0 + low) * 0.75 * root(1.0 + 2.0 * low) * low
    }

    /// Range of the sum of white noise against its drift, in the noise's unit times s.
    pub(super) const fn walk(&self, noise: f64) -> f64 {
        self.readings * noise / (6.0 * self.rate)
    }
}

/// A trip level, or a replacement if no level is configured.
const fn level(trip: f64, scale: f64) -> f64 {
    if trip < LARGEST { trip } else { scale }
}
