//! A second sensor that fails after the first one, on the paper's rig with the designed loop.

use eft::core::Input;
use eft::core::status::SHUT_DOWN;
use eft::sim::SimulateOptions;
use eft::sim::closed_loop::{PlantStepper, RigChannel, parameters};

use crate::matrix::{KINDS, SIGNALS};
use crate::results::keep;
use crate::sizes::{START, benches};

const RATE: f64 = 4096.0;
/// Time (s) between the two faults.
const BETWEEN: f64 = 0.3;
/// Kinds of the second fault.
const SECOND: [&str; 3] = ["lost", "zero", "stuck"];

/// Readings of force, displacement, velocity and spool with noise and faults.
struct Sensors {
    noise: [f64; 4],
    last: [f64; 4],
    state: u64,
}

impl Sensors {
    /// A reading with triangular noise, whose standard deviation is that of the sensor.
    fn read(&mut self, sensor: usize, value: f64, fault: Option<&str>) -> f64 {
        let mut uniform = || {
            self.state = self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.state >> 40) as f64 / f64::from(1 << 24) - 0.5
        };
        let reading = value + self.noise[sensor] * 6f64.sqrt() * (uniform() + uniform());
        match fault {
            None => {
                self.last[sensor] = reading;
                reading
            }
            Some("lost") => f64::NAN,
            Some("zero") => 0.0,
            Some("stuck") => self.last[sensor],
            Some(_) => -reading,
        }
    }
}

/// Largest force over its level after the second fault, and whether the channel has shut down.
fn after(faults: [(&str, &str); 2], moment: f64) -> (f64, bool) {
    let [bench, ..] = benches();
    let rig = &bench.rig;
    let mut plant = PlantStepper::new(rig, RATE, &SimulateOptions::default()).unwrap();
    let mut channel = RigChannel::<f64>::new(&parameters(rig, RATE).unwrap(), None).unwrap();
    let noise =
        SIGNALS.map(|name| rig.get(&format!("sensors.{name}.noise")).unwrap().unwrap().as_float().unwrap());
    let mut sensors = Sensors { noise, last: [0.0; 4], state: 1 };
    let [amplitude, frequency] = bench.sine;
    let starts = [START + moment, START + moment + BETWEEN].map(|start| (start * RATE) as u32);
    let (mut force, mut flags) = (0.0_f64, 0);
    for tick in 0..starts[1] + RATE as u32 {
        let now = plant.readings()[0];
        if tick >= starts[1] {
            force = force.max(now.force.abs() / bench.force_trip);
        }
        let mut read = |sensor: usize, value: f64| {
            let fails = |n: usize| tick >= starts[n] && faults[n].0 == SIGNALS[sensor];
            let fault = [0, 1].into_iter().find(|&n| fails(n)).map(|n| faults[n].1);
            sensors.read(sensor, value, fault)
        };
        let input = Input {
            command: amplitude * (std::f64::consts::TAU * frequency * f64::from(tick) / RATE).sin(),
            force: read(0, now.force),
            displacement: read(1, now.displacement),
            velocity: read(2, now.velocity),
            spool: read(3, now.spool),
            ..Input::default()
        };
        let out = channel.step(&input);
        flags = out.status;
        plant.step(&[out.voltage]).unwrap();
    }
    (force, flags & SHUT_DOWN != 0)
}

fn worst(first: &str, second: &str, kinds: &[&str]) -> f64 {
    let mut most = 0.0_f64;
    for first_kind in KINDS {
        for kind in kinds {
            for moment in [0.0, 0.2, 0.4] {
                let (force, shut) = after([(first, first_kind), (second, kind)], moment);
                let opens = shut || second != "force";
                assert!(opens, "{first} {first_kind}, then {second} {kind} at {moment}");
                most = most.max(force);
            }
        }
    }
    let of = if kinds == SECOND { "" } else { " of wrong sign" };
    keep(format_args!("{first}, then {second}{of}"), &[("force over its level", most)]);
    most
}

// SR-21
#[test]
fn a_load_cell_that_fails_after_another_sensor_opens_the_loop() {
    for first in ["displacement", "velocity", "spool"] {
        let force = worst(first, "force", &SECOND);
        assert!(force < 1.2, "{first}: {force}");
    }
}

// SR-21
#[test]
fn without_velocity_and_displacement_the_flow_balance_shows_the_motion() {
    // The derivative follows a stuck displacement until that is noticed.
    for (first, second, most) in [("displacement", "velocity", 1.2), ("velocity", "displacement", 3.2)] {
        let force = worst(first, second, &SECOND);
        assert!(force < most, "{first}, then {second}: {force}");
    }
}

// SR-21
#[test]
fn a_load_cell_of_wrong_sign_after_the_displacement_opens_the_loop() {
    let force = worst("displacement", "force", &["sign"]);
    assert!(force < 1.2, "{force}");
}
