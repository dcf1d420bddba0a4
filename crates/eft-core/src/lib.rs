//! The effective force testing controller, for firmware and for the simulator alike.
//!
//! Rules of this crate:
//! - a configuration is validated once and immutable, a state is a plain copy: one configuration drives many
//!   channels, and swapping it changes no state;
//! - values live at run time, shapes live in types: tables have a capacity, nothing allocates;
//! - no input panics, and none is lost in silence: bad samples hold the output and raise a flag of [`status`];
//! - every block is written once over [`Scalar`], for `f32`, `f64` and lanes of them, with select instead of
//!   branches, and gives the same bits on every target.
//!
//! Signs: a positive spool opening lets flow into the chamber that pulls the structure; load pressure, force,
//! displacement and velocity are then positive.
#![no_std]

mod adaptation;
mod adaptive;
mod adaptive_controller;
mod adaptive_parameters;
mod band_filter;
mod compensation;
mod controller;
mod error;
mod evidence;
mod feedforward;
mod flow_correction;
mod flow_gain;
mod flow_prediction;
mod flow_table;
mod guard;
mod inverse_flow;
mod lanes;
mod lead;
mod limiter;
mod load_pressure;
mod piecewise;
mod protection;
mod protection_parameters;
mod scalar;
mod servovalve_controller;
pub mod status;
mod stuck;
mod trust;
mod tuning;
mod valve_estimator;
mod velocity;
mod window;

pub use adaptive::{AdaptiveCompensation, AdaptiveCompensationState};
pub use adaptive_controller::{AdaptiveController, AdaptiveControllerState};
pub use adaptive_parameters::AdaptiveParameters;
pub use compensation::{Compensation, CompensationParameters, CompensationState, Mode, Output};
pub use controller::{Controller, ControllerOutput, ControllerState};
pub use error::{ConfigError, LARGEST, SMALLEST, Short};
pub use feedforward::{Feedforward, FeedforwardState};
pub use flow_table::FlowTable;
pub use inverse_flow::{Inverse, InverseFlow, InverseFlowParameters, SignFrom};
pub use lanes::{LaneFlags, LaneMask, Lanes};
pub use lead::{LeadNetwork, LeadState};
pub use limiter::Limiter;
pub use load_pressure::LoadPressure;
pub use piecewise::{CELLS, PiecewiseLinear, Row};
pub use protection::{Protected, Protection, ProtectionState};
pub use protection_parameters::{Levels, ProtectionParameters};
pub use scalar::{Flags, Mask, Real, Scalar};
pub use servovalve_controller::{ServovalveController, ServovalveControllerState};
pub use stuck::{StuckWatch, StuckWatchState};
pub use tuning::Tuning;
pub use velocity::{FilteredDerivative, FilteredDerivativeState, VelocityObserver, VelocityObserverState};
pub use window::Measurements;
