//! Sensors that fail in the middle of a run. The output stays finite and within its limit, and a flag reports the
//! fault. The first good sample continues with the same state and output as without the bad samples.

use eft_core::{Input, StuckWatch, StuckWatchState, status};
use eft_rigs::uneven::{CHANNEL, PARAMETERS};

/// The rig's largest valve command (V).
const LIMIT: f32 = 8.0;
/// Repeated samples before a sensor counts as stuck.
const REPEATS: u32 = 5;
const CHANNELS: usize = 4;

/// How a sensor fails.
#[derive(Clone, Copy)]
enum Fault {
    /// It reads this number.
    Reads(f32),
    /// It repeats its last reading.
    Stuck,
}

/// A smooth run: command (N), velocity (m/s), force (N), spool (1), turning by a small angle each sample.
struct Run {
    cos: f32,
    sin: f32,
}

impl Run {
    fn next(&mut self) -> [f32; CHANNELS] {
        const STEP: (f32, f32) = (0.999_8, 0.019_998_67);
        (self.cos, self.sin) = (self.cos * STEP.0 - self.sin * STEP.1, self.cos * STEP.1 + self.sin * STEP.0);
        [8.0e3 * self.sin, 0.3 * self.cos, 7.5e3 * self.sin, 0.2 * self.cos]
    }
}

/// The number of faults that were injected, or the error.
pub fn run() -> Result<u32, &'static str> {
    let range = [
        f32::MAX,
        PARAMETERS.velocity_range as f32,
        PARAMETERS.force_range as f32,
        PARAMETERS.spool_range as f32,
    ];
    let mut count = 0;
    for (channel, range) in range.into_iter().enumerate() {
        let beyond = range.next_up();
        for fault in [
            Fault::Reads(f32::NAN),
            Fault::Reads(f32::from_bits(0xff80_0001)),
            Fault::Reads(f32::INFINITY),
            Fault::Reads(f32::NEG_INFINITY),
            Fault::Reads(beyond),
            Fault::Reads(-beyond),
            Fault::Reads(-f32::MAX),
            Fault::Stuck,
        ] {
            // A constant command is not a fault.
            if channel > 0 || matches!(fault, Fault::Reads(_)) {
                survive(channel, fault)?;
                count += 1;
            }
        }
    }
    Ok(count)
}

fn survive(channel: usize, fault: Fault) -> Result<(), &'static str> {
    let watch = StuckWatch::new(REPEATS).map_err(|_| "watch refused")?;
    let (mut state, mut watched) = (CHANNEL.at_rest(), StuckWatchState::default());
    // The second channel never gets a refused sample.
    let mut twin = CHANNEL.at_rest();
    let mut run = Run { cos: 1.0, sin: 0.0 };
    let mut last = [0.0; CHANNELS];
    for n in 0..2000 {
        let sample = run.next();
        // The fault lasts for eleven samples in the middle of the run.
        let failing = (1000..1011).contains(&n);
        let mut read = sample;
        if failing && let Some(reading) = read.get_mut(channel) {
            *reading = match fault {
                Fault::Reads(value) => value,
                Fault::Stuck => last.get(channel).copied().unwrap_or(0.0),
            };
        }
        last = read;
        let [command, velocity, force, spool] = read;
        let input = Input { command, velocity, force, spool, ..Input::default() };
        let stuck = watch.step(&mut watched, velocity, force, spool);
        let before = state;
        let out = if stuck == 0 { CHANNEL.step(&mut state, &input) } else { CHANNEL.hold(&state) };
        let status = out.status | stuck;
        if !(out.voltage.abs() <= LIMIT) || !out.compensation.is_finite() {
            return Err("faults: an output beyond its limit");
        }
        let bad = status::INVALID_MEASUREMENT | status::INVALID_COMMAND | status::STUCK_MEASUREMENT;
        // A stuck sensor reads plausibly until it has repeated itself too often.
        let noticed = failing && (matches!(fault, Fault::Reads(_)) || n >= 1000 + REPEATS - 1);
        if noticed != (status & bad != 0) {
            return Err(if noticed { "faults: no flag" } else { "faults: a flag without a fault" });
        }
        if noticed {
            if out.voltage.to_bits() != CHANNEL.hold(&before).voltage.to_bits() {
                return Err("faults: the output was not held");
            }
        } else {
            let expected = CHANNEL.step(&mut twin, &input);
            if twin != state || expected.voltage.to_bits() != out.voltage.to_bits() {
                return Err("faults: a good sample did not continue");
            }
        }
    }
    Ok(())
}
