//! Effects of a rig that no linear model has.

use crate::config::RigConfig;

/// A learning rig with the oil and the leakage of the feedforward known, each with its key, where they are not. The learner
/// takes some of the flow that they miss for a late velocity.
pub(super) fn not_learned(rig: &RigConfig) -> Vec<(&'static str, RigConfig)> {
    let (known, plant) = (&rig.actuator, &rig.plant().actuator);
    let (oil, leakage) = (known.compressibility, known.leakage);
    let mut found = Vec::new();
    if rig.compensation.adaptive && rig.compensation.feedforward {
        if plant.compressibility != oil {
            let told = rig.varied(|values| values.actuator.compressibility = oil);
            found.push(("actuator.compressibility", told));
        }
        if plant.leakage != leakage {
            found.push(("actuator.leakage", rig.varied(|values| values.actuator.leakage = leakage)));
        }
    }
    found
}
