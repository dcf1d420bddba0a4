//! The integrity word of a configuration contains the numbers of every velocity estimate.

use eft_core::{Channel, Parameters, VelocitySource};

use crate::rig::PARAMETERS;

fn word(velocity: VelocitySource) -> u32 {
    Channel::<f64, 21>::new(&Parameters { velocity_source: velocity, ..PARAMETERS }).unwrap().integrity()
}

#[test]
fn a_changed_number_of_a_velocity_estimate_changes_the_word() {
    let gains = [0.05, 40.0, 30.0];
    let other = [0.05, 40.0, 31.0];
    let estimates = [
        VelocitySource::Sensor,
        VelocitySource::Derivative { corner: 80.0 },
        VelocitySource::Derivative { corner: 81.0 },
        VelocitySource::Observer { gains, mass: 7e3 },
        VelocitySource::Observer { gains: other, mass: 7e3 },
        VelocitySource::Observer { gains, mass: 7.1e3 },
        VelocitySource::Accelerometer { gains },
        VelocitySource::Accelerometer { gains: other },
    ];
    let words = estimates.map(word);
    for (n, one) in words.iter().enumerate() {
        assert_eq!(words.iter().position(|word| word == one), Some(n), "{:?}", estimates[n]);
    }
    assert_eq!(words, estimates.map(word));
}
