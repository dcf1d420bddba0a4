//! Increasing piecewise linear maps, and the servovalve's flow table with its inverse.

mod flow_table;
pub(crate) mod piecewise;

pub use flow_table::FlowTable;
pub use piecewise::{CELLS, PiecewiseLinear, Row};
