//! The rigs that are measured.

use eft_core::{Learning, Parameters};

macro_rules! made {
    ($e:expr) => {
        match $e {
            Ok(made) => made,
            Err(_) => panic!("refused"),
        }
    };
}
pub(crate) use made;

/// The paper's rig with limits; a sensor measures the velocity, nothing is protected and nothing learned.
pub const PAPER: Parameters = Parameters {
    valve_command: 10.0,
    valve_command_rate: 2.0e4,
    velocity_range: 3.0,
    force_range: 2.0e5,
    spool_range: 1.2,
    ..Parameters::ZHAO2005
};
/// The same with feedforward, estimators and guard.
pub const SELF_CALIBRATING: Parameters =
    Parameters { feedforward: true, learning: Learning::ADAPTIVE, ..PAPER };
/// The same with the flow table corrected.
pub const CURVE: Parameters =
    Parameters { learning: Learning { curve_correction: true, ..Learning::ADAPTIVE }, ..SELF_CALIBRATING };
