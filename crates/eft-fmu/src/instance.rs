//! One instance of an FMU, for both versions of the interface.

mod snapshot;
mod states;

use eft_core::Short;
use eft_sim::{Error, Result, RigConfig};

use crate::description;
use crate::model::{Model, Part};
use crate::table::variables;
use crate::variables::{Role, Type, Variable};

pub(crate) use snapshot::{Phase, Snapshot};

/// An instance.
pub(crate) struct Instance {
    part: Part,
    /// The rig of the file, without parameters set by the importer.
    rig: RigConfig,
    table: Vec<Variable>,
    token: String,
    phase: Phase,
    ticks: u64,
    /// Time of the first tick (s).
    start: f64,
    /// One value per variable.
    values: Vec<f64>,
    /// `None` before its first use, and after a parameter has changed.
    model: Option<Model>,
    // Boxed, because the importer has their addresses.
    #[allow(clippy::vec_box, reason = "an importer knows a snapshot by its address, which must stay")]
    snapshots: Vec<Box<Snapshot>>,
}

/// Largest number of ticks in one step of the importer.
const MOST_TICKS: f64 = 1e9;

/// Allowed error of a time, in samples.
const SLACK: f64 = 1e-4;

impl Instance {
    /// An instance from the rig in a resource and the token that the importer has read.
    ///
    /// # Errors
    /// The resource is not a rig, or the token belongs to another one.
    pub(crate) fn new(resource: &str, token: &str) -> Result<Self> {
        let of_token = |part: &Part| description::token(*part, resource) == token;
        let part = [Part::Rig, Part::Controller].into_iter().find(of_token).ok_or_else(|| {
            Error::value("token", format!("{token:?}"), "must be that of the FMU's own description and rig")
        })?;
        let rig = RigConfig::from_toml(resource)?;
        let table = variables(part, &rig);
        let values = table.iter().map(|variable| variable.start).collect();
        Ok(Self {
            part,
            rig,
            table,
            token: token.to_owned(),
            phase: Phase::Instantiated,
            ticks: 0,
            start: 0.0,
            values,
            model: None,
            snapshots: Vec::new(),
        })
    }

    fn variable(&self, reference: u32, kind: Type) -> Result<(usize, &Variable)> {
        let place = reference as usize;
        let variable = self.table.get(place).ok_or_else(|| {
            let allowed = format!("must be below {}", self.table.len());
            Error::value("value reference", reference, allowed)
        })?;
        if variable.kind != kind {
            let allowed = format!("must be asked for as {:?}", variable.kind);
            return Err(Error::value(&variable.name, format!("{kind:?}"), allowed));
        }
        Ok((place, variable))
    }

    /// The values of variables of a type.
    ///
    /// # Errors
    /// An unknown reference, one of another type, or parameters without a rig.
    pub(crate) fn get(&mut self, references: &[u32], kind: Type) -> Result<Vec<f64>> {
        let places: Vec<_> =
            references.iter().map(|&one| Ok(self.variable(one, kind)?.0)).collect::<Result<_>>()?;
        if self.phase == Phase::Initializing {
            self.run()?;
        }
        Ok(places.into_iter().filter_map(|place| self.values.get(place).copied()).collect())
    }

    /// Sets variables of a type, all or none.
    ///
    /// # Errors
    /// An unknown reference or one of another type, an output, a parameter after the initialization, or a
    /// value out of its range.
    pub(crate) fn set(&mut self, references: &[u32], kind: Type, values: &[f64]) -> Result<()> {
        let mut places = Vec::with_capacity(references.len());
        let mut changes_rig = false;
        for (&reference, &value) in references.iter().zip(values) {
            let (place, variable) = self.variable(reference, kind)?;
            let refuse = |allowed: String| Err(Error::value(&variable.name, Short(value), allowed));
            match variable.role {
                Role::Input if self.phase != Phase::Terminated => {}
                Role::Input => return refuse("must be set before the end".into()),
                Role::Parameter if matches!(self.phase, Phase::Instantiated | Phase::Initializing) => {
                    let allowed = variable.range().is_none_or(|(low, high)| (low..=high).contains(&value));
                    if !allowed {
                        return refuse(variable.key.map(|key| key.allowed()).unwrap_or_default());
                    }
                    changes_rig = true;
                }
                Role::Parameter => return refuse("must be set before the initialization ends".into()),
                Role::Output | Role::Time => return refuse("must not be set: the FMU computes it".into()),
            }
            places.push(place);
        }
        for (place, value) in places.into_iter().zip(values) {
            if let Some(old) = self.values.get_mut(place) {
                *old = *value;
            }
        }
        if changes_rig {
            self.model = None;
        }
        Ok(())
    }

    /// Makes the model of the present parameters, unless it exists.
    fn run(&mut self) -> Result<()> {
        if self.model.is_none() {
            self.model = Some(self.model_of(&self.values)?);
            self.tell();
        }
        Ok(())
    }

    /// A model at rest with the parameters in these values.
    fn model_of(&self, values: &[f64]) -> Result<Model> {
        let mut changes = Vec::new();
        let mut single = false;
        for (variable, &value) in self.table.iter().zip(values) {
            match (variable.role, variable.key) {
                (Role::Parameter, Some(key)) if value != variable.start => {
                    changes.push((key.key, variable.setting(value)));
                }
                (Role::Parameter, None) => single = value != 0.0,
                _ => {}
            }
        }
        let changed = if changes.is_empty() { self.rig.clone() } else { self.rig.replace(&changes)? };
        Model::new(self.part, &changed, single)
    }

    /// Updates the values of time and outputs.
    fn tell(&mut self) {
        let time = self.time();
        let outputs = self.model.as_ref().map(Model::outputs).unwrap_or_default();
        let mut outputs = outputs.into_iter();
        for (variable, value) in self.table.iter().zip(&mut self.values) {
            match variable.role {
                Role::Time => *value = time,
                Role::Output => *value = outputs.next().unwrap_or(*value),
                Role::Input | Role::Parameter => {}
            }
        }
    }

    fn in_phase(&self, phase: Phase, call: &str) -> Result<()> {
        if self.phase == phase {
            return Ok(());
        }
        Err(Error::value(call, format!("{:?}", self.phase), format!("must be called in the state {phase:?}")))
    }

    /// Sets the time (s) of the first sample.
    ///
    /// # Errors
    /// Another state, or a time that is not finite.
    pub(crate) fn set_start(&mut self, start: f64) -> Result<()> {
        self.in_phase(Phase::Instantiated, "startTime")?;
        if !start.is_finite() {
            return Err(Error::value("startTime", start, "must be finite"));
        }
        self.start = start;
        Ok(())
    }

    /// Begins the initialization.
    ///
    /// # Errors
    /// Another state.
    pub(crate) fn enter_initialization(&mut self) -> Result<()> {
        self.in_phase(Phase::Instantiated, "EnterInitializationMode")?;
        self.phase = Phase::Initializing;
        self.tell();
        Ok(())
    }

    /// Makes the model.
    ///
    /// # Errors
    /// Another state, or parameters that are not a valid rig.
    pub(crate) fn exit_initialization(&mut self) -> Result<()> {
        self.in_phase(Phase::Initializing, "ExitInitializationMode")?;
        self.run()?;
        self.phase = Phase::Stepping;
        Ok(())
    }

    /// Steps from a time (s) by a whole number of samples.
    ///
    /// # Errors
    /// Another state, another time, no whole number of samples, or what the model refuses.
    pub(crate) fn do_step(&mut self, time: f64, step: f64) -> Result<()> {
        self.in_phase(Phase::Stepping, "DoStep")?;
        let rate = self.rig.controller.sample_rate;
        let now = self.time();
        // Rounding error of a large time, and a fraction of a sample.
        let slack = SLACK / rate + 4.0 * f64::EPSILON * now.abs();
        let there = (time - now).abs() <= slack;
        if !there {
            let allowed = format!("must be the time reached, {now} s");
            return Err(Error::value("currentCommunicationPoint", Short(time), allowed));
        }
        let ticks = (step * rate).round();
        let whole = (step * rate - ticks).abs() <= SLACK && (1.0..=MOST_TICKS).contains(&ticks);
        if !whole {
            let allowed = format!("must be a whole number of samples of 1/{rate} s");
            return Err(Error::value("communicationStepSize", Short(step), allowed));
        }
        let inputs: Vec<f64> = self.of_role(Role::Input).collect();
        let mut result = Ok(());
        if let Some(model) = &mut self.model {
            for _ in 0..ticks as u64 {
                result = model.step(&inputs);
                if result.is_err() {
                    break;
                }
                self.ticks += 1;
            }
        }
        self.tell();
        result
    }

    fn of_role(&self, role: Role) -> impl Iterator<Item = f64> {
        self.table.iter().zip(&self.values).filter(move |(one, _)| one.role == role).map(|(_, value)| *value)
    }

    /// Time reached (s).
    pub(crate) fn time(&self) -> f64 {
        self.start + self.ticks as f64 / self.rig.controller.sample_rate
    }

    /// Ends the simulation.
    ///
    /// # Errors
    /// Another state.
    pub(crate) fn terminate(&mut self) -> Result<()> {
        self.in_phase(Phase::Stepping, "Terminate")?;
        self.phase = Phase::Terminated;
        Ok(())
    }

    /// Returns to the state of a new instance.
    ///
    /// # Errors
    /// None; it returns a result like the other functions.
    pub(crate) fn reset(&mut self) -> Result<()> {
        (self.phase, self.ticks, self.start, self.model) = (Phase::Instantiated, 0, 0.0, None);
        self.values = self.table.iter().map(|variable| variable.start).collect();
        Ok(())
    }

    /// The names of the variables by reference, for tests.
    #[cfg(test)]
    pub(crate) fn names(&self) -> std::collections::BTreeMap<&str, u32> {
        self.table.iter().zip(0..).map(|(variable, place)| (variable.name.as_str(), place)).collect()
    }
}

#[cfg(test)]
mod tests;
