//! The rigs that are measured.

use eft_core::{Learning, Parameters, PlausibilityParameters, ProtectionParameters};
use eft_rigs::{guarded, worn};

macro_rules! made {
    ($e:expr) => {
        match $e {
            Ok(made) => made,
            Err(_) => panic!("refused"),
        }
    };
}
pub(crate) use made;

/// The paper's rig with limits, a velocity sensor, no protection and no learner.
pub const PAPER: Parameters = Parameters {
    valve_command: 10.0,
    valve_command_rate: 2.0e4,
    velocity_range: 3.0,
    force_range: 2.0e5,
    spool_range: 1.2,
    ..Parameters::ZHAO2005
};
/// The same with feedforward, estimators with one flow gain, and guard.
pub const SELF_CALIBRATING: Parameters = Parameters {
    feedforward: true,
    learning: Learning { curve_correction: false, ..Learning::ADAPTIVE },
    ..PAPER
};
/// The same with the flow table corrected, the default.
pub const CURVE: Parameters = Parameters { learning: Learning::ADAPTIVE, ..SELF_CALIBRATING };

/// The same with a protection and a plausibility watch.
pub const WATCHED: Parameters = Parameters {
    protection: match guarded::PARAMETERS.protection {
        Some(protection) => {
            Some(ProtectionParameters { plausibility: Some(PlausibilityParameters::DEFAULT), ..protection })
        }
        None => None,
    },
    ..CURVE
};

/// The self-calibrating rig with the integral part of the designed force loop and with look-ahead.
pub const ROBUST: Parameters = Parameters { integral_gain: 4.0, look_ahead: true, ..SELF_CALIBRATING };

/// The rig `worn` without look-ahead.
pub const WORN: Parameters = Parameters { look_ahead: false, ..worn::PARAMETERS };

/// The worst permitted table: its knots near null are closer than the cells of its index, in both directions.
/// Everything is learned.
pub const CROWDED: Parameters = Parameters { openings: &NEAR_NULL, flows: &FLOWS, ..CURVE };

const NEAR_NULL: [f64; 21] = [
    -1.0, -0.4, -0.1, -0.02, -8.0e-3, -4.0e-3, -2.0e-3, -1.0e-3, -5.0e-4, -2.0e-4, 0.0, 2.0e-4, 5.0e-4,
    1.0e-3, 2.0e-3, 4.0e-3, 8.0e-3, 0.02, 0.1, 0.4, 1.0,
];
/// The rig of `inputs::rig`.
const FLOWS: [f64; 21] = {
    let mut flows = NEAR_NULL;
    let mut n = 0;
    while n < flows.len() {
        flows[n] *= PAPER.piston_area * (2.184 - 1.504 * flows[n].abs());
        n += 1;
    }
    flows
};

/// As many knots as a table may have, most of them near null.
pub const LONGEST: [f64; 255] = {
    let mut knots = [0.0; 255];
    let mut n = 0;
    while n < knots.len() {
        let at = (n as f64 - 127.0) / 127.0;
        knots[n] = at * at * at;
        n += 1;
    }
    knots
};
