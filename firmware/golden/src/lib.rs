//! The same inputs everywhere, and a hash of every bit that the controller answers: equal on the host, on the target,
//! through C (`../c/golden.c`, `../c/learning.c`) and through Python (`tests/python/test_golden_bits.py`), which write the inputs again.
//!
//! `bits.txt` holds the hashes; a change of any of them is a change of what firmware computes.
#![no_std]

mod inputs;
mod learning;

pub use inputs::{Inputs, SPECIAL, STEPS, Tick, Xorshift};
pub use learning::{Sample, learning};

use eft_core::{CompensationState, Controller, ControllerState};

/// The committed hashes: rig, replay, hash.
pub const BITS: &str = include_str!("../bits.txt");

/// FNV-1a over 32-bit words.
#[derive(Debug, Clone, Copy)]
pub struct Hash(u64);

impl Hash {
    /// Of nothing.
    pub const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    /// One more word.
    pub fn add(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3);
    }
    /// The hash.
    pub fn get(self) -> u64 {
        self.0
    }
}

/// Valve command and flags of every tick.
pub fn controller<const N: usize>(core: &Controller<f32, N>) -> u64 {
    let (mut hash, mut state) = (Hash::EMPTY, ControllerState::default());
    for t in Inputs::new() {
        let out = core.step(&mut state, t.command, t.velocity, t.force, t.spool);
        hash.add(out.valve_command.to_bits());
        hash.add(out.status);
    }
    hash.get()
}

/// Compensation signal and flags of every tick.
pub fn compensation<const N: usize>(core: &Controller<f32, N>) -> u64 {
    let (mut hash, mut state) = (Hash::EMPTY, CompensationState::default());
    for t in Inputs::new() {
        let out = core.compensation.step(&mut state, t.velocity, t.force, t.spool, 0.0);
        hash.add(out.value.to_bits());
        hash.add(out.status);
    }
    hash.get()
}

/// Valve command, compensation signal and flags of every tick, a further flow wanted as well.
pub fn further_flow<const N: usize>(core: &Controller<f32, N>) -> u64 {
    let (mut hash, mut state) = (Hash::EMPTY, ControllerState::default());
    for t in Inputs::new() {
        let out = core.step_via(&mut state, t.command, t.velocity, t.force, t.spool, t.further_flow, |v| v);
        hash.add(out.valve_command.to_bits());
        hash.add(out.compensation.to_bits());
        hash.add(out.status);
    }
    hash.get()
}
