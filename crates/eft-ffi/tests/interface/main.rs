//! The C interface: its functions, called as from C, and its header.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::float_cmp)]

mod bits;
mod contexts;
mod header;
mod integrity;
mod layout;
mod refusals;
mod rig;
