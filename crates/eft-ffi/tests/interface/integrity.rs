//! Every flipped bit of a configuration or a state changes its checksum.

use std::hint::black_box;
use std::mem::MaybeUninit;

use eft_core::{
    Channel, ChannelState, Learner, LearnerState, Parameters, PlausibilityParameters, ProtectionParameters,
};
use eft_ffi::*;

use crate::rig::{GUARDED, LEARNING, at_rest, for_c};

/// Parameters with every optional part of a channel.
const WATCHED: Parameters = Parameters {
    protection: match GUARDED.protection {
        Some(protection) => {
            Some(ProtectionParameters { plausibility: Some(PlausibilityParameters::DEFAULT), ..protection })
        }
        None => None,
    },
    ..GUARDED
};

/// Flips each bit of a value. Returns the number of flips that change the value, and of those that change the checksum.
/// A flip in the padding between the fields changes neither.
fn flipped<V: PartialEq + Copy>(value: &V, word: fn(&V) -> u32) -> (usize, usize) {
    // `black_box`, because the compiler must not assume that a flipped bool or enum is valid.
    let (word, same) = (black_box(word), black_box(V::eq as fn(&V, &V) -> bool));
    let sound = MaybeUninit::new(*value);
    let right = word(value);
    let (mut different, mut noticed) = (0, 0);
    for place in 0..size_of::<V>() {
        for bit in 0..8 {
            let mut other = sound;
            // Safety: within the value.
            let (seen, changed) = unsafe {
                *other.as_mut_ptr().cast::<u8>().add(place) ^= 1 << bit;
                let other = black_box(other.as_ptr());
                (word(&*other) != right, !same(&*other, value))
            };
            (different, noticed) = (different + usize::from(changed), noticed + usize::from(seen));
            // A change of the value without a change of the checksum would be a missing field.
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
    // Most of it are the 21 rows of three numbers of a table. The plausibility watch has a table as well.
    for (p, tables) in [(LEARNING, 1), (GUARDED, 1), (WATCHED, 2)] {
        let channel = Channel::<f32, EFT_TABLE_CAPACITY>::new(&p).unwrap();
        let (different, noticed) = flipped(&channel, Channel::integrity);
        // The sign of a zero changes the checksum only.
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
fn the_checksums_in_c_are_those_of_the_core() {
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
        assert_eq!(later, of_state, "requests are not part of it");
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
