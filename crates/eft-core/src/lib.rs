#![doc = include_str!("../README.md")]
#![no_std]

mod channel;
mod compensation;
mod controller;
mod error;
mod force_loop;
mod integrity;
mod learning;
#[cfg(feature = "serde")]
mod message;
mod number;
mod parameters;
mod protection;
pub mod status;
mod table;
mod velocity;

pub use channel::{Channel, ChannelLanes, ChannelLanesState, ChannelState, Input, Output};
pub use compensation::{
    Calibration, Compensation, CompensationInput, CompensationOutput, CompensationState, CurvePiece,
    Deviations, Feedforward, FeedforwardState, InverseFlow, LeadNetwork, LeadState, LoadPressure, Mode,
    SignFrom,
};
pub use controller::{Controller, ControllerInput, ControllerOutput, ControllerState};
pub use error::{ConfigError, LARGEST, SMALLEST, Short};
pub use force_loop::{Limiter, ServovalveController, ServovalveControllerState};
pub use integrity::{Integrity, Word};
pub use learning::{Learner, LearnerState, Moment, SavedCalibration, SavedCurve, Sums, Window};
#[cfg(feature = "serde")]
pub use message::StoredParameters;
pub use number::{Flags, LaneFlags, LaneMask, Lanes, Mask, Real, Scalar};
pub use parameters::{Learning, Parameters, Realization, VelocitySource};
pub use protection::{
    Cause, Levels, PlausibilityParameters, Protected, Protection, ProtectionInput, ProtectionParameters,
    ProtectionState, StuckWatch, StuckWatchState,
};
pub use table::{CELLS, FlowTable, PiecewiseLinear, Row};
pub use velocity::{FilteredDerivative, FilteredDerivativeState, VelocityObserver, VelocityObserverState};
