//! The same channel with one constant a little off, the one that `FLIPPED` names: its run must not equal the host's.

use eft_core::{Channel, Parameters};
use eft_rigs::zhao2005::{CHANNEL, PARAMETERS, POINTS};

/// A few steps of an `f32`.
const OFF: f64 = 1.000_001;

/// What is off; `../../run` writes a name over it in the image, so that it is read as memory.
static FLIPPED: [u8; 26] = *b"flipped: nothing          ";

/// The rig's channel but for the one constant.
pub fn channel() -> Channel<f32, POINTS> {
    let (mut p, mut flows) = (PARAMETERS, [0.0; POINTS]);
    flows.copy_from_slice(PARAMETERS.flows);
    // Safety: a reference is valid.
    let flipped = unsafe { core::ptr::read_volatile(&raw const FLIPPED) };
    match flipped.strip_prefix(b"flipped: ").map(<[u8]>::trim_ascii_end) {
        Some(b"lead") => p.response_delay *= OFF,
        Some(b"load_pressure") => p.supply_pressure *= OFF,
        Some(b"table") => flows[11] *= OFF,
        Some(b"piston_area") => p.piston_area *= OFF,
        Some(b"force_sensitivity") => p.force_sensitivity *= OFF,
        _ => {}
    }
    Channel::<f32, POINTS>::new(&Parameters { flows: &flows, ..p }).unwrap_or(CHANNEL)
}
