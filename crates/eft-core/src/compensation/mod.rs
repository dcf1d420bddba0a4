//! Velocity feedback compensation, Fig. 5 of the paper: from the piston's velocity to the compensation signal `v_c`.

mod calibration;
mod feedforward;
mod flow_curve;
mod friction;
mod inverse_flow;
mod lead;
mod load_pressure;
mod overlap;
mod velocity_feedback;

pub(crate) use calibration::null_bias;
pub use calibration::{Calibration, Deviations};
pub use feedforward::{Feedforward, FeedforwardState};
pub use flow_curve::CurvePiece;
pub(crate) use flow_curve::{CurveGrid, FIRST_NODE, NODES, PIECES, node_below, table_itself};
pub(crate) use friction::Friction;
pub use inverse_flow::InverseFlow;
pub use lead::{LeadNetwork, LeadState};
pub use load_pressure::LoadPressure;
pub(crate) use overlap::{OverlapStep, overlap};
pub use velocity_feedback::{Compensation, CompensationInput, CompensationOutput, CompensationState};
