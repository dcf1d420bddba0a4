//! The one error type: every message names the parameter, the value and what is allowed.

use std::path::PathBuf;

/// An error with a message of one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A value outside what its parameter allows.
    #[error("{parameter} = {value}: {allowed}")]
    Value {
        /// Dotted key or argument name.
        parameter: String,
        /// The offending value as the user wrote it.
        value: String,
        /// What is allowed, as a phrase: "must be positive and finite".
        allowed: String,
    },
    /// A key that the configuration does not know.
    #[error("unknown key `{key}`{}", nearest.as_ref().map(|n| format!("; the nearest known key is `{n}`")).unwrap_or_default())]
    UnknownKey {
        /// The key as given.
        key: String,
        /// The most similar known key, if there is one.
        nearest: Option<String>,
    },
    /// A required key that is absent.
    #[error("missing key `{key}` ({meaning})")]
    MissingKey {
        /// The dotted key.
        key: String,
        /// What the key means, with its unit.
        meaning: String,
    },
    /// A configuration file that is not valid TOML; the message carries line and column.
    #[error("{0}")]
    Toml(String),
    /// A file whose content does not match its format.
    #[error("{path}: {message}")]
    File {
        /// The file, as the user named it.
        path: PathBuf,
        /// The problem and its place.
        message: String,
    },
    /// A file that could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file, as the user named it.
        path: PathBuf,
        /// The operating system's answer.
        source: std::io::Error,
    },
    /// A configuration that the controller refuses.
    #[error(transparent)]
    Controller(#[from] eft_core::ConfigError),
    /// The run was interrupted by its caller.
    #[error("interrupted")]
    Interrupted,
}

/// Shorthand for results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// The same error for a key within a section.
    pub(crate) fn within(self, section: &str) -> Self {
        self.with_key(|key| format!("{section}.{key}"))
    }

    /// The same error with another name of a section at the beginning of the key.
    pub(crate) fn renamed(self, section: &str, name: &str) -> Self {
        self.with_key(|key| key.strip_prefix(section).map_or(key.clone(), |rest| format!("{name}{rest}")))
    }

    fn with_key(self, other: impl Fn(String) -> String) -> Self {
        match self {
            Self::Value { parameter, value, allowed } => {
                Self::Value { parameter: other(parameter), value, allowed }
            }
            Self::MissingKey { key, meaning } => Self::MissingKey { key: other(key), meaning },
            error => error,
        }
    }

    /// An [`Error::Value`].
    pub fn value(parameter: &str, value: impl ToString, allowed: impl Into<String>) -> Self {
        Self::Value { parameter: parameter.into(), value: value.to_string(), allowed: allowed.into() }
    }
}
