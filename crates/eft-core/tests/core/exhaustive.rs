//! The flow table's inverse and the load-pressure factor for all 2^32 inputs in `f32`: finite, in range, and monotone
//! where required. The complete tests are for release builds; `make firmware` runs them on all cores.

use std::ops::RangeInclusive;
use std::thread;

use eft_core::{FlowTable, LoadPressure};

use crate::rig;

/// The bits of the `k`-th `f32`, from the negative NaNs over −∞, −0, 0 and ∞ to the positive NaNs.
fn ordered(k: u32) -> f32 {
    f32::from_bits(if k < 0x8000_0000 { !k } else { k ^ 0x8000_0000 })
}

/// Calls `check` on all cores for every `stride`-th input in rising order, with its result, the previous input and that
/// one's result. At the start of a part and for NaN the previous input is the same.
fn each<R: Copy>(stride: u32, of: impl Fn(f32) -> R + Sync, check: impl Fn((f32, R), (f32, R)) + Sync) {
    let parts = thread::available_parallelism().map_or(1, |n| n.get() as u32) * 16;
    let next = std::sync::atomic::AtomicU32::new(0);
    let work = || {
        loop {
            let part = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            if part >= parts {
                break;
            }
            let edge = |part: u32| (u64::from(part) << 32).div_euclid(u64::from(parts));
            let taken = |k: u64| {
                let x = ordered(k as u32);
                (x, of(x))
            };
            // From the last input of the previous part, so that no pair between two parts is missed.
            let mut k = edge(part).saturating_sub(u64::from(stride));
            let mut before = taken(k);
            while k < edge(part + 1) {
                let now = taken(k);
                check(if before.0.is_nan() || now.0.is_nan() { now } else { before }, now);
                before = now;
                k += u64::from(stride);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 1..parts / 16 {
            scope.spawn(work);
        }
        work();
    });
}

fn table_inverse(stride: u32) {
    let uneven = (
        [-1.0, -0.62, -0.2, -0.05, -0.04, 0.0, 0.03, 0.25, 1.0],
        [-0.0101, -0.0083, -0.0034, -6.0e-4, -4.0e-4, 0.0, 5.0e-4, 0.0045, 0.0107],
    );
    let tables = [
        FlowTable::<f32, 21>::new(rig::PARAMETERS.openings, rig::PARAMETERS.flows).unwrap(),
        FlowTable::<f32, 21>::new(&uneven.0, &uneven.1).unwrap(),
    ];
    assert!(!tables[0].inverse().is_crowded() && tables[1].inverse().is_crowded());
    for table in &tables {
        let opening = |flow| table.opening(flow);
        each(stride, opening, |(before, lower), (flow, opening)| {
            assert!((-1.0..=1.0).contains(&opening), "{flow:e} gives {opening:e}");
            assert!(lower <= opening, "falls from {before:e} to {flow:e}");
        });
    }
}

fn load_pressure_factor(stride: u32) {
    let correction = LoadPressure::<f32>::new(8.212e-3, 1.9e7).unwrap();
    // 1/√0.05, rounded upwards.
    let range: RangeInclusive<f32> = 0.0..=4.472_136_5;
    let factors = |force| [1.0, -1.0, 0.0].map(|direction| correction.factor(force, direction));
    each(stride, factors, |(before, factors_before), (force, factors)| {
        let [(opening, _), (closing, _), (none, floored)] = factors;
        assert!(range.contains(&opening) && range.contains(&closing), "{force:e}: {opening:e}, {closing:e}");
        assert!(none.to_bits() == 1.0_f32.to_bits() && !floored, "{force:e} without a direction: {none:e}");
        assert!(factors_before[0].0 <= opening, "falls from {before:e} to {force:e}");
        assert!(factors_before[1].0 >= closing, "rises from {before:e} to {force:e}");
    });
    let of = |direction: f32| correction.factor(5.0e4, direction).0.to_bits();
    let [opening, closing, none] = [1.0, -1.0, 0.0].map(of);
    each(stride, of, |_, (direction, bits)| {
        let expected = if direction > 0.0 {
            opening
        } else if direction < 0.0 {
            closing
        } else {
            none
        };
        assert_eq!(bits, expected, "{direction:e}");
    });
}

#[test]
fn inputs_come_in_order_without_a_gap() {
    let count = std::sync::atomic::AtomicU64::new(0);
    each(
        1 << 12,
        |x| x,
        |(before, _), (x, result)| {
            count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            assert!(x.is_nan() || (before <= x && result.to_bits() == x.to_bits()));
        },
    );
    // Each part begins with the end of the previous part.
    assert!(count.into_inner() >= 1 << 20);
    assert_eq!(
        [0x007f_ffff, 0x7fff_ffff, 0x8000_0000].map(|k| ordered(k).to_bits()),
        [0xff80_0000, 0x8000_0000, 0]
    );
}

#[test]
fn one_in_4099_through_the_table_inverse() {
    table_inverse(4099);
}

#[test]
fn one_in_4099_through_the_load_pressure_factor() {
    load_pressure_factor(4099);
}

#[test]
#[ignore = "a minute in a release build"]
fn every_f32_through_the_table_inverse() {
    table_inverse(1);
}

#[test]
#[ignore = "a minute in a release build"]
fn every_f32_through_the_load_pressure_factor() {
    load_pressure_factor(1);
}
