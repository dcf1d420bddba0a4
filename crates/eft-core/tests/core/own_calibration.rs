//! A learner accepts every calibration that it has saved, whatever its sensors gave.

use eft_core::{Channel, Input, Learner, Learning, Parameters, Realization};

use crate::rig::{self, SPECIAL};

/// Drawn numbers.
struct Draw(u64);

impl Draw {
    /// From 0 to 1.
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn within(&mut self, lowest: f64, highest: f64) -> f64 {
        lowest + (highest - lowest) * self.share()
    }

    /// Between two positive numbers, by their logarithm.
    fn decades(&mut self, lowest: f64, highest: f64) -> f64 {
        10_f64.powf(self.within(lowest.log10(), highest.log10()))
    }

    fn chance(&mut self, share: f64) -> bool {
        self.share() < share
    }
}

fn parameters(draw: &mut Draw) -> Parameters<'static> {
    let learning = Learning {
        curve_correction: draw.chance(0.7),
        excitation: draw.decades(1e-6, 1e-3),
        ..Learning::ADAPTIVE
    };
    let ranges = if draw.chance(0.5) { rig::PARAMETERS } else { Parameters::ZHAO2005 };
    Parameters {
        realization: if draw.chance(0.5) { Realization::Analog } else { Realization::Digital },
        sample_rate: draw.decades(250.0, 10_000.0),
        response_delay: draw.decades(1e-3, 2e-2),
        velocity_delay: if draw.chance(0.5) { 0.0 } else { draw.within(0.0, 5e-3) },
        null_bias: if draw.chance(0.5) { 0.0 } else { draw.within(-0.1, 0.1) },
        integral_gain: if draw.chance(0.5) { 0.0 } else { draw.within(0.0, 10.0) },
        feedforward: draw.chance(0.5),
        learning,
        ..ranges
    }
}

/// What a sensor gives of a true value.
#[derive(Clone, Copy)]
struct Sensor {
    gain: f64,
    noise: f64,
    /// Beyond it the sensor is saturated.
    range: f64,
    step: f64,
    /// Share of the samples that are no measurement.
    wild: f64,
}

impl Sensor {
    fn draw(draw: &mut Draw, range: f64) -> Self {
        if draw.chance(0.85) {
            let (gain, noise) = (draw.within(0.97, 1.03), draw.decades(1e-7, 1e-2) * range);
            return Self { gain, noise, range, step: 1e-5 * range, wild: 0.0 };
        }
        Self {
            gain: if draw.chance(0.1) { draw.within(-2.0, 2.0) } else { draw.within(0.9, 1.1) },
            noise: if draw.chance(0.3) { 0.0 } else { draw.decades(1e-6, 1.0) * range },
            range: draw.decades(0.03, 1.0) * range,
            step: if draw.chance(0.5) { draw.decades(1e-5, 0.1) * range } else { 0.0 },
            wild: if draw.chance(0.2) { draw.decades(1e-3, 0.1) } else { 0.0 },
        }
    }

    fn read(&self, draw: &mut Draw, value: f64) -> f64 {
        if draw.chance(self.wild) {
            return SPECIAL[(draw.share() * SPECIAL.len() as f64) as usize];
        }
        let value = self.gain * value + self.noise * draw.within(-1.0, 1.0);
        let value = if self.step > 0.0 { (value / self.step).round() * self.step } else { value };
        value.clamp(-self.range, self.range)
    }
}

macro_rules! tests {
    ($($name:ident $t:ty, $given:path, $cases:expr;)*) => {$(
        #[test]
        fn $name() {
            let mut learned = 0;
            for case in $cases {
                let draw = &mut Draw(case);
                let p = parameters(draw);
                let channel = Channel::<$t, 21>::new(&p).unwrap();
                let learner = Learner::<$t, 21>::new(&p).unwrap();
                let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
                let table = rig::table();
                let (amplitude, frequency) = (draw.decades(1e-4, 1.5), draw.decades(0.3, 30.0));
                let (flow_gain, valve_gain) = (draw.decades(0.8, 1.25), draw.decades(0.8, 1.25));
                let delay = p.response_delay * draw.decades(0.5, 2.0);
                let late = p.velocity_delay + draw.within(-1e-3, 3e-3);
                let [velocity, force, spool, command] =
                    [2.0, 1.5e5, 1.0, 10.0].map(|range| Sensor::draw(draw, range));
                let pressed = draw.decades(1.0, 1e5);
                let seconds = draw.decades(0.2, 2.0);
                let at = |time: f64| amplitude * (std::f64::consts::TAU * frequency * time).sin();
                let ticks = (seconds * p.sample_rate) as u32;
                for tick in 0..ticks {
                    let time = f64::from(tick) / p.sample_rate;
                    let opening = valve_gain * at(time - delay);
                    let moved = flow_gain * table.flow(valve_gain * at(time - delay - late)) / p.piston_area;
                    let input = Input {
                        command: 0.0,
                        velocity: velocity.read(draw, moved),
                        force: force.read(draw, pressed * opening),
                        spool: spool.read(draw, opening),
                        valve_command: command.read(draw, at(time) / p.valve_gain),
                        ..Input::default()
                    };
                    let out = rig::tick(&channel, &mut state, &$given(&input));
                    if let Some(window) = out.window {
                        channel.publish(&mut state, learner.update(&mut memory, &window));
                    }
                    if tick % (ticks / SAVES) == 0 {
                        let saved = learner.saved(&memory);
                        learned += u32::from(saved.excitation > 0.0);
                        let started = learner.start_from(&saved);
                        assert!(started.is_ok(), "{case}, {tick}: {started:?} {saved:?}");
                    }
                }
            }
            assert!(learned > LEARNED, "{learned} with evidence");
        }
    )*};
}

/// Cases of each precision.
const CASES: u64 = 3000;
/// Saved calibrations of a case.
const SAVES: u32 = 8;
/// Least number of saved calibrations with evidence.
const LEARNED: u32 = 3000;

tests! {
    double f64, rig::double, 0..CASES;
    single f32, rig::single, CASES..2 * CASES;
}
