use super::*;
use crate::description::resource;

fn instance(part: Part) -> Instance {
    let text = resource(&RigConfig::zhao2005(), part).unwrap();
    Instance::new(&text, &description::token(part, &text)).unwrap()
}

/// The value references of these names.
fn at(instance: &Instance, names: &[&str]) -> Vec<u32> {
    names.iter().map(|name| instance.names()[name]).collect()
}

fn start(instance: &mut Instance) {
    instance.set_start(0.0).unwrap();
    instance.enter_initialization().unwrap();
    instance.exit_initialization().unwrap();
}

const STEP: f64 = 1.0 / 4096.0;

#[test]
fn parameters_are_checked_and_take_effect() {
    let mut rig = instance(Part::Rig);
    let mass = at(&rig, &["structure.mass"]);
    let text = |result: Result<()>| result.unwrap_err().to_string();
    for bad in [f64::NAN, -1.0, f64::INFINITY] {
        assert!(text(rig.set(&mass, Type::Real, &[bad])).starts_with("structure.mass = "), "{bad}");
    }
    assert!(text(rig.set(&mass, Type::Integer, &[1.0])).contains("must be asked for as Real"));
    assert!(text(rig.set(&[9999], Type::Real, &[1.0])).starts_with("value reference = 9999"));
    let both = at(&rig, &["structure.damping", "structure.mass"]);
    assert!(rig.set(&both, Type::Real, &[7.0, -1.0]).is_err());
    assert_eq!(rig.get(&both, Type::Real).unwrap(), [rig.table[both[0] as usize].start, 7040.0]);
    let force = at(&rig, &["force"]);
    assert!(text(rig.set(&force, Type::Real, &[1.0])).contains("the FMU computes it"));
    rig.set(&mass, Type::Real, &[100.0]).unwrap();
    start(&mut rig);
    assert!(text(rig.set(&mass, Type::Real, &[1.0])).contains("before the initialization ends"));
    let valve = at(&rig, &["valve_command"]);
    rig.set(&valve, Type::Real, &[1.0]).unwrap();
    rig.do_step(0.0, 40.0 * STEP).unwrap();
    let light = rig.get(&at(&rig, &["displacement"]), Type::Real).unwrap();
    rig.reset().unwrap();
    start(&mut rig);
    rig.set(&valve, Type::Real, &[1.0]).unwrap();
    rig.do_step(0.0, 40.0 * STEP).unwrap();
    let heavy = rig.get(&at(&rig, &["displacement"]), Type::Real).unwrap();
    assert!(light[0] > 2.0 * heavy[0], "{light:?} {heavy:?}");
}

#[test]
fn steps_and_states_out_of_turn_are_refused() {
    let mut rig = instance(Part::Rig);
    let text = |result: Result<()>| result.unwrap_err().to_string();
    assert!(text(rig.do_step(0.0, STEP)).starts_with("DoStep = Instantiated"));
    assert!(text(rig.set_start(f64::NAN)).starts_with("startTime = NaN"));
    start(&mut rig);
    for (time, step, named) in [
        (1.0, STEP, "currentCommunicationPoint"),
        (f64::NAN, STEP, "currentCommunicationPoint"),
        (0.0, 0.5 * STEP, "communicationStepSize"),
        (0.0, 0.0, "communicationStepSize"),
        (0.0, -STEP, "communicationStepSize"),
        (0.0, f64::INFINITY, "communicationStepSize"),
    ] {
        assert!(text(rig.do_step(time, step)).starts_with(named), "{time} {step}");
    }
    let valve = at(&rig, &["valve_command"]);
    rig.set(&valve, Type::Real, &[f64::NAN]).unwrap();
    assert!(text(rig.do_step(0.0, STEP)).starts_with("valve_command = NaN"));
    assert_eq!(rig.time(), 0.0);
    let state = rig.get_state(std::ptr::null()).unwrap();
    let bytes = rig.serialize(state).unwrap();
    rig.free_state(state).unwrap();
    assert!(rig.free_state(state).is_err() && rig.set_state(state).is_err() && rig.serialize(state).is_err());
    for length in 0..bytes.len() {
        assert!(rig.deserialize(&bytes[..length], std::ptr::null()).is_err());
    }
    for place in 0..bytes.len() {
        let mut broken = bytes.clone();
        broken[place] ^= 1;
        assert!(rig.deserialize(&broken, std::ptr::null()).is_err(), "{place}");
    }
    assert!(instance(Part::Controller).deserialize(&bytes, std::ptr::null()).is_err());
    assert!(Instance::new("", "eft-rig-0").is_err());
}

#[test]
fn a_state_replays_the_same_bits_in_either_precision() {
    for (part, single) in [(Part::Rig, false), (Part::Controller, false), (Part::Controller, true)] {
        let mut one = instance(part);
        if part == Part::Controller {
            let switches = at(&one, &["single_precision", "compensation.adaptive", "protection.enabled"]);
            one.set(&switches, Type::Boolean, &[f64::from(u8::from(single)), 1.0, 1.0]).unwrap();
        }
        start(&mut one);
        let inputs: Vec<u32> = (1..3).collect();
        let names = if part == Part::Rig {
            vec!["force", "spool"]
        } else {
            vec!["valve_command", "flow_gain_estimate"]
        };
        let outputs = at(&one, &names);
        let kinds = if part == Part::Rig { 1 } else { 2 };
        let run = |one: &mut Instance, from: u32, to: u32| {
            let mut told = Vec::new();
            for tick in from..to {
                let wave = (0.02 * f64::from(tick)).sin();
                one.set(&inputs[..kinds], Type::Real, &[1e3 * wave * 1e-3, 0.01 * wave][..kinds]).unwrap();
                one.do_step(f64::from(tick) * STEP, STEP).unwrap();
                told.extend(one.get(&outputs, Type::Real).unwrap().into_iter().map(f64::to_bits));
            }
            told
        };
        run(&mut one, 0, 333);
        let state = one.get_state(std::ptr::null()).unwrap();
        let bytes = one.serialize(state).unwrap();
        let first = run(&mut one, 333, 700);
        one.set_state(state).unwrap();
        assert_eq!(run(&mut one, 333, 700), first);
        let mut other = instance(part);
        let state = other.deserialize(&bytes, std::ptr::null()).unwrap();
        other.set_state(state).unwrap();
        assert_eq!(run(&mut other, 333, 700), first);
    }
}
