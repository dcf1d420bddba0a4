//! Protection of the specimen.

mod limits;
#[allow(clippy::module_inception, reason = "the room is named after what it holds")]
mod protection;
mod ramp;
mod stuck;

pub use limits::{Levels, ProtectionParameters};
pub use protection::{Protected, Protection, ProtectionState};
pub use stuck::{StuckWatch, StuckWatchState};
