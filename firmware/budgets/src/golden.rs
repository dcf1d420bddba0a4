//! A run of the adaptive controller whose bits must be the same everywhere: on the host, on a Cortex-M4F, on a
//! Cortex-M7.

use eft_core::{AdaptiveController, FlowTable, Measurements};

/// Of all outputs of [`hash`], in `f32`.
pub(crate) const HASH: u32 = 0xcbb7_40ac;

/// Ticks of it.
const TICKS: u32 = 100_000;

/// A generator of bits, Marsaglia's xorshift.
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }
    /// Between −1 and 1.
    fn noise(&mut self) -> f32 {
        (self.next() as i32 as f32) * (1.0 / 2_147_483_648.0)
    }
    /// Any number that a sensor may send, and some that it should not.
    fn wild(&mut self, scale: f32) -> f32 {
        match self.next() % 16 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => f32::from_bits(self.next()),
            _ => 1.3 * scale * self.noise(),
        }
    }
}

/// A slow swing between −1 and 1.
fn triangle(tick: u32) -> f32 {
    let phase = (tick & 0x3ff) as f32 / 256.0;
    if phase < 2.0 { phase - 1.0 } else { 3.0 - phase }
}

/// FNV-1a over all outputs of a run in which the valve passes 5 % more than its table and sensors fail now and then;
/// and the last flow gain `θ` (1).
pub(crate) fn hash<const N: usize>(
    controller: &AdaptiveController<f32, N>,
    table: &FlowTable<f32, N>,
) -> (u32, f32) {
    let mut random = Random(20_051);
    let mut state = controller.at_rest();
    let mut hash = 0x811c_9dc5_u32;
    let mut take = |bits: u32| {
        for byte in bits.to_le_bytes() {
            hash = (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    };
    for tick in 0..TICKS {
        let failing = tick & 0x7f00 == 0x4000;
        let opening = 0.3 * triangle(tick);
        let mut sample = |scale: f32, sane: f32| {
            let noise = 5.0e-4 * scale * random.noise();
            if failing { random.wild(scale) } else { sane + noise }
        };
        let command = sample(1.0e4, 2.0e3 * triangle(tick));
        let measured = Measurements {
            velocity: sample(1.0, 1.05 * table.flow(opening) / 8.212e-3),
            force: sample(1.5e5, 1.9e3 * triangle(tick)),
            spool: sample(1.0, opening),
            valve_command: 0.0,
            supply_pressure: sample(1.9e7, 1.9e7),
        };
        let out = controller.step(&mut state, command, &measured);
        take(out.valve_command.to_bits());
        take(out.compensation.to_bits());
        take(out.status);
    }
    (hash, state.compensation.flow_gain())
}
