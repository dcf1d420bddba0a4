//! The C interface: its functions, called as from C, and its header.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::float_cmp)]

mod bits;
mod contexts;
#[cfg(not(miri))]
mod header;
mod integrity;
mod refusals;
mod rig;
