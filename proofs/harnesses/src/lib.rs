//! Harnesses for [Kani](https://model-checking.github.io/kani): `cargo kani` proves each for all inputs. Without it
//! `cargo test` runs the same functions with random bits.

#[cfg(not(kani))]
mod random {
    use std::cell::Cell;

    thread_local!(static STATE: Cell<u64> = const { Cell::new(0x9e37_79b9_7f4a_7c15) });

    fn bits() -> u64 {
        // Xorshift, Marsaglia 2003.
        let mut x = STATE.get();
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        STATE.set(x);
        x
    }

    /// Random bits; half of the numbers have a usual size.
    pub(crate) fn any() -> f64 {
        let wild = bits() & 1 == 0;
        if wild { f64::from_bits(bits()) } else { (bits() as f64 / 2.0_f64.powi(63) - 1.0) * 1e3 }
    }
}
#[cfg(kani)]
use kani::any;
#[cfg(not(kani))]
use random::any;

use eft_core::{Channel, Input, Parameters, ProtectionParameters};

const RIG: Parameters<'static> = Parameters {
    valve_command: 10.0,
    protection: Some(ProtectionParameters::DEFAULT),
    ..Parameters::ZHAO2005
};

fn input() -> Input<f64> {
    Input {
        command: any(),
        velocity: any(),
        force: any(),
        spool: any(),
        displacement: any(),
        ..Input::default()
    }
}

/// Two ticks: the output is finite and within the limit, and a trip is never forgotten.
#[cfg_attr(kani, kani::proof)]
pub fn a_tick_is_bounded_and_keeps_its_trip() {
    let Ok(channel) = Channel::<f64, 21>::new(&RIG) else { return };
    let mut state = channel.at_rest();
    let first = channel.step(&mut state, &input());
    let second = channel.step(&mut state, &input());
    for out in [first, second] {
        assert!(out.voltage.abs() <= 10.0 && out.permitted_command.is_finite());
        assert!((0.0..=1.0).contains(&out.authority));
    }
    let tripped = eft_core::status::TRIPPED;
    assert!(first.status & tripped <= second.status & tripped);
}

/// An invalid measurement repeats the last output.
#[cfg_attr(kani, kani::proof)]
pub fn an_invalid_sample_repeats_the_output() {
    let Ok(channel) = Channel::<f64, 21>::new(&Parameters { protection: None, ..RIG }) else { return };
    let mut state = channel.at_rest();
    let before = channel.step(&mut state, &input()).voltage;
    let after = channel.step(&mut state, &Input { force: f64::NAN, ..input() });
    assert_eq!(after.voltage.to_bits(), before.to_bits());
    assert!(after.status & eft_core::status::INVALID_MEASUREMENT != 0);
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_harness_holds_for_random_inputs() {
        for _ in 0..50_000 {
            super::a_tick_is_bounded_and_keeps_its_trip();
            super::an_invalid_sample_repeats_the_output();
        }
    }
}
