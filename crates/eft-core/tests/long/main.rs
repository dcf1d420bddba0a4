//! The long tests of `tests/core` in a binary of their own, which compiles without the property tests. `make firmware`
//! runs it in a release build.
// A failed index or unwrap is a failed test.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, clippy::float_cmp)]

#[path = "../core/endurance.rs"]
mod endurance;
#[path = "../core/exhaustive.rs"]
mod exhaustive;
#[allow(dead_code, reason = "the other tests of the core use the rest")]
#[path = "../core/rig.rs"]
mod rig;
