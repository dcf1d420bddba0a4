//! The rig, the noise and the trip levels from which the limits follow, in SI units.

use super::const_math::{logarithm, root, share};
use crate::error::{ConfigError, LARGEST, SMALLEST, check, positive, range, within};
use crate::parameters::{Parameters, PlausibilityParameters, ProtectionParameters};

/// Corner (Hz) of the residuals, and of the velocity that replaces a sensor's.
pub(super) const RESIDUAL_CORNER: f64 = 80.0;

/// A trip level of each signal, or a replacement where none is configured: N, m, m/s and 1.
pub(super) struct Trips {
    pub(super) force: f64,
    pub(super) displacement: f64,
    pub(super) velocity: f64,
    pub(super) spool: f64,
}

/// The checked parameters of a watch, and what follows from several of them.
pub(super) struct Scales<'a> {
    pub(super) rig: &'a Parameters<'a>,
    /// Standard deviations of the sensors' noise.
    pub(super) noise: &'a PlausibilityParameters,
    pub(super) trip: Trips,
    /// Warning level (N) of the force; that of the trip without one, and infinite without both.
    pub(super) force_warning: f64,
    /// Whether the displacement has a trip level. Without one every reading is within reach.
    pub(super) limits_displacement: bool,
    /// Force (N) at the supply pressure.
    pub(super) capacity: f64,
    /// Flow (m³/s) of the fully open valve.
    pub(super) full_flow: f64,
    /// Logarithm of the number of readings in the time of one false alarm.
    pub(super) readings: f64,
    /// Number of standard deviations that Gaussian noise exceeds once in these readings: `P(|x| > z·σ) ≤ exp(−z²/2)`.
    pub(super) deviations: f64,
}

impl<'a> Scales<'a> {
    /// # Errors
    /// A parameter that is not finite or out of its range, by name.
    #[inline(always)]
    pub(super) const fn new(
        rig: &'a Parameters<'a>,
        protection: &ProtectionParameters,
        noise: &'a PlausibilityParameters,
    ) -> Result<Self, ConfigError> {
        let rate = check!(positive("sample_rate", rig.sample_rate));
        let area = check!(positive("piston_area", rig.piston_area));
        let capacity = area * check!(positive("supply_pressure", rig.supply_pressure));
        check!(positive("compressibility", rig.compressibility));
        check!(within("force_noise", noise.force_noise, 0.0, LARGEST));
        check!(within("displacement_noise", noise.displacement_noise, SMALLEST, 1.0));
        check!(within("velocity_noise", noise.velocity_noise, 0.0, 1e3));
        check!(within("spool_noise", noise.spool_noise, 0.0, 1.0));
        let alarm_rate = check!(within("false_alarms", noise.false_alarms, 1e-12, 1e6));
        check!(within("response_delay", rig.response_delay, 0.0, 1.0));
        check!(within("leakage", rig.leakage, 0.0, LARGEST));
        check!(range("load_pressure_tolerance", noise.load_pressure_tolerance));
        check!(positive("valve_gain", rig.valve_gain));
        let readings = logarithm(4.0 * 3600.0 * rate / alarm_rate);
        let readings = if readings > 1.0 { readings } else { 1.0 };
        let full_flow = rig.greatest_flow();
        Ok(Self {
            rig,
            noise,
            trip: Trips {
                force: level(protection.force.trip, capacity),
                // The displacement in a tenth of a second at full flow.
                displacement: level(protection.displacement.trip, 0.1 * full_flow / area),
                velocity: level(protection.velocity.trip, full_flow / area),
                spool: level(protection.spool.trip, 1.0),
            },
            force_warning: level(protection.force.warning, protection.force.trip),
            limits_displacement: protection.displacement.trip < LARGEST,
            capacity,
            full_flow,
            readings,
            deviations: root(2.0 * readings),
        })
    }

    /// Coefficient (1) of a low-pass with this corner (Hz).
    pub(super) const fn share(&self, corner: f64) -> f64 {
        share(corner, self.rig.sample_rate)
    }

    /// Angle (rad) of a frequency (Hz) in a sample.
    pub(super) const fn angle(&self, frequency: f64) -> f64 {
        core::f64::consts::TAU * frequency / self.rig.sample_rate
    }

    /// Deviations (1) that a reading's difference from its prediction exceeds by a false alarm only. The prediction has
    /// noise as well, so there is a third more.
    pub(super) const fn spread(&self) -> f64 {
        1.33 * self.deviations
    }

    /// Noise (m³/s) of the flow's residual.
    pub(super) const fn flow_noise(&self) -> f64 {
        self.rig.piston_area * self.noise.velocity_noise + self.full_flow * self.noise.spool_noise
    }

    /// Three standard deviations of white noise after the low-pass of the residuals, per deviation before it (1). The
    /// range of the sums of the remaining noise is in it.
    pub(super) const fn drift_factor(&self) -> f64 {
        let low = self.share(RESIDUAL_CORNER);
        3.0 * root(1.0 + low) * 0.75 * root(1.0 + 2.0 * low) * low
    }

    /// Range of the sum of white noise against its drift, in the noise's unit times s.
    pub(super) const fn walk(&self, noise: f64) -> f64 {
        self.readings * noise / (6.0 * self.rig.sample_rate)
    }
}

/// A trip level, or a replacement if no level is configured.
const fn level(trip: f64, scale: f64) -> f64 {
    if trip < LARGEST { trip } else { scale }
}
