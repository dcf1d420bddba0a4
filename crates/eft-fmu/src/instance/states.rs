//! The states of an instance: stored, restored, and as bytes.

use eft_sim::{Error, Result};

use super::Instance;
use super::snapshot::{Phase, Snapshot};
use crate::description::fnv;
use crate::model::Model;

impl Instance {
    fn snapshot(&self) -> Snapshot {
        let model = self.model.as_ref().map(Model::state);
        Snapshot {
            phase: self.phase,
            ticks: self.ticks,
            start: self.start,
            values: self.values.clone(),
            model,
        }
    }

    fn place(&self, address: *const Snapshot) -> Result<usize> {
        let found = self.snapshots.iter().position(|one| std::ptr::eq(&**one, address));
        found.ok_or_else(|| {
            let allowed = "must be one that this instance gave and that is not freed";
            Error::value("state", format!("{address:?}"), allowed)
        })
    }

    /// Stores a snapshot, and replaces an earlier one if given.
    fn keep(&mut self, snapshot: Snapshot, earlier: *const Snapshot) -> Result<*const Snapshot> {
        if earlier.is_null() {
            let snapshot = Box::new(snapshot);
            let address = &raw const *snapshot;
            self.snapshots.push(snapshot);
            return Ok(address);
        }
        let place = self.place(earlier)?;
        if let Some(old) = self.snapshots.get_mut(place) {
            **old = snapshot;
        }
        Ok(earlier)
    }

    /// Stores the state, and replaces an earlier one if given.
    ///
    /// # Errors
    /// An address that is no state of this instance.
    pub(crate) fn get_state(&mut self, earlier: *const Snapshot) -> Result<*const Snapshot> {
        self.keep(self.snapshot(), earlier)
    }

    /// Restores a state.
    ///
    /// # Errors
    /// An address that is no state of this instance, or a state that does not fit.
    pub(crate) fn set_state(&mut self, address: *const Snapshot) -> Result<()> {
        let place = self.place(address)?;
        let snapshot = self.snapshots.swap_remove(place);
        let result = self.go_to(&snapshot);
        self.snapshots.push(snapshot);
        result
    }

    fn go_to(&mut self, snapshot: &Snapshot) -> Result<()> {
        let model = match &snapshot.model {
            Some(state) => {
                let mut model = self.model_of(&snapshot.values)?;
                model.go_to(state)?;
                Some(model)
            }
            None => None,
        };
        self.model = model;
        (self.phase, self.ticks, self.start) = (snapshot.phase, snapshot.ticks, snapshot.start);
        self.values.clone_from(&snapshot.values);
        Ok(())
    }

    /// Frees a state.
    ///
    /// # Errors
    /// An address that is no state of this instance.
    pub(crate) fn free_state(&mut self, address: *const Snapshot) -> Result<()> {
        let place = self.place(address)?;
        self.snapshots.swap_remove(place);
        Ok(())
    }

    /// The first bytes of a state, which identify the FMU.
    fn mark(&self) -> [u8; 8] {
        fnv(format!("{} {}", self.token, env!("CARGO_PKG_VERSION")).as_bytes()).to_le_bytes()
    }

    /// A state as bytes: identification, content, and a checksum of both.
    ///
    /// # Errors
    /// An address that is no state of this instance.
    pub(crate) fn serialize(&self, address: *const Snapshot) -> Result<Vec<u8>> {
        let snapshot = self.place(address).map(|place| self.snapshots.get(place))?;
        let written = postcard::to_extend(&snapshot, self.mark().to_vec());
        let mut bytes =
            written.map_err(|error| Error::value("state", error, "must be one that can be written"))?;
        let sum = fnv(&bytes);
        bytes.extend(sum.to_le_bytes());
        Ok(bytes)
    }

    /// Reads a state, and replaces an earlier one if given.
    ///
    /// # Errors
    /// The bytes are not a state of an FMU like this one, or the address is not a state of this instance.
    pub(crate) fn deserialize(&mut self, bytes: &[u8], earlier: *const Snapshot) -> Result<*const Snapshot> {
        let refuse = || {
            let allowed = "must be those that an FMU of the same rig and version wrote";
            Error::value("state", format!("{} bytes", bytes.len()), allowed)
        };
        let (content, sum) = bytes.split_last_chunk::<8>().ok_or_else(refuse)?;
        let inside = content.strip_prefix(&self.mark()).filter(|_| fnv(content).to_le_bytes() == *sum);
        let read = inside.and_then(|inside| postcard::from_bytes::<Option<Snapshot>>(inside).ok().flatten());
        let snapshot = read.filter(|one| one.values.len() == self.table.len()).ok_or_else(refuse)?;
        let stepping = snapshot.phase == Phase::Stepping;
        if stepping && snapshot.model.is_none() {
            return Err(refuse());
        }
        self.keep(snapshot, earlier)
    }
}
