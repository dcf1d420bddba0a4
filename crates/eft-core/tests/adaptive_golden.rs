//! The adaptive controller's bits on this machine are those on the microcontrollers.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

#[path = "../../../firmware/budgets/src/golden.rs"]
mod golden;
mod rig;

use eft_core::{AdaptiveController, FlowTable};

#[test]
fn the_hosts_bits_are_the_microcontrollers() {
    let table = FlowTable::<f32, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap();
    let controller: AdaptiveController<f32, 21> = rig::adaptive_f32(&rig::ADAPTIVE, &table);
    let (hash, flow_gain) = golden::hash(&controller, &table);
    // It has learned (the force swings as well, and takes some flow), or the hash would say little.
    assert!((1.04..1.07).contains(&flow_gain), "{flow_gain}");
    assert_eq!(hash, golden::HASH, "{hash:#010x}");
}
