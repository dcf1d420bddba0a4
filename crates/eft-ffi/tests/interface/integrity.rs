//! A word over a configuration or state sees every bit of it that flips.

use std::hint::black_box;
use std::mem::MaybeUninit;

use eft_core::{
    Channel, ChannelState, Learner, LearnerState, Parameters, PlausibilityParameters, ProtectionParameters,
};
use eft_ffi::*;

use crate::rig::{GUARDED, LEARNING, at_rest, for_c};

/// With every part that a channel may have.
const WATCHED: Parameters = Parameters {
    protection: match GUARDED.protection {
        Some(protection) => {
            Some(ProtectionParameters { plausibility: Some(PlausibilityParameters::DEFAULT), ..protection })
        }
        None => None,
    },
    ..GUARDED
};

/// Flips each bit of a value, and says how many of those that make another value change the word. What lies between the
/// fields makes no other value.
fn flipped<V: PartialEq + Copy>(value: &V, word: fn(&V) -> u32) -> (usize, usize) {
    // The compiler knows of neither, since it may not know what a flipped truth value or variant leads to.
    let (word, same) = (black_box(word), black_box(V::eq as fn(&V, &V) -> bool));
    let sound = MaybeUninit::new(*value);
    let right = word(value);
    let (mut different, mut noticed) = (0, 0);
    for place in 0..size_of::<V>() {
        for bit in 0..8 {
            let mut other = sound;
            // Safety: within the value, whose bytes stay what a memory fault makes of them.
            let (seen, changed) = unsafe {
                *other.as_mut_ptr().cast::<u8>().add(place) ^= 1 << bit;
                let other = black_box(other.as_ptr());
                (word(&*other) != right, !same(&*other, value))
            };
            (different, noticed) = (different + usize::from(changed), noticed + usize::from(seen));
            // A change that the comparison sees and the word does not would be a field that was left out.
            assert!(seen || !changed, "{}: byte {place}, bit {bit}", std::any::type_name::<V>());
        }
    }
    assert_eq!(word(value), right);
    (different, noticed)
}

// SR-17
#[test]
#[cfg_attr(miri, ignore = "a flipped variant is no value of its type")]
fn every_flipped_bit_of_a_configuration_changes_its_word() {
    // A table's 21 rows of three numbers are most of it; the watch has one of its own.
    for (p, tables) in [(LEARNING, 1), (GUARDED, 1), (WATCHED, 2)] {
        let channel = Channel::<f32, EFT_TABLE_CAPACITY>::new(&p).unwrap();
        let (different, noticed) = flipped(&channel, Channel::integrity);
        // A zero with a sign is equal to one without.
        assert!(noticed >= different && different > 8 * tables * 21 * 12, "{different} {noticed}");
    }
    let double = Channel::<f64, EFT_TABLE_CAPACITY>::new(&WATCHED).unwrap();
    let (different, noticed) = flipped(&double, Channel::integrity);
    assert!(noticed >= different && different > 8 * 2 * 21 * 24, "{different} {noticed}");
}

// SR-17
#[test]
#[cfg_attr(miri, ignore = "a flipped variant is no value of its type")]
fn every_flipped_bit_of_a_state_changes_its_word() {
    let channel = Channel::<f32, EFT_TABLE_CAPACITY>::new(&WATCHED).unwrap();
    let state: ChannelState<f32> = channel.at_rest();
    let (different, noticed) = flipped(&state, ChannelState::integrity);
    assert!(noticed >= different && different > 8 * 400, "{different} {noticed}");
}

// SR-17
#[test]
#[cfg_attr(miri, ignore = "a flipped variant is no value of its type")]
fn every_flipped_bit_of_a_learner_changes_its_word() {
    let learner = Learner::<f32, EFT_TABLE_CAPACITY>::new(&GUARDED).unwrap();
    let (different, noticed) = flipped(&learner, Learner::integrity);
    assert!(noticed >= different && different > 8 * 21 * 12, "{different} {noticed}");
    let state: LearnerState<f32> = learner.at_rest();
    let (different, noticed) = flipped(&state, LearnerState::integrity);
    assert!(noticed >= different && different > 8 * 400, "{different} {noticed}");
}

#[test]
fn the_words_of_c_are_those_of_the_core() {
    let parameters = for_c(&GUARDED);
    let (mut channel, mut state) = at_rest(&parameters);
    let (mut word, mut of_state, mut later) = (0, 0, 0);
    // Safety: every pointer is valid; a number's bit makes another number.
    unsafe {
        assert_eq!(eft_integrity_f32(&*channel, &mut word), EFT_OK);
        assert_eq!(eft_state_integrity_f32(&raw const *state, &mut of_state), EFT_OK);
        let core = Channel::<f32, EFT_TABLE_CAPACITY>::new(&GUARDED).unwrap();
        assert_eq!((word, of_state), (core.integrity(), core.at_rest().integrity()));
        *(&raw mut *channel).cast::<u32>().add(7) ^= 1 << 12;
        assert_eq!(eft_integrity_f32(&*channel, &mut later), EFT_OK);
        assert_ne!(later, word);
        assert_eq!(eft_request_trip_f32(&raw mut *state), EFT_OK);
        assert_eq!(eft_state_integrity_f32(&raw const *state, &mut later), EFT_OK);
        assert_eq!(later, of_state, "what is asked for is no part of it");
        let mut learner = MaybeUninit::uninit();
        let mut learned = MaybeUninit::uninit();
        assert_eq!(
            eft_learner_configure_f32(&parameters, learner.as_mut_ptr(), std::ptr::null_mut()),
            EFT_OK
        );
        assert_eq!(eft_learner_reset_f32(learner.as_ptr(), learned.as_mut_ptr()), EFT_OK);
        assert_eq!(eft_learner_integrity_f32(learner.as_ptr(), &mut word), EFT_OK);
        assert_eq!(eft_learner_state_integrity_f32(learned.as_ptr(), &mut of_state), EFT_OK);
        let core = Learner::<f32, EFT_TABLE_CAPACITY>::new(&GUARDED).unwrap();
        assert_eq!((word, of_state), (core.integrity(), core.at_rest().integrity()));
    }
}
