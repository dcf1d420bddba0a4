//! The virtual rig: each block of Fig. 1 a file, put together in [`Plant`].
//!
//! Blocks are written over [`Scalar`], so the same plant runs one rig or several side by side.

mod actuator;
mod drive;
mod load_flow;
mod model;
mod pilot_valve;
mod plant;
mod spool;
mod state;
mod structure;

use eft_core::Scalar;

pub(crate) use drive::{Analog, Driver, Held};
pub(crate) use model::PlantModel;
pub use plant::Plant;
pub use state::PlantState;
pub(crate) use structure::Structure;

/// Most points a flow curve may have.
pub const TABLE_CAPACITY: usize = 64;

/// The plant's numbers: double precision, one or several side by side.
pub trait Num: Scalar<Element = f64> {}
impl<S: Scalar<Element = f64>> Num for S {}
