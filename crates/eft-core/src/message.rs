//! Parameters as a message of any `serde` format. The flow table follows the numbers and has its own memory.

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::error::ConfigError;
use crate::parameters::Parameters;

/// Parameters that own their flow table, of up to `N` entries. A message is read into them.
///
/// Reading checks the form only: names, types and the tables' lengths. The constructors check the values, as for any
/// other [`Parameters`]. `Parameters` is written as the same message. The function `Parameters::deserialize` is a part
/// of this type and reads no table.
///
/// # Memory
/// The whole size is that of `Parameters` and of `2·N` numbers. Nothing is allocated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredParameters<const N: usize> {
    #[serde(with = "Parameters")]
    parameters: Parameters<'static>,
    openings: Entries<N>,
    flows: Entries<N>,
}

impl<const N: usize> StoredParameters<N> {
    /// A copy of parameters and of their table.
    ///
    /// # Errors
    /// [`ConfigError::Length`] if the table has more than `N` entries.
    pub fn new(p: &Parameters) -> Result<Self, ConfigError> {
        let openings = Entries::new("openings", p.openings)?;
        let flows = Entries::new("flows", p.flows)?;
        Ok(Self { parameters: Parameters { openings: &[], flows: &[], ..*p }, openings, flows })
    }

    /// The parameters, for the constructors.
    pub fn parameters(&self) -> Parameters<'_> {
        Parameters { openings: self.openings.entries(), flows: self.flows.entries(), ..self.parameters }
    }
}

impl Serialize for Parameters<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        #[serde(rename = "StoredParameters")]
        struct Message<'a> {
            #[serde(with = "Parameters")]
            parameters: &'a Parameters<'a>,
            openings: &'a [f64],
            flows: &'a [f64],
        }
        let message = Message { parameters: self, openings: self.openings, flows: self.flows };
        message.serialize(serializer)
    }
}

/// A table's column with its own memory.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entries<const N: usize> {
    values: [f64; N],
    length: usize,
}

impl<const N: usize> Entries<N> {
    fn new(parameter: &'static str, entries: &[f64]) -> Result<Self, ConfigError> {
        let (mut values, length) = ([0.0; N], entries.len());
        let place = values.get_mut(..length);
        let place = place.ok_or(ConfigError::Length { parameter, length, shortest: 0, longest: N })?;
        place.copy_from_slice(entries);
        Ok(Self { values, length })
    }

    fn entries(&self) -> &[f64] {
        self.values.get(..self.length).unwrap_or(&self.values)
    }
}

impl<const N: usize> Serialize for Entries<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.entries().serialize(serializer)
    }
}

impl<'de, const N: usize> Deserialize<'de> for Entries<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Column::<N>)
    }
}

/// Reads the entries one by one.
struct Column<const N: usize>;

impl<'de, const N: usize> Visitor<'de> for Column<N> {
    type Value = Entries<N>;

    fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "at most {N} numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
        let (mut values, mut length) = ([0.0; N], 0);
        while let Some(entry) = entries.next_element()? {
            let place = values.get_mut(length).ok_or_else(|| A::Error::invalid_length(length + 1, &self))?;
            *place = entry;
            length += 1;
        }
        Ok(Entries { values, length })
    }
}
