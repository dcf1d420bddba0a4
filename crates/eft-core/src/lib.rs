#![doc = include_str!("../README.md")]
#![no_std]

mod cause;
mod channel;
mod checksum;
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
mod signals;
pub mod status;
mod table;
mod velocity;

pub use cause::Cause;
pub use channel::{Channel, ChannelLanes, ChannelLanesState, ChannelState};
pub use checksum::{Integrity, Word};
pub use compensation::{
    Calibration, Compensation, CompensationInput, CompensationOutput, CompensationState, CurvePiece,
    Deviations, Feedforward, FeedforwardState, InverseFlow, LeadNetwork, LeadState, LoadPressure,
};
pub use controller::{Controller, ControllerInput, ControllerOutput, ControllerState};
pub use error::{ConfigError, LARGEST, SMALLEST, Short};
pub use force_loop::{Limiter, ServovalveController, ServovalveControllerState};
pub use learning::{
    Learner, LearnerState, Moment, SavedCalibration, SavedCurve, SavedDistances, SavedEvidence, Sums, Window,
    guard_tuning, tuning as learner_tuning, window_ticks,
};
#[cfg(feature = "serde")]
pub use message::StoredParameters;
pub use number::{CELLS, Flags, LaneFlags, LaneMask, Lanes, Mask, Real, Row, Scalar};
pub use parameters::{
    Learning, Levels, Mode, Parameters, PlausibilityParameters, ProtectionParameters, Realization, SignFrom,
    VelocitySource,
};
pub use protection::{Protected, Protection, ProtectionInput, ProtectionState, StuckWatch, StuckWatchState};
pub use signals::{Input, Output};
pub use table::{FlowTable, PiecewiseLinear};
pub use velocity::{FilteredDerivative, FilteredDerivativeState, VelocityObserver, VelocityObserverState};
