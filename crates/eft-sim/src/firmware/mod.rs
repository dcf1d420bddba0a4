//! Export of a rig for firmware, and firmware in a simulated test.

pub mod export;
pub mod processor_in_the_loop;
