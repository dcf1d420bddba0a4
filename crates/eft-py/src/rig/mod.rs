//! `eft.Rig`.

mod given;
mod keys;

pub(crate) use given::{GivenRig, check_rig};
pub(crate) use keys::{quantity, rig_keys, unit_factor, units_of};

use std::path::PathBuf;

use eft_sim::RigConfig;
use eft_sim::config::{KEYS, Realization, StructureKind};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyMapping};
use toml::Value;

use crate::errors::to_python;
use crate::values;

/// A whole rig: plant, controller, sensors and limits, in SI units. It is immutable; `replace` returns a new
/// one.
///
/// Its values describe the rig as the controller knows it. Values under ``truth``, as in
/// ``{"truth.structure.mass": 9000.0}``, describe the plant where it differs. Plant, sensors and converter
/// use them, the controller does not.
///
/// Parameters
/// ----------
/// text : str
///     A configuration in TOML, as from `to_toml`; `Rig.from_toml` reads a file.
#[pyclass(frozen, module = "eft")]
pub(crate) struct Rig {
    pub(crate) config: RigConfig,
}

/// The rig's name, for one line about it.
pub(crate) fn name(config: &RigConfig) -> &str {
    config.name.as_deref().unwrap_or("a rig without a name")
}

/// The word that a key has, for one line about the rig.
pub(crate) fn word(config: &RigConfig, key: &str) -> String {
    match config.get(key) {
        Ok(Some(Value::String(word))) => word,
        _ => String::new(),
    }
}

fn wrap(result: eft_sim::Result<RigConfig>) -> PyResult<Rig> {
    result.map(|config| Rig { config }).map_err(to_python)
}

#[pymethods]
impl Rig {
    #[new]
    fn new(text: &str) -> PyResult<Self> {
        wrap(RigConfig::from_toml(text))
    }

    /// The rig of Zhao, Shield, French and Posbergh: Tables 1 and 2 and Fig. 7 of the paper.
    ///
    /// Returns
    /// -------
    /// Rig
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> eft.Rig.zhao2005()["supply.pressure"]
    /// 19000000.0
    #[staticmethod]
    fn zhao2005() -> Self {
        Self { config: RigConfig::zhao2005() }
    }

    /// Read a rig from a TOML file.
    ///
    /// Parameters
    /// ----------
    /// path : str or path-like
    ///     The file.
    ///
    /// Returns
    /// -------
    /// Rig
    ///
    /// Raises
    /// ------
    /// FileNotFoundError
    ///     If there is no such file.
    /// ValueError
    ///     If the file is not TOML (with line and column), or a key or value is not allowed (by name).
    ///
    /// Examples
    /// --------
    /// >>> import eft, pathlib, tempfile
    /// >>> path = pathlib.Path(tempfile.mkdtemp()) / "rig.toml"
    /// >>> _ = path.write_text(eft.Rig.zhao2005().to_toml(), encoding="utf-8")
    /// >>> eft.Rig.from_toml(path) == eft.Rig.zhao2005()
    /// True
    #[staticmethod]
    fn from_toml(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        wrap(py.detach(|| RigConfig::read(path)))
    }

    /// Build a rig from nested dictionaries, as from `to_dict`.
    ///
    /// Parameters
    /// ----------
    /// mapping : mapping
    ///     Sections by name, each with its keys.
    ///
    /// Returns
    /// -------
    /// Rig
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a key is unknown or missing, or a value is not allowed; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> sections = eft.Rig.zhao2005().to_dict()
    /// >>> sections["structure"]["mass"] = "8 t"
    /// >>> eft.Rig.from_dict(sections)["structure.mass"]
    /// 8000.0
    #[staticmethod]
    fn from_dict(mapping: &Bound<'_, PyMapping>) -> PyResult<Self> {
        wrap(RigConfig::from_tree(values::tree_from_python(mapping)?))
    }

    /// Return the configuration as TOML text, with the meaning of every key if `comments` is true.
    ///
    /// Parameters
    /// ----------
    /// comments : bool
    ///     Whether each key has its meaning beside it, and absent keys are listed as comments.
    ///
    /// Returns
    /// -------
    /// str
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> rig = eft.Rig.zhao2005()
    /// >>> eft.Rig(rig.to_toml()) == rig
    /// True
    #[pyo3(signature = (*, comments=false))]
    fn to_toml(&self, comments: bool) -> String {
        if comments { self.config.to_commented_toml() } else { self.config.to_toml() }
    }

    /// Return the configuration as nested dictionaries of plain Python values.
    ///
    /// Returns
    /// -------
    /// dict
    ///     Sections by name, each with its keys.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> eft.Rig.zhao2005().to_dict()["structure"]["mass"]
    /// 7040.0
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        values::to_python(py, &Value::Table(self.config.to_tree()))
    }

    /// Return a new rig with some values replaced.
    ///
    /// Parameters
    /// ----------
    /// changes : mapping
    ///     Dotted keys with their new values, such as ``{"compensation.mode": "linear"}``. A whole section
    ///     may be given as a mapping, and `None` removes an optional value. The checks run after all changes.
    ///
    /// Returns
    /// -------
    /// Rig
    ///     The rig itself is unchanged.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a key is unknown or a value is not allowed; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> rig = eft.Rig.zhao2005().replace({"compensation.level": 0.95, "truth.structure.mass": "9 t"})
    /// >>> rig["structure.mass"], rig.plant["structure.mass"]
    /// (7040.0, 9000.0)
    fn replace(&self, changes: &Bound<'_, PyMapping>) -> PyResult<Self> {
        let (mut set, mut removed) = (Vec::new(), Vec::new());
        for item in changes.items()?.iter() {
            let (key, value) = item.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>()?;
            let Ok(key) = key.extract::<String>() else {
                return Err(crate::errors::refuse("key", key.repr()?, "must be a string"));
            };
            match values::from_python(&key, &value)? {
                Some(value) => set.push((key, value)),
                None => removed.push(key),
            }
        }
        wrap(self.config.edit(&removed, &set))
    }

    /// The true rig, in which the values of ``truth`` replace those that the controller knows.
    #[getter]
    fn plant(&self) -> Self {
        Self { config: self.config.plant().clone() }
    }

    /// Return the keys that are set but have no effect, each with the value of another key that it needs.
    ///
    /// They are not an error, because a study may vary one key without the other.
    ///
    /// Returns
    /// -------
    /// list of str
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> eft.Rig.zhao2005().replace({"compensation.look_ahead": True}).idle_keys()
    /// ['compensation.look_ahead needs compensation.feedforward = true']
    fn idle_keys(&self) -> Vec<String> {
        self.config.idle_keys()
    }

    /// Return the value of a dotted key, a dictionary for a section, or `None` for an absent optional value.
    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        match self.config.get(key) {
            Ok(Some(value)) => values::to_python(py, &value),
            Ok(None) => Ok(py.None().into_bound(py)),
            Err(error) => Err(PyKeyError::new_err(error.to_string())),
        }
    }

    /// Return whether the key or section exists, with or without a value.
    fn __contains__(&self, key: &Bound<'_, PyAny>) -> bool {
        key.extract::<&str>().is_ok_and(|key| self.config.get(key).is_ok())
    }

    /// Return the dotted keys of the configuration, in the order of files, without those under ``truth``.
    ///
    /// Returns
    /// -------
    /// list of str
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> rig = eft.Rig.zhao2005()
    /// >>> {key: rig[key] for key in rig.keys() if key.startswith("supply.")}["supply.pressure"]
    /// 19000000.0
    #[allow(clippy::unused_self, reason = "the same for every rig")]
    fn keys(&self) -> Vec<&'static str> {
        KEYS.iter().map(|row| row.key).collect()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        PyList::new(py, self.keys())?.call_method0("__iter__")
    }

    #[allow(clippy::unused_self, reason = "the same for every rig")]
    fn __len__(&self) -> usize {
        KEYS.len()
    }

    /// Completions of ``rig["`` in IPython: keys and sections, also those under ``truth``.
    fn _ipython_key_completions_(&self) -> Vec<String> {
        let mut all: Vec<String> = Vec::new();
        for row in KEYS.iter() {
            let section = row.key.rsplit_once('.').map(|(section, _)| section.to_owned());
            for key in section.into_iter().chain([row.key.to_owned()]) {
                if !all.contains(&key) && self.config.get(&key).is_ok() {
                    all.push(key);
                }
            }
        }
        let of_plant = KEYS.iter().map(|row| format!("truth.{}", row.key));
        all.extend(of_plant.filter(|key| self.config.get(key).is_ok()));
        all
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.config == other.config
    }

    fn __repr__(&self) -> String {
        let config = &self.config;
        format!(
            "<eft.Rig {}: {} compensation at level {}, {} controller at {} Hz, {} structure>",
            config.name.as_deref().unwrap_or("without a name"),
            word(config, "compensation.mode"),
            config.compensation.level,
            // A designed loop is digital, whatever its key says.
            if config.controller.realization == Realization::Digital { "digital" } else { "analog" },
            config.controller.sample_rate,
            word(config, "structure.kind"),
        )
    }

    fn __getnewargs__(&self) -> (String,) {
        (self.config.to_toml(),)
    }
}

/// Whether a rig has an actuator on each of several floors.
pub(crate) fn is_building(rig: &RigConfig) -> bool {
    rig.structure.kind == StructureKind::ShearBuilding
}
