//! The schema: one row per value, in the order of written files.
//!
//! A row stands beside its field in [`super::sections`]. The ranges are far wider than any rig needs. They refuse
//! mistakes of units (psi for Pa) and values whose products would overflow.

use std::sync::LazyLock;

use super::schema::Key;
use super::section::Entry;
use super::sections::RigValues;

/// Every key of the configuration.
pub static KEYS: LazyLock<Vec<Key>> = LazyLock::new(|| {
    let mut rows = Vec::new();
    RigValues::add_rows(&mut rows);
    rows
});
