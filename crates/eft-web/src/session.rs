//! One test from the settings of a page.

use eft_sim::excitation::{Command, sine_sweep};
use eft_sim::{Error, Result, RigConfig, SimulateOptions, TestRun, simulate};

/// Largest number of samples of a page, so that a link cannot fill the memory.
const MOST_SAMPLES: f64 = 400_000.0;
/// Band of the ratio of the spectra (Hz).
const BAND: (f64, f64) = (0.25, 10.0);
/// Number of frequencies in the band.
const FREQUENCIES: usize = 300;
/// Number of samples per mean; in this band the means are as good as the samples.
const BLOCK: usize = 32;

/// The results of a test for a page.
#[derive(Debug, Clone, Default)]
pub struct Told {
    /// Force command (N).
    pub command: Vec<f64>,
    /// True force (N).
    pub force: Vec<f64>,
    /// Spool opening (1).
    pub spool: Vec<f64>,
    /// Displacement (m).
    pub displacement: Vec<f64>,
    /// Frequencies (Hz) of the ratio.
    pub frequency: Vec<f64>,
    /// |FFT(force)| / |FFT(command)| at these frequencies.
    pub ratio: Vec<f64>,
    /// Sample rate (Hz), rms force error over rms command, largest spool opening, and status bits.
    pub numbers: Vec<f64>,
    /// Rig and command as TOML, for `eft run`.
    pub toml: String,
    /// [`hash`] of the force in hexadecimal.
    pub hash: String,
}

/// A test from settings: one line `key = value` for each difference from the paper's rig. A value is a
/// number, `true`, `false`, a text in quotation marks, a list of numbers in brackets, or `none` to remove a
/// key. The last value of a key counts. The keys of the command are `command.amplitude` (N),
/// `command.f_start`, `command.f_end` (Hz) and `command.duration` (s); all others are the rig's.
#[derive(Debug, Clone)]
pub struct Session {
    rig: RigConfig,
    sweep: Sweep,
}

#[derive(Debug, Clone, Copy)]
struct Sweep {
    amplitude: f64,
    f_start: f64,
    f_end: f64,
    duration: f64,
}

impl Session {
    /// Reads the settings.
    ///
    /// # Errors
    /// A line that is not a setting, an unknown key, a value that is not allowed, or a command of too many
    /// samples.
    pub fn new(settings: &str) -> Result<Self> {
        let mut sweep = Sweep { amplitude: 8900.0, f_start: 0.0, f_end: 10.0, duration: 32.0 };
        let (mut removed, mut changes) = (Vec::new(), Vec::new());
        for line in settings.lines().filter(|line| !line.trim().is_empty()) {
            let (key, text) = line.split_once('=').ok_or_else(|| {
                Error::value("settings", format!("{line:?}"), "must be key = value in every line")
            })?;
            let (key, text) = (key.trim(), text.trim());
            if text == "none" {
                removed.push(key.to_owned());
                continue;
            }
            let value = value_of(text).ok_or_else(|| {
                let allowed =
                    "must be true, false, none, a number, a list of numbers or a text in quotation marks";
                Error::value(key, text, allowed)
            })?;
            match key.strip_prefix("command.") {
                Some(name) => sweep.set(name, &value)?,
                None => changes.push((key.to_owned(), value)),
            }
        }
        let rig = RigConfig::zhao2005().edit(&removed, &changes)?;
        let samples = sweep.duration * rig.controller.sample_rate;
        let few = samples <= MOST_SAMPLES;
        if !few {
            let allowed = format!("must be of at most {MOST_SAMPLES} samples here");
            return Err(Error::value("command.duration", sweep.duration, allowed));
        }
        Ok(Self { rig, sweep })
    }

    /// The test's run.
    ///
    /// # Errors
    /// A command or a rig that cannot be simulated.
    pub fn run(&self) -> Result<TestRun> {
        simulate::<f64>(&self.rig, &self.command()?, &SimulateOptions::default(), |_, _| true)
    }

    /// The results of the run for a page.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn tell(&self) -> Result<Told> {
        let run = self.run()?;
        let rate = run.sample_rate;
        let step = (BAND.1 - BAND.0) / (FREQUENCIES - 1) as f64;
        let frequency: Vec<f64> = (0..FREQUENCIES).map(|i| BAND.0 + step * i as f64).collect();
        let [command, force] = [&run.command, &run.force].map(|signal| means(signal));
        let block = BLOCK as f64 / rate;
        let at = |f: &f64| strength(&force, f * block) / strength(&command, f * block);
        let ratio = frequency.iter().map(at).collect();
        let status = run.status.iter().fold(0, |all, status| all | status);
        let spool = run.spool.iter().fold(0.0_f64, |most, x| if x.abs() > most { x.abs() } else { most });
        let numbers = vec![rate, error(&run), spool, f64::from(status)];
        let (hash, toml) = (format!("{:016x}", hash(&run.force)), self.to_toml());
        let traces = run.traces;
        Ok(Told {
            command: traces.command,
            force: traces.force,
            spool: traces.spool,
            displacement: traces.displacement,
            frequency,
            ratio,
            numbers,
            toml,
            hash,
        })
    }

    fn command(&self) -> Result<Command> {
        let Sweep { amplitude, f_start, f_end, duration } = self.sweep;
        sine_sweep(amplitude, f_start, f_end, duration, self.rig.controller.sample_rate)
    }

    /// The test as a file that `eft run` reads.
    fn to_toml(&self) -> String {
        let Sweep { amplitude, f_start, f_end, duration } = self.sweep;
        format!(
            "{}\n[command]\nkind = \"sweep\"\namplitude = {amplitude:?}\nf_start = {f_start:?}\nf_end = {f_end:?}\n\
             duration = {duration:?}\n",
            self.rig.to_toml()
        )
    }
}

impl Sweep {
    fn set(&mut self, name: &str, value: &toml::Value) -> Result<()> {
        let place = match name {
            "amplitude" => &mut self.amplitude,
            "f_start" => &mut self.f_start,
            "f_end" => &mut self.f_end,
            "duration" => &mut self.duration,
            _ => {
                let allowed = "must be amplitude, f_start, f_end or duration";
                return Err(Error::value("command", name, allowed));
            }
        };
        let number = value.as_float().or(value.as_integer().map(|whole| whole as f64));
        *place = number.ok_or_else(|| Error::value(&format!("command.{name}"), value, "must be a number"))?;
        Ok(())
    }
}

/// Parses a value. A page writes these kinds only, and a TOML parser would be a tenth of the module.
fn value_of(text: &str) -> Option<toml::Value> {
    if let Some(inside) = text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
        let numbers = inside.split(',').map(|one| one.trim().parse::<f64>().ok().map(toml::Value::from));
        return numbers.collect::<Option<Vec<_>>>().map(Into::into);
    }
    if let Some(inside) = text.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) {
        return Some(inside.into());
    }
    match text {
        "true" => Some(true.into()),
        "false" => Some(false.into()),
        _ => text.parse::<f64>().ok().map(Into::into),
    }
}

/// Rms of the force error over that of the command; 1 if there is no command.
fn error(run: &TestRun) -> f64 {
    let pairs = || run.force.iter().zip(&run.command);
    let missed: f64 = pairs().map(|(force, command)| (force - command) * (force - command)).sum();
    let wanted: f64 = pairs().map(|(_, command)| command * command).sum();
    if wanted > 0.0 { (missed / wanted).sqrt() } else { 1.0 }
}

/// Means over blocks.
fn means(signal: &[f64]) -> Vec<f64> {
    signal.chunks_exact(BLOCK).map(|block| block.iter().sum::<f64>() / BLOCK as f64).collect()
}

/// Magnitude of a signal's Fourier transform at a frequency (cycles a sample), by Goertzel's recursion. A
/// page needs few frequencies, and a full transform would be a quarter of the module.
fn strength(signal: &[f64], frequency: f64) -> f64 {
    let factor = 2.0 * libm::cos(std::f64::consts::TAU * frequency);
    let (last, before) =
        signal.iter().fold((0.0, 0.0), |(last, before), value| (value + factor * last - before, last));
    (last * last + before * before - factor * last * before).sqrt()
}

/// FNV-1a over the bits of numbers.
pub fn hash(values: &[f64]) -> u64 {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_rig_can_be_said() {
        let settings = "servovalve.flow_table.openings = [-1, 0, 1.0]\n\
                        servovalve.flow_table.flows = [-1e-3, 0, 1e-3]\nstructure.kind = \"linear\"\n\
                        structure.softening.displacement = none\nstructure.softening.stiffness = none\n\
                        structure.mass = 1\nstructure.mass = 9000.0";
        let rig = Session::new(settings).unwrap().rig;
        assert_eq!((rig.servovalve.flow_table.flows[2], rig.structure.mass), (1e-3, 9000.0));
        assert!(rig.structure.softening.is_none());
        for settings in ["servovalve.flow_table.flows = [1, x]", "structure.mass = none"] {
            assert!(Session::new(settings).is_err(), "{settings}");
        }
    }

    #[test]
    fn settings_are_read_and_wrong_ones_named() {
        let short = "command.duration = 1\ncompensation.mode = \"linear\"\n";
        let told = Session::new(short).unwrap().tell().unwrap();
        assert_eq!((told.force.len(), told.numbers[0]), (4096, 4096.0));
        assert_eq!(told.hash, format!("{:016x}", hash(&told.force)));
        for (settings, named) in [
            ("nonsense", "settings"),
            ("compensation.levle = 1", "levle"),
            ("compensation.level = ", "compensation.level"),
            ("command.duration = 1e9", "command.duration"),
            ("command.duration = nan", "command.duration"),
            ("command.amplitude = \"much\"", "command.amplitude"),
            ("command.what = 1", "what"),
        ] {
            let error = Session::new(settings).map(|_| ()).unwrap_err().to_string();
            assert!(error.contains(named), "{error}");
        }
    }
}
