//! The table of the metrics of a test, and the values of one actuator.

/// One line of the [table](METRICS).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metric {
    /// Its name in Rust, in Python and in files.
    pub name: &'static str,
    /// Its SI unit; empty for a dimensionless metric.
    pub unit: &'static str,
    /// Description.
    pub doc: &'static str,
    /// Whether it needs Fourier transforms or the ideal response, and so longer than the test.
    pub costly: bool,
}

const fn quick(name: &'static str, unit: &'static str, doc: &'static str) -> Metric {
    Metric { name, unit, doc, costly: false }
}

const fn costly(name: &'static str, unit: &'static str, doc: &'static str) -> Metric {
    Metric { name, unit, doc, costly: true }
}

/// Every metric of a test, in the order of tables and files.
pub const METRICS: [Metric; 14] = [
    quick("nrmse", "", "rms force error over rms command"),
    costly("nrmse_delay_removed", "", "the same without the delay"),
    quick("nrmse_bias_free", "", "the same without the offset"),
    quick("peak_error", "", "largest force error over the largest command"),
    costly("delay", "s", "delay of the force by cross-correlation, positive when it lags"),
    costly("fei_amplitude", "", "amplitude of the frequency-domain evaluation index"),
    costly("fei_delay", "s", "delay of the frequency-domain evaluation index"),
    costly("fei_frequency", "Hz", "equivalent frequency of the frequency-domain evaluation index"),
    costly("oscillation", "", "rms force error from 30 to 150 Hz, of the oil column, over rms command"),
    quick("tracking_indicator", "N²", "tracking indicator, negative when the force lags"),
    costly("displacement_error", "", "rms displacement error against the ideal response, over its rms"),
    quick("max_spool", "", "largest spool opening"),
    quick("drift", "m", "largest drift of the story"),
    quick("min_supply_pressure", "Pa", "smallest supply pressure"),
];

/// The metrics of one actuator's test, or of a force alone. They are equal if all their bits are equal; undefined
/// metrics are equal.
#[derive(Debug, Clone, Default)]
pub struct Metrics {
    /// In the order of the table; `None` if a metric was not computed, and NaN if it is undefined.
    values: [Option<f64>; METRICS.len()],
}

impl PartialEq for Metrics {
    fn eq(&self, other: &Self) -> bool {
        self.values.map(|value| value.map(f64::to_bits)) == other.values.map(|value| value.map(f64::to_bits))
    }
}

impl Metrics {
    /// All metrics undefined, with the costly ones or without.
    pub(super) fn undefined(costly: bool) -> Self {
        Self { values: METRICS.map(|metric| (costly || !metric.costly).then_some(f64::NAN)) }
    }

    /// Name and value of every computed metric; NaN for an undefined one.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64)> {
        METRICS.iter().zip(self.values).filter_map(|(metric, value)| Some((metric.name, value?)))
    }

    /// The value of one metric, NaN if it is undefined; `None` if it was not computed.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.iter().find(|(known, _)| *known == name).map(|(_, value)| value)
    }

    /// Sets a metric; NaN without a value.
    pub(super) fn set(&mut self, name: &str, value: impl Into<Option<f64>>) {
        if let Some(at) = METRICS.iter().position(|metric| metric.name == name) {
            self.values[at] = Some(value.into().unwrap_or(f64::NAN));
        }
    }

    /// Of several floors, each metric of the floor with the largest absolute value.
    pub(crate) fn worst(floors: &[Self]) -> Self {
        let of = |at: usize| floors.iter().filter_map(|floor| floor.values[at]).reduce(larger);
        Self { values: std::array::from_fn(of) }
    }
}

/// The value with the largest absolute value, in its unit, such as of the floors of a building. NaN counts as
/// unknown; without a known value the answer is NaN.
pub fn worst(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::NAN, larger)
}

fn larger(most: f64, value: f64) -> f64 {
    if most.is_nan() || value.abs() > most.abs() { value } else { most }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_value_is_the_largest_that_is_known() {
        assert_eq!(worst([1.0, f64::NAN, -3.0, 2.0]), -3.0);
        assert!(worst([f64::NAN]).is_nan() && worst([]).is_nan());
    }
}
