//! The virtual rig and its controller as functional mock-up units (FMUs) for co-simulation, FMI 2.0 and 3.0.
//!
//! Every shared library with this crate exports both interfaces. An FMU has such a library, the
//! [`description`], and the rig's file as `resources/rig.toml`. The token in the description tells an
//! instance which [`Part`] it is.
//!
//! The step is fixed: one sample of the rig's `controller.sample_rate`.

mod both;
mod boundary;
mod description;
mod fmi2;
mod fmi3;
mod instance;
mod model;
mod table;
mod variables;

pub use description::{Version, description, resource};
pub use model::Part;
