//! The sampled closed loop: `eft-core` around the continuous plant.

mod channel;
mod digital_side;
mod energy;
mod estimate_history;
mod estimates;
mod external_controller;
mod fast;
mod general;
mod ideal;
mod learning_lanes;
mod linear_motion;
mod loops;
mod parameters;
mod replay;
mod signals;
mod simulate;
mod specimen;
mod stepper;
mod test_run;
mod tick;
mod traces;
mod virtual_rig;

pub use channel::{RigChannel, RigChannelState};
pub(crate) use digital_side::{ChannelKind, DigitalSide, Feedback};
pub use energy::{EnergyTraces, energy_of_traces};
pub use estimate_history::HeldTrace;
pub(crate) use estimates::{Estimates, EstimatesInUse};
pub(crate) use external_controller::ExternalController;
pub use external_controller::ExternalOutput;
pub(crate) use fast::FastLoop;
pub use fast::Method;
pub(crate) use general::GeneralLoop;
pub(crate) use ideal::motions;
pub use ideal::{IdealResponse, ideal_response, ideal_responses};
pub(crate) use learning_lanes::LearningLanes;
pub(crate) use loops::ClosedLoop;
pub use parameters::{Precision, RigController, Width, adapts, parameters};
pub use replay::{Replay, replay};
pub use simulate::{
    CONVERGED_STEP, DEFAULT_STEP, SimulateOptions, energy_balance, simulate, simulate_actuators,
    simulate_by_channel, simulate_specimen,
};
pub(crate) use simulate::{
    check_commands, check_each, one_actuator, simulate_controlled, soft_end, soft_end_ticks,
};
pub use specimen::{Motions, Specimen};
pub use stepper::{PlantReading, PlantStepper};
pub use test_run::{TestRun, corrected_rig};
pub(crate) use tick::{DigitalOutput, Recorder, Tick};
pub(crate) use traces::{BLOCK_TICKS, Block, supply_varies};
pub use traces::{Fallback, TRACES, Trace, Traces, Values};
pub use virtual_rig::{RigReading, VirtualRig};

pub use crate::plant::Signals;
