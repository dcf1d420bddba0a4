//! The bits of the firmware on this machine, from the rig files through the simulator's own construction: those that
//! `firmware/golden/bits.txt` holds, which the processors, C and Python are held to as well.
#![allow(clippy::unwrap_used)]

use eft::core::status;
use eft_sim::RigConfig;
use eft_sim::closed_loop::{Channel, Precision, Reach, Sample};

fn read(name: &str) -> RigConfig {
    let path = format!("{}/firmware/rigs/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    RigConfig::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn host_computes_the_committed_bits() {
    let mut bits = String::new();
    for (name, rig) in [("zhao2005", RigConfig::zhao2005()), ("uneven", read("uneven"))] {
        let core = <f32 as Precision>::controller(&rig, rig.controller.sample_rate).unwrap();
        bits += &format!("{name} controller {:016x}\n", eft_golden::controller(&core));
        bits += &format!("{name} compensation {:016x}\n", eft_golden::compensation(&core));
        bits += &format!("{name} further_flow {:016x}\n", eft_golden::further_flow(&core));
    }
    for rig in [read("adaptive"), read("guarded")] {
        // The simulator's own order of what stands around the controller.
        let mut channel = Channel::<f32>::new(&rig, rig.controller.sample_rate, Reach::ValveCommand).unwrap();
        let mut seen = 0;
        let hash = eft_golden::learning(|s| {
            let out = channel.step(&Sample {
                command: s.command.into(),
                next_command: s.command.into(),
                velocity: s.velocity.into(),
                force: s.force.into(),
                spool: s.spool.into(),
                displacement: s.displacement.into(),
                acceleration: 0.0,
                valve_command: 0.0,
                supply_pressure: s.supply_pressure.into(),
            });
            seen |= out.status;
            (out.value as f32, out.status)
        });
        bits += &format!("{} learning {hash:016x}\n", rig.name.as_deref().unwrap());
        // It has learned, and been tripped, or the hash would say little.
        let flow_gain = channel.learned().unwrap().flow_gain();
        assert!((flow_gain - 1.0).abs() > 0.01, "{flow_gain}");
        let protected = status::TRIPPED | status::SHUT_DOWN;
        assert_eq!(seen & protected, if rig.protection.enabled { protected } else { 0 });
        assert_ne!(seen & status::INVALID_MEASUREMENT, 0);
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
