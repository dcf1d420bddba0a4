//! The bits of the firmware on this machine, from the rig files through the simulator's own construction: those that
//! `firmware/golden/bits.txt` holds, which the processors, C and Python are held to as well.
#![allow(clippy::unwrap_used)]

use eft_sim::RigConfig;
use eft_sim::closed_loop::Precision;

#[test]
fn host_computes_the_committed_bits() {
    let uneven = concat!(env!("CARGO_MANIFEST_DIR"), "/firmware/rigs/uneven.toml");
    let uneven = RigConfig::from_toml(&std::fs::read_to_string(uneven).unwrap()).unwrap();
    let mut bits = String::new();
    for (name, rig) in [("zhao2005", RigConfig::zhao2005()), ("uneven", uneven)] {
        let core = <f32 as Precision>::controller(&rig, rig.controller.sample_rate).unwrap();
        bits += &format!("{name} controller {:016x}\n", eft_golden::controller(&core));
        bits += &format!("{name} compensation {:016x}\n", eft_golden::compensation(&core));
        bits += &format!("{name} further_flow {:016x}\n", eft_golden::further_flow(&core));
    }
    assert_eq!(bits, eft_golden::BITS);
}

/// One bit of one answer makes another hash.
#[test]
fn hash_sees_one_bit() {
    let mut a = eft_golden::Hash::EMPTY;
    let mut b = a;
    for n in 0..1000 {
        a.add(n);
        b.add(if n == 1 { n ^ 1 } else { n });
    }
    assert_ne!(a.get(), b.get());
}
