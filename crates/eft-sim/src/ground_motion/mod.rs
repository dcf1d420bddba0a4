//! From a file with a ground motion to the force that the actuators are asked for.

pub mod excitation;
pub mod preparation;
pub mod records;
pub mod spectra;
