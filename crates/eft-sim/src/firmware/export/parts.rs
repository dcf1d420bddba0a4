//! The data of an exported file, and its language.

use eft_core::Parameters;

use crate::{Error, Result, RigConfig};

/// The language of the exported configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// `PARAMETERS`, and a constant `eft_core::Channel` and `Learner` made of them, checked by the compiler.
    Rust,
    /// A constant `eft_parameters` for `eft.h`, checked here and again by `eft_configure_f32`.
    C,
}

impl std::str::FromStr for Target {
    type Err = Error;
    fn from_str(name: &str) -> Result<Self> {
        match name {
            "rust" => Ok(Self::Rust),
            "c" => Ok(Self::C),
            other => Err(Error::value("target", other, "must be \"rust\" or \"c\"")),
        }
    }
}

/// The data of an exported file.
pub(super) struct Parts<'a> {
    pub(super) rig: &'a RigConfig,
    pub(super) name: &'a str,
    pub(super) parameters: Parameters<'a>,
}
