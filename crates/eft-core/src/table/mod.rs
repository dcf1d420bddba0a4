//! Increasing piecewise linear maps, and the servovalve's flow table with its inverse.

mod flow_table;
mod piecewise;

pub use flow_table::FlowTable;
pub use piecewise::PiecewiseLinear;
