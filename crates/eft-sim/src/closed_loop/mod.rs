//! The sampled closed loop: `eft-core` around the continuous plant.

mod channel;
pub(crate) mod channels;
mod chunk;
mod controller;
mod digital_side;
mod energy;
pub(crate) mod estimates;
mod external_controller;
pub(crate) mod fast;
pub(crate) mod general;
mod held;
mod ideal;
mod learning;
mod linear_motion;
pub(crate) mod loops;
mod method;
mod replay;
mod signals;
mod simulate;
mod specimen;
mod stepper;
mod test_run;
pub(crate) mod tick;
pub(crate) mod traces;
mod virtual_rig;

pub use channel::{RigChannel, RigChannelState};
pub use controller::{Precision, RigController, Width, adapts, parameters};
pub use energy::{EnergyTraces, energy_of_traces};
pub use external_controller::ExternalOutput;
pub use held::HeldTrace;
pub(crate) use ideal::motions;
pub use ideal::{IdealResponse, ideal_response, ideal_responses};
pub use method::Method;
pub use replay::{Replay, replay};
pub use simulate::{
    CONVERGED_STEP, DEFAULT_STEP, SimulateOptions, energy_balance, simulate, simulate_actuators,
    simulate_by_channel, simulate_specimen,
};
pub(crate) use simulate::{check_commands, one_actuator, simulate_controlled, soft_end, soft_end_ticks};
pub use specimen::{Motions, Specimen};
pub use stepper::{PlantReading, PlantStepper};
pub use test_run::{TestRun, corrected_rig};
pub use traces::{Otherwise, TRACES, Trace, Traces, Values};
pub use virtual_rig::{RigReading, VirtualRig};
