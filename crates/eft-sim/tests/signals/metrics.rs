//! A metric is a finite number, an error or undefined for any signals.

use eft_sim::metrics::{self, Metrics};
use proptest::prelude::*;

const ALWAYS_DEFINED: [&str; 3] = ["nrmse", "peak_error", "tracking_indicator"];

fn signal(length: std::ops::Range<usize>) -> impl Strategy<Value = Vec<f64>> {
    prop_oneof![
        proptest::collection::vec(-1e4..1e4_f64, length.clone()),
        proptest::collection::vec(prop_oneof![Just(0.0), Just(1.0), Just(-1.0)], length.clone()),
        proptest::collection::vec(any::<f64>(), length),
    ]
}

proptest! {
    #[test]
    fn no_metric_is_infinite(command in signal(0..40), measured in signal(0..40), fs in any::<f64>(), band in any::<[f64; 2]>()) {
        for length in [command.len().min(measured.len()), usize::MAX] {
            let (c, m) = (&command[..length.min(command.len())], &measured[..length.min(measured.len())]);
            for fs in [fs, 100.0] {
                if let Ok(all) = Metrics::of_force(c, m, fs) {
                    for (name, value) in all.iter() {
                        let undefined = value.is_nan() && !ALWAYS_DEFINED.contains(&name);
                        prop_assert!(value.is_finite() || undefined, "{name} = {value}");
                    }
                }
                for [low, high] in [band, [0.0, 50.0]] {
                    if let Ok(ratio) = metrics::fft_ratio(c, m, fs, low, high) {
                        prop_assert!(ratio.ratio.iter().chain(&ratio.frequency).all(|v| v.is_finite()));
                    }
                }
                if let Ok(found) = metrics::coherence(c, m, fs, 4) {
                    prop_assert!(found.coherence.iter().all(|v| (0.0..=1.0).contains(v)));
                }
            }
        }
    }

    #[test]
    fn the_errors_do_not_depend_on_the_scale(command in proptest::collection::vec(-1e4..1e4_f64, 2..60), gain in 0.1..3.0_f64) {
        prop_assume!(command.iter().any(|c| c.abs() > 1.0));
        let measured: Vec<f64> = command.iter().map(|c| gain * c).collect();
        let expected = (gain - 1.0).abs();
        let metrics = Metrics::of_force(&command, &measured, 10.0).unwrap();
        let found = |name| metrics.get(name).unwrap();
        prop_assert_eq!(found("nrmse"), metrics::nrmse(&command, &measured).unwrap());
        for error in ["nrmse", "peak_error"] {
            prop_assert!((found(error) - expected).abs() < 1e-9);
        }
        prop_assert!((found("fei_amplitude") - gain).abs() < 1e-9);
    }
}
