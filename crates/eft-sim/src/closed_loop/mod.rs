//! The sampled closed loop: `eft-core` around the continuous plant.

mod channel;
pub(crate) mod chunk;
mod controller;
mod digital_side;
mod estimates;
pub(crate) mod fast;
mod general;
mod ideal;
mod outside;
mod replay;
mod signals;
mod simulate;
mod specimen;
mod stepper;
mod test_run;
pub(crate) mod tick;
mod traces;

pub use channel::RigChannel;
pub use controller::{Precision, RigController, Width, adapts, parameters};
pub(crate) use ideal::motions;
pub use ideal::{IdealResponse, ideal_response, ideal_responses};
pub use outside::Answer;
pub use replay::{Replay, replay};
pub use simulate::{
    CONVERGED_STEP, DEFAULT_STEP, Method, SimulateOptions, energy_balance, simulate, simulate_actuators,
    simulate_specimen,
};
pub(crate) use simulate::{one_actuator, simulate_controlled, soft_end_ticks};
pub use specimen::{Motions, Specimen};
pub use stepper::{PlantReading, PlantStepper};
pub use test_run::TestRun;
pub use traces::{Otherwise, TRACES, Trace, Traces, Values};
