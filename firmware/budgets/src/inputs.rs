//! The inputs of the functions that are measured.

use eft_core::Input;

/// Numbers as sensors send them, and invalid ones.
pub struct Random(pub u32);

impl Random {
    pub fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }
    pub fn sample(&mut self, scale: f32) -> f32 {
        match self.next() % 16 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => f32::NEG_INFINITY,
            3 => 0.0,
            4 => f32::from_bits(self.next()),
            5 => -scale,
            6 => scale,
            _ => (self.next() as i32 as f32) * (1.3 * scale / 2_147_483_648.0),
        }
    }
}

/// A slow swing between −1 and 1.
fn triangle(tick: u32) -> f32 {
    let phase = (tick & 0x3ff) as f32 / 256.0;
    if phase < 2.0 { phase - 1.0 } else { 3.0 - phase }
}

/// A tick of a rig whose valve passes more than its table in one direction. For three quarters of the time the rig
/// follows its command, so that the learner works.
pub fn rig(tick: u32, position: &mut f32, r: &mut Random) -> Input<f32> {
    let wild = tick & 0x1800 == 0;
    // Now and then a gap is longer than the gap time.
    let gone = tick & 0x1fc0 == 0x1f80;
    let opening = 0.3 * triangle(tick);
    let side = if opening > 0.0 { 1.05 } else { 1.0 };
    let mut sample = |scale: f32, sane: f32| {
        let value = r.sample(scale);
        match (gone, wild) {
            (true, _) => f32::NAN,
            (_, true) => value,
            _ => sane,
        }
    };
    // Within 1 % of the rigs' tables over the piston area.
    let velocity = side * (2.184 - 1.504 * opening.abs()) * opening;
    *position = if wild { 0.0 } else { *position + velocity * (1.0 / 4096.0) };
    Input {
        command: sample(1.0e4, 0.0),
        velocity: sample(1.0, velocity),
        force: sample(1.5e5, 0.0),
        spool: sample(1.0, 1.02 * opening),
        displacement: sample(0.1, *position),
        acceleration: sample(20.0, 0.0),
        supply_pressure: sample(2.5e7, 1.9e7),
        next_command: sample(1.0e4, 0.0),
        // The command of an analog controller, with a valve gain of 0.1 per volt.
        valve_command: sample(10.0, 10.2 * opening),
        alive: sample(1.0e6, tick as f32),
        period: sample(1.0e-3, 1.0 / 4096.0),
        load_pressure: sample(2.0e7, 0.0),
    }
}
