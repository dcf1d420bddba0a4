//! Protection of the specimen.

mod gate;
mod latch;
mod limits;
mod oscillation;
mod plausibility;
#[allow(clippy::module_inception, reason = "the module is named after its type")]
mod protection;
mod ramp;
mod state;
mod stuck;
#[cfg(test)]
mod tests;
mod thresholds;
mod timing;

pub(crate) use limits::{NEVER, samples};
pub(crate) use plausibility::{Control, Plausibility, PlausibilityState};
pub use protection::{Protected, Protection, ProtectionInput};
pub use state::ProtectionState;
pub use stuck::{StuckWatch, StuckWatchState};
