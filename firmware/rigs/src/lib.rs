//! Rigs as `eft export` wrote them; a test holds them, and their C headers, against a fresh export.
#![no_std]

// As they were exported.
#[rustfmt::skip]
pub mod adaptive;
#[rustfmt::skip]
pub mod guarded;
#[rustfmt::skip]
pub mod uneven;
#[rustfmt::skip]
pub mod zhao2005;
