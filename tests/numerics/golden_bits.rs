//! The golden bits of `firmware/golden/bits.txt` on this machine, from the rig files through the simulator's
//! constructors. Processors, C and Python are compared with the same file.

use eft::core::{Compensation, Input, Parameters, Realization, status};
use eft_sim::RigConfig;
use eft_sim::closed_loop::{Precision, RigChannel, parameters};

fn read(name: &str) -> RigConfig {
    let path = format!("{}/firmware/rigs/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    RigConfig::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The parameters of a channel that closes the force loop itself.
fn digital(rig: &RigConfig) -> Parameters<'_> {
    Parameters { realization: Realization::Digital, ..parameters(rig, rig.controller.sample_rate).unwrap() }
}

#[test]
fn host_computes_the_committed_bits() {
    let mut bits = String::new();
    for (name, rig) in [("zhao2005", RigConfig::zhao2005()), ("uneven", read("uneven"))] {
        let parameters = eft_golden::fixed(digital(&rig));
        let channel = <f32 as Precision>::channel(&parameters).unwrap();
        let compensation = Compensation::<f32, 21>::new(&parameters).unwrap();
        bits += &format!("{name} controller {:016x}\n", eft_golden::controller(&channel));
        bits += &format!("{name} compensation {:016x}\n", eft_golden::compensation(&compensation));
    }
    for name in ["adaptive", "guarded", "worn"] {
        let rig = read(name);
        // The other rigs have the paper's gains, and no part of a worn one.
        if name == "worn" {
            let parameters = digital(&rig);
            assert!(parameters.integral_gain > 0.0 && parameters.friction > 0.0 && parameters.overlap > 0.0);
            assert!(parameters.look_ahead && parameters.learning.curve_correction);
            let channel = <f32 as Precision>::channel(&eft_golden::fixed(parameters)).unwrap();
            bits += &format!("{name} controller {:016x}\n", eft_golden::controller(&channel));
        }
        let mut channel = RigChannel::<f32>::new(&digital(&rig), None).unwrap();
        let mut seen = 0;
        let hash = eft_golden::learning(|s| {
            let out = channel.step(&Input {
                command: s.command.into(),
                next_command: s.next_command.into(),
                velocity: s.velocity.into(),
                force: s.force.into(),
                spool: s.spool.into(),
                displacement: s.displacement.into(),
                supply_pressure: s.supply_pressure.into(),
                ..Input::default()
            });
            seen |= out.status;
            (out.voltage as f32, out.status)
        });
        bits += &format!("{name} learning {hash:016x}\n");
        // The run must include learning and a trip, or the hash would not cover them.
        let flow_gain = channel.calibration().unwrap().flow_gain;
        assert!((flow_gain - 1.0).abs() > 0.01, "{flow_gain}");
        let protected = status::TRIPPED | status::SHUT_DOWN;
        assert_eq!(seen & protected, if rig.protection.enabled { protected } else { 0 });
        assert_ne!(seen & status::INVALID_MEASUREMENT, 0);
    }
    assert_eq!(bits, eft_golden::BITS);
}

/// One changed bit of one output changes the hash.
#[test]
fn one_bit_changes_the_hash() {
    let mut a = eft_golden::Hash::EMPTY;
    let mut b = a;
    for n in 0..1000 {
        a.add(n);
        b.add(if n == 1 { n ^ 1 } else { n });
    }
    assert_ne!(a.get(), b.get());
}
