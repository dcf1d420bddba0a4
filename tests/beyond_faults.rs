//! Sensors that fail for a moment, wherever in a test: what was learned before stands again soon after.

mod beyond;

use beyond::*;
use eft::core::status;
use eft::sim::excitation::Command;

/// Farthest that a trace departs from what it was at `from`, between two of its samples.
fn moved(trace: &[f64], from: usize, [start, end]: [usize; 2]) -> f64 {
    trace[start..end].iter().fold(0.0_f64, |most, v| most.max((v - trace[from]).abs()))
}

// At and around resonance, where a flow gain that is led astray would cost most.
#[test]
fn a_moment_s_fault_is_forgotten() {
    for signal in ["velocity", "spool", "force"] {
        for kind in ["lost", "zero", "stuck", "sign"] {
            for (amplitude, start, duration) in
                [(2200.0, 4.7, 0.5), (2200.0, 5.1, 0.5), (8900.0, 5.3, 0.5), (8900.0, 6.0, 0.05)]
            {
                let fault = [
                    set("sensors.fault.signal", signal),
                    set("sensors.fault.kind", kind),
                    set("sensors.fault.start", start),
                    set("sensors.fault.duration", duration),
                ];
                let at = |seconds: f64| (seconds * RATE) as usize;
                let values = sweep(amplitude).values[..at(start + 8.0)].to_vec();
                let run = run(&adaptive(&fault), &Command { values, sample_rate: RATE });
                let (before, settled, end) = (at(start), at(start + 3.0), run.force.len());
                let gain = moved(&run.flow_gain_estimate, before, [settled, end]);
                let delay = moved(&run.response_delay_estimate, before, [settled, end]);
                let what = format!("{signal} {kind}, {amplitude} N, {start} s, {duration} s");
                println!("{what}: gain {gain:.4}, delay {delay:.2e}");
                // The force itself is out of control without its sensor, and swings on for a while.
                let (most_gain, most_delay) = if signal == "force" { (0.02, 2e-3) } else { (0.01, 5e-4) };
                assert!(gain < most_gain, "{what}: gain {gain}");
                assert!(delay < most_delay, "{what}: delay {delay}");
            }
        }
    }
}

// Longer than the means are held for: they are wrong then, and must come back.
#[test]
fn learning_goes_on_after_a_long_fault() {
    for signal in ["velocity", "spool"] {
        let fault = [
            set("sensors.fault.signal", signal),
            set("sensors.fault.kind", "stuck"),
            set("sensors.fault.start", 8.3),
            set("sensors.fault.duration", 6.0),
        ];
        let run = run(&adaptive(&[fault.to_vec(), vec![flow_gain(0.95)]].concat()), &sweep(2200.0));
        let end = run.force.len();
        let frozen = |from: usize| run.status[from..].iter().any(|s| s & status::ADAPTATION_FROZEN != 0);
        assert!(frozen(10 * 4096) && !frozen(end - 8 * 4096), "{signal}");
        let gain = run.flow_gain_estimate[end - 1];
        assert!((gain - 0.95).abs() < 0.01, "{signal}: {gain}");
    }
}

#[test]
fn samples_lost_now_and_then_cost_little() {
    let lossy = ["force", "velocity", "spool"].map(|signal| set(&format!("sensors.{signal}.dropout"), 1e-3));
    let run = run(&adaptive(&[lossy.to_vec(), vec![flow_gain(0.95)]].concat()), &sweep(8900.0));
    assert!(error(&run) < 0.01, "{}", error(&run));
    assert_within("lost samples", ratio(&run, 0.5, 9.5), 0.97, 1.03);
}

#[test]
fn an_offset_of_the_velocity_gives_the_guard_no_voice() {
    let rest = vec![0.0; 20 * 4096];
    let command = Command { values: [rest, sweep(8900.0).values].concat(), sample_rate: RATE };
    let run = run(&adaptive(&[set("sensors.velocity.bias", 1e-3)]), &command);
    assert!(run.level.iter().all(|level| *level > 0.99));
}
