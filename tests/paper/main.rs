//! The numbers of the paper's figures.
#![allow(clippy::unwrap_used)]

mod fig8_fig11;
mod fig9_northridge;
