//! Force loops that were designed before: rigs that differ in other keys share a design, and a search takes
//! tens of milliseconds.

use std::cell::RefCell;
use std::collections::VecDeque;

use super::force_loop::ForceLoop;
use super::held_piston::HeldPiston;
use super::known_rig::search;
use crate::error::Result;

/// Number of designs that are kept, enough for a map with the sample rate along an axis.
const KEPT: usize = 64;

thread_local! {
    static LATEST: RefCell<VecDeque<(HeldPiston, ForceLoop)>> = const { RefCell::new(VecDeque::new()) };
}

/// Designs a force loop.
///
/// # Errors
/// No gains keep the oil column of all deviating rigs damped, or the delay is more than 16 samples.
pub fn design(plant: &HeldPiston) -> Result<ForceLoop> {
    LATEST.with_borrow_mut(|latest| {
        if let Some((_, designed)) = latest.iter().find(|(known, _)| known == plant) {
            return Ok(designed.clone());
        }
        let designed = search(plant)?;
        latest.truncate(KEPT - 1);
        latest.push_front((plant.clone(), designed.clone()));
        Ok(designed)
    })
}

#[cfg(test)]
mod tests {
    use super::super::force_loop::tests::zhao2005;
    use super::*;

    #[test]
    fn every_plant_has_its_own_design_and_keeps_it() {
        let plants = [1.0, 0.5].map(|oil| {
            let plant = zhao2005();
            HeldPiston { compressibility: oil * plant.compressibility, ..plant }
        });
        let gains = |found: ForceLoop| [found.proportional_gain, found.derivative_gain, found.integral_gain];
        let searched = plants.each_ref().map(|plant| gains(search(plant).unwrap()));
        assert_ne!(searched[0], searched[1]);
        for _ in 0..2 {
            assert_eq!(plants.each_ref().map(|plant| gains(design(plant).unwrap())), searched);
        }
    }
}
