//! The same channel with one constant changed a little, the one that `FLIPPED` names. Its run must differ from the
//! host's.

use eft_core::{Channel, Parameters};
use eft_rigs::zhao2005::{CHANNEL, PARAMETERS, POINTS};

/// A few steps of an `f32`.
const OFF: f64 = 1.000_001;

/// The changed constant. `../../run` writes a name over it in the image, so it is read from memory.
static FLIPPED: [u8; 26] = *b"flipped: nothing          ";

/// The rig's channel with the changed constant.
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
