//! Force loops that were designed before, and refusals: rigs that differ in other keys share them, and a search takes
//! up to tens of milliseconds.

use std::cell::RefCell;
use std::collections::VecDeque;

use super::force_loop::ForceLoop;
use super::held_piston::HeldPiston;
use super::known_rig::search;
use crate::{Error, Result};

/// Number of answers that are kept, those used last. A check of a rig designs its loop at 37 sample rates.
const CAPACITY: usize = 256;

/// A design, or parameter, value and rule of its refusal.
type Answer = std::result::Result<ForceLoop, [String; 3]>;

thread_local! {
    static CACHE: RefCell<VecDeque<(HeldPiston, Answer)>> = const { RefCell::new(VecDeque::new()) };
}

/// Designs a force loop.
///
/// # Errors
/// No gains keep the oil column of all deviating rigs damped, or the delay is more than 16 samples.
pub fn design(plant: &HeldPiston) -> Result<ForceLoop> {
    CACHE.with_borrow_mut(|cache| {
        let place = cache.iter().position(|(known, _)| known == plant);
        if let Some((known, answer)) = place.and_then(|place| cache.remove(place)) {
            cache.push_front((known, answer.clone()));
            return answer.map_err(|[parameter, value, allowed]| Error::Value { parameter, value, allowed });
        }
        let found = search(plant);
        let answer = match &found {
            Ok(designed) => Ok(designed.clone()),
            Err(Error::Value { parameter, value, allowed }) => {
                Err([parameter, value, allowed].map(String::clone))
            }
            Err(_) => return found,
        };
        cache.truncate(CAPACITY - 1);
        cache.push_front((plant.clone(), answer));
        found
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

    #[test]
    fn a_refusal_that_is_kept_has_the_same_words() {
        let plant = HeldPiston { leakage: 20.0 * 1.3e-11, ..zhao2005() };
        let searched = search(&plant).unwrap_err().to_string();
        assert!(searched.starts_with("controller.force_loop"), "{searched}");
        for _ in 0..2 {
            assert_eq!(design(&plant).unwrap_err().to_string(), searched);
        }
    }
}
