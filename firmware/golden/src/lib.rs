//! The golden inputs, and a hash of every bit of the controller's output. The hashes are equal on the host, on the
//! target, through C (`../c/golden.c`, `../c/learning.c`) and through Python (`tests/python/test_golden_bits.py`). C
//! and Python generate the same inputs by code of their own.
//!
//! `bits.txt` holds the hashes. If a hash changes, firmware computes something else. The inputs of the controller have
//! invalid samples for up to 80 ms in a row. [`fixed`] says how a rig goes on after them.
#![no_std]

mod inputs;
mod learning;

pub use inputs::{Inputs, SPECIAL, STEPS, Tick, Xorshift};
pub use learning::{Sample, learning};

use eft_core::{
    Channel, Compensation, CompensationInput, CompensationState, Input, Learner, Learning, Parameters,
};

/// The committed hashes: rig, replay, hash.
pub const BITS: &str = include_str!("../bits.txt");

/// FNV-1a over 32-bit words.
#[derive(Debug, Clone, Copy)]
pub struct Hash(u64);

impl Hash {
    /// The hash of no words.
    pub const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    /// Adds a word.
    pub fn add(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3);
    }
    /// The hash.
    pub fn get(self) -> u64 {
        self.0
    }
}

/// The parameters of a rig that learns nothing. One that would learn resumes after a gap. Any other continues
/// from its last state, as the paper's controller.
pub const fn fixed(parameters: Parameters<'_>) -> Parameters<'_> {
    if parameters.learning.is_on() {
        Parameters { learning: Learning::OFF, ..parameters }
    } else {
        Parameters { gap_time: f64::MAX, ..parameters }
    }
}

/// Valve command and flags of every tick, of a [`fixed`] rig.
pub fn controller<const N: usize>(channel: &Channel<f32, N>) -> u64 {
    let (mut hash, mut state) = (Hash::EMPTY, channel.at_rest());
    for t in Inputs::new() {
        let Tick { command, next_command, velocity, force, spool, .. } = t;
        let input = Input { command, next_command, velocity, force, spool, ..Input::default() };
        let out = channel.step(&mut state, &input);
        hash.add(out.voltage.to_bits());
        hash.add(out.status);
    }
    hash.get()
}

/// Compensation signal and flags of every tick.
pub fn compensation<const N: usize>(core: &Compensation<f32, N>) -> u64 {
    let (mut hash, mut state, calibration) = (Hash::EMPTY, CompensationState::default(), core.nominal());
    for Tick { velocity, force, spool, .. } in Inputs::new() {
        let input = CompensationInput { velocity, force, spool, supply: 1.0, further_flow: 0.0 };
        let out = core.step(&mut state, &input, &calibration);
        hash.add(out.value.to_bits());
        hash.add(out.status);
    }
    hash.get()
}

/// Valve command and flags of every tick of a run in which the rig's learner learns, inline.
pub fn learner<const N: usize>(channel: &Channel<f32, N>, learner: &Learner<f32, N>) -> u64 {
    let (mut state, mut learned) = (channel.at_rest(), learner.at_rest());
    learning(|s| {
        let out = channel.step(&mut state, &s.input());
        if let Some(window) = out.window {
            channel.publish(&mut state, learner.update(&mut learned, &window));
        }
        (out.voltage, out.status)
    })
}
