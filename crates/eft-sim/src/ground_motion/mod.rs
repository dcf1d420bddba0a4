//! From a file with a ground motion to the force command of the actuators.

pub mod excitation;
pub mod preparation;
pub mod records;
pub mod spectra;
