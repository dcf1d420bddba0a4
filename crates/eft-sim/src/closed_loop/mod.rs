//! The sampled closed loop: `eft-core` around the continuous plant.

mod controller;
mod dac;
mod delay_line;
mod digital_side;
mod ideal;
mod simulate;
mod single;
mod test_run;

pub use controller::{Precision, RigController, compensation_parameters};
pub use ideal::{IdealResponse, ideal_response};
pub use simulate::{DEFAULT_STEP, SimulateOptions, energy_balance, simulate};
pub use test_run::TestRun;
