//! The exchange of samples and valve commands, for which a board has converters, and the controller's estimates.

use eft_core::{Calibration, Input, Output};
use semihosting::fs::{File, OpenOptions};
use semihosting::io::{Read, Write};
use semihosting::process;

/// The two files.
pub struct Converters {
    input: File,
    output: File,
}

impl Converters {
    /// Opens them, or ends the program.
    pub fn open() -> Self {
        // The order matters, since each end of a pipe waits for the other.
        let Ok(input) = File::open(c"to-firmware") else { process::exit(2) };
        let output = OpenOptions::new().write(true).truncate(true).create(true).open(c"from-firmware");
        let Ok(output) = output else { process::exit(2) };
        Self { input, output }
    }

    /// The next sample; the end of the test ends the program.
    pub fn sample(&mut self) -> Input<f32> {
        let mut bytes = [[0; 4]; 8];
        if self.input.read_exact(bytes.as_flattened_mut()).is_err() {
            process::exit(0)
        }
        let [command, velocity, force, spool, displacement, supply_pressure, acceleration, next_command] =
            bytes.map(f32::from_le_bytes);
        Input {
            command,
            velocity,
            force,
            spool,
            displacement,
            supply_pressure,
            acceleration,
            next_command,
            ..Input::default()
        }
    }

    /// Writes a tick's result and the calibration in use.
    pub fn put(&mut self, out: &Output<f32>, calibration: &Calibration<f32>) {
        let bytes = [
            out.voltage.to_le_bytes(),
            out.compensation.to_le_bytes(),
            out.status.to_le_bytes(),
            out.velocity.to_le_bytes(),
            calibration.flow_gain.to_le_bytes(),
            calibration.response_delay.to_le_bytes(),
            calibration.valve_gain.to_le_bytes(),
            calibration.level.to_le_bytes(),
        ];
        if self.output.write_all(bytes.as_flattened()).is_err() {
            process::exit(2)
        }
    }
}
