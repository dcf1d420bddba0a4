//! Times and rates of the learner, in seconds, at several sample rates.

use super::*;

#[test]
fn times_and_rates_do_not_depend_on_the_sample_rate() {
    let learning = Learning { curve_correction: true, guard: true, ..Learning::ADAPTIVE };
    for sample_rate in [512.0, 4096.0, 20_000.0] {
        let p = Parameters { sample_rate, learning, ..Parameters::ZHAO2005 };
        let learner = Learner::<f64, 21>::new(&p).unwrap();
        let Learner { gate, curve, guard, filter, .. } = &learner;
        let period = gate.period;
        // The time constant of a low-pass, of which the coefficient by Tustin's rule contains half a step.
        let time = |share: f64| period / share - 0.5 * period;
        let hertz = |share: f64| 1.0 / (core::f64::consts::TAU * time(share));
        for (what, found, expected) in [
            ("shortest memory (s)", period / gate.forgotten, 0.25),
            ("memory of the directions (s)", period / gate.forgotten / curve.forgotten, 5.0),
            ("average of the gate (s)", time(gate.average), 0.03),
            ("time of a rate of opening (s)", libm::sqrt(gate.change_weight) * period, 0.1),
            ("low-passes (Hz)", hertz(filter.low_pass), 13.0),
            ("high-pass (Hz)", hertz(filter.high_pass), 0.1),
            ("average of the curve's errors (s)", period / curve.average, 4.0),
            ("duration of a curve's error (s)", period * curve.correlation, 0.12),
            ("rate of the asymmetry (1/s)", curve.change / period, 1.0),
            ("rate of the null offset (1/s)", curve.null_change / period, 0.1),
            ("drift of a node (1/√s)", libm::sqrt(curve.drift / period), 0.016),
            ("low-passes of the guard (Hz)", hertz(guard.low_pass), 4.0),
            ("average of the guard (s)", time(guard.average), 0.2),
            ("slow average of the guard (s)", time(guard.slow_average), 0.8),
            ("time of the guard (s)", period / guard.correction, 0.33),
            ("quiet velocity of the guard (m/s)", libm::sqrt(guard.quiet), 5e-3),
            ("rate of the flow gain (1/s)", learner.flow.priors.gain.change / period, 0.5),
            ("rate of the valve gain (1/s)", learner.valve.priors.gain.change / period, 0.2),
            // Twice the configured response delay.
            ("rate of the velocity's delay (1)", learner.flow.priors.delay.change / period, 0.01),
            ("rate of the response delay (1)", learner.valve.priors.delay.change / period, 0.01),
        ] {
            let off = (found / expected - 1.0).abs();
            assert!(off < 1e-9, "{sample_rate} Hz, {what}: {found}, not {expected}");
        }
        for (windows, time) in [(gate.hold_off, 0.5), (gate.settling, 0.1), (learner.checkpoint_windows, 0.2)]
        {
            let later = f64::from(windows) * period - time;
            assert!((-1e-12..period).contains(&later), "{sample_rate} Hz: {windows} windows for {time} s");
        }
    }
}
