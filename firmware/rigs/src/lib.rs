//! Rigs from `eft export`. A test compares them and their C headers with a fresh export.
#![no_std]

// As they were exported.
#[rustfmt::skip]
pub mod adaptive;
#[rustfmt::skip]
pub mod guarded;
#[rustfmt::skip]
pub mod uneven;
#[rustfmt::skip]
pub mod worn;
#[rustfmt::skip]
pub mod zhao2005;
