//! The analog electronics between sensors, converters and valve, for both boards. Replace the ranges by yours.
//!
//! Each sensor amplifier puts 0 at the middle of the converter's range and ± full scale at its ends; that of the
//! supply pressure puts 0 at the lower end. The valve amplifier drives 0 V at the middle of the converter's range.
#![no_std]

use eft_core::Input;

/// Force (N) at the end of the converter's range.
const FORCE: f32 = 156.0e3;
/// Displacement (m) there.
const DISPLACEMENT: f32 = 0.127;
/// Spool opening (1) there.
const SPOOL: f32 = 1.0;
/// Supply pressure (Pa) there.
const SUPPLY_PRESSURE: f32 = 25.0e6;
/// Valve command (V) there.
const VALVE_COMMAND: f32 = 10.0;

/// A sample of five converter codes: command, force, displacement, spool opening, supply pressure.
pub fn sample(codes: [u16; 5], bits: u32) -> Input<f32> {
    let [command, force, displacement, spool, supply_pressure] = codes.map(|code| fraction(code, bits));
    Input {
        command: FORCE * command,
        force: FORCE * force,
        displacement: DISPLACEMENT * displacement,
        spool: SPOOL * spool,
        supply_pressure: SUPPLY_PRESSURE * (0.5 + 0.5 * supply_pressure),
        ..Input::default()
    }
}

/// The code of 12 bits that drives a valve command (V).
pub fn code(valve_command: f32) -> u16 {
    // A conversion to an integer saturates, and makes 0 of NaN: 0 V.
    let steps = (2048.0 / VALVE_COMMAND * valve_command) as i16;
    steps.saturating_add(2048).clamp(0, 4095) as u16
}

/// A code between −1 and 1. One at either end means a broken wire: it becomes NaN, which the tick reports and survives.
fn fraction(code: u16, bits: u32) -> f32 {
    let half = (1_u32 << (bits - 1)) as f32;
    let last = (1_u32 << bits) - 1;
    if code == 0 || u32::from(code) >= last { f32::NAN } else { f32::from(code) / half - 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_signals() {
        let input = sample([2048, 3072, 1024, 2049, 3113], 12);
        assert_eq!([input.command, input.force, input.displacement], [0.0, 78.0e3, -0.0635]);
        assert!((input.supply_pressure - 19.0e6).abs() < 4.0e3);
        let broken = sample([32768, 0, 65535, 32768, 32768], 16);
        assert!(broken.command == 0.0 && broken.force.is_nan() && broken.displacement.is_nan());
        assert_eq!([-11.0, -10.0, 0.0, 5.0, 11.0, f32::NAN].map(code), [0, 0, 2048, 3072, 4095, 2048]);
    }
}
