//! The learner: it makes the next calibration from the sums over a window.

mod band_filter;
mod checkpoint;
mod configuration;
mod curve_nodes;
mod design;
mod deviation;
mod flow;
mod flow_curve;
mod flow_model;
mod gate;
mod guard;
mod learner;
mod least_squares;
mod saved;
#[cfg(test)]
mod tests;
pub mod tuning;
mod valve;
mod window;

pub(crate) use design::LOWEST_RATE;
pub use design::window_ticks;
pub(crate) use flow_model::{FlowModel, ModelFlow};
pub use guard::tuning as guard_tuning;
pub use learner::{Learner, LearnerState};
pub use saved::{SavedCalibration, SavedCurve, SavedDistances, SavedEvidence};
pub use window::{Moment, Sums, Window};
