//! Numbers as sensors send them, and invalid ones.

/// Random ticks before those with special values.
pub const STEPS: u32 = 100_000;

/// Special values: quiet and signalling NaN with payloads, infinities, zeros, subnormals, the ends of the normal range,
/// and the neighbours of 1 and of the largest valid measurement.
pub const SPECIAL: [u32; 32] = [
    0x7fc0_0000,
    0xffc0_0000,
    0x7fc1_2345,
    0xffff_ffff,
    0x7f80_0001,
    0xff80_0001,
    0x7fa0_0000,
    0xffbf_ffff, // NaN
    0x7f80_0000,
    0xff80_0000,
    0x0000_0000,
    0x8000_0000, // infinities, zeros
    0x0000_0001,
    0x8000_0001,
    0x007f_ffff,
    0x807f_ffff,
    0x0080_0000,
    0x8080_0000, // subnormals, smallest normals
    0x7f7f_ffff,
    0xff7f_ffff, // largest
    0x5368_d4a4,
    0x5368_d4a5,
    0x5368_d4a6,
    0xd368_d4a4,
    0xd368_d4a5,
    0xd368_d4a6, // around 1e12
    0x3f7f_ffff,
    0x3f80_0000,
    0x3f80_0001,
    0xbf7f_ffff,
    0xbf80_0000,
    0xbf80_0001, // around 1
];

/// Marsaglia's xorshift, 32 bits.
#[derive(Debug, Clone, Copy)]
pub struct Xorshift(pub u32);

impl Xorshift {
    /// The next word.
    #[allow(clippy::should_implement_trait)] // it never ends
    pub fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }
    /// A number within ±`scale`.
    pub fn regular(&mut self, scale: f32) -> f32 {
        self.next() as i32 as f32 * (scale / 2_147_483_648.0)
    }
    /// As [`regular`](Self::regular), but now and then a special value or random bits.
    pub fn sample(&mut self, scale: f32) -> f32 {
        match self.next() % 16 {
            0 => special(self.next()),
            1 => f32::from_bits(self.next()),
            _ => self.regular(scale),
        }
    }
}

fn special(n: u32) -> f32 {
    f32::from_bits(SPECIAL.get(n as usize % SPECIAL.len()).copied().unwrap_or(0))
}

/// One tick's command and measurements, in SI units.
#[derive(Debug, Clone, Copy)]
pub struct Tick {
    /// Force command (N).
    pub command: f32,
    /// The next tick's (N), for a rig that looks ahead: in proportion to the command, and NaN now and then.
    pub next_command: f32,
    /// Piston velocity (m/s).
    pub velocity: f32,
    /// Force (N).
    pub force: f32,
    /// Spool opening (1).
    pub spool: f32,
    /// Further flow (m³/s).
    pub further_flow: f32,
}

/// Each signal's range in ordinary ticks: command, velocity, force, spool, further flow.
const SCALES: [f32; 5] = [1.0e4, 1.3, 1.6e5, 1.2, 1.0e-3];
const CHANNELS: u32 = 5;

/// [`STEPS`] random ticks, then every pair of special values in every pair of signals. The other signals are ordinary.
#[derive(Debug)]
pub struct Inputs {
    random: Xorshift,
    n: u32,
}

impl Inputs {
    /// From the start.
    #[allow(clippy::new_without_default)]
    pub fn new() -> Self {
        Self { random: Xorshift(2_463_534_242), n: 0 }
    }
}

impl Iterator for Inputs {
    type Item = Tick;

    fn next(&mut self) -> Option<Tick> {
        let count = SPECIAL.len() as u32;
        let mut channels = [0.0; CHANNELS as usize];
        if self.n < STEPS {
            for (channel, scale) in channels.iter_mut().zip(SCALES) {
                *channel = self.random.sample(scale);
            }
        } else {
            let at = self.n - STEPS;
            let (pair, first, second) = (at / (count * count), at / count % count, at % count);
            let (a, b) = (pair / CHANNELS, pair % CHANNELS);
            if a >= CHANNELS {
                return None;
            }
            for (i, (channel, scale)) in (0..).zip(channels.iter_mut().zip(SCALES)) {
                let ordinary = self.random.regular(scale);
                // If both are the same signal, the second counts.
                *channel = if i == b {
                    special(second)
                } else if i == a {
                    special(first)
                } else {
                    ordinary
                };
            }
        }
        let [command, velocity, force, spool, further_flow] = channels;
        let next_command = if self.n % 61 == 60 { f32::NAN } else { 0.9375 * command };
        self.n += 1;
        Some(Tick { command, next_command, velocity, force, spool, further_flow })
    }
}
