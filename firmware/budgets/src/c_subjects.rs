//! The functions of the C interface that are measured.

use core::mem::MaybeUninit;
use core::ptr::null_mut;

use eft_core::{
    Input, Mode, Parameters, PlausibilityParameters, ProtectionParameters, Realization, SignFrom,
    VelocitySource,
};
use eft_ffi::*;
use eft_rigs::guarded;
use semihosting::println;

use crate::inputs::{Random, rig};
use crate::probe::{CONFIGURE, Cost, cost, probed};
use crate::rigs::{CROWDED, CURVE, PAPER, SELF_CALIBRATING, WATCHED};
use crate::subjects::later;

type Step = unsafe extern "C" fn(
    *const eft_channel<f32>,
    *mut eft_state<f32>,
    *const Input<f32>,
    *mut eft_output<f32>,
) -> u8;
type Learn = unsafe extern "C" fn(
    *const eft_learner<f32>,
    *mut eft_learner_state<f32>,
    *const eft_window<f32>,
    *mut eft_calibration<f32>,
) -> u8;
type Publish =
    unsafe extern "C" fn(*const eft_channel<f32>, *mut eft_state<f32>, *const eft_calibration<f32>) -> u8;
type Offer = unsafe extern "C" fn(*mut eft_exchange<eft_window<f32>>, *const eft_window<f32>) -> u8;

/// Prints one line a function and setting: name, instructions, bytes of stack.
pub fn run() {
    for (setting, rig) in [
        ("paper", &PAPER),
        ("self-calibrating", &SELF_CALIBRATING),
        ("curve", &CURVE),
        ("crowded", &CROWDED),
        ("guarded", &guarded::PARAMETERS),
        ("watched", &WATCHED),
    ] {
        let [step, learn, publish, offer] = costs(rig);
        println!("eft_step_f32, {setting} {step}");
        if setting == "curve" {
            println!("eft_learn_f32, curve {learn}");
            println!("eft_publish_f32 {publish}");
            println!("eft_offer_window_f32 {offer}");
        }
    }
    configure();
}

/// The cost in a task: to make a configuration, to check it, and to make the checksums of it and of a state.
fn configure() {
    // With every part that a channel may have.
    let protection = ProtectionParameters {
        plausibility: Some(PlausibilityParameters::DEFAULT),
        ..ProtectionParameters::DEFAULT
    };
    let (openings, flows) = (CROWDED.openings, CROWDED.flows);
    let rig = Parameters { openings, flows, protection: Some(protection), ..guarded::PARAMETERS };
    let parameters = parameters(&rig);
    macro_rules! costs {
        ($($configure:ident $check:ident $integrity:ident $reset:ident $state_integrity:ident $Opaque:ty, $State:ty;)*) => {$({
            type Configure = unsafe extern "C" fn(*const eft_parameters, *mut $Opaque, *mut eft_error) -> u8;
            type Check = unsafe extern "C" fn(*const $Opaque, *const eft_parameters) -> u8;
            let mut made = MaybeUninit::uninit();
            let configure = probed!($configure, Configure, CONFIGURE);
            // Safety: every pointer is valid.
            assert!(unsafe { configure(&parameters, made.as_mut_ptr(), null_mut()) } == EFT_OK, "refused");
            println!("{} {}", stringify!($configure), cost());
            let check = probed!($check, Check, CONFIGURE);
            // Safety: every pointer is valid.
            assert!(unsafe { check(made.as_ptr(), &parameters) } == EFT_OK, "corrupt");
            println!("{} {}", stringify!($check), cost());
            type Integrity<V> = unsafe extern "C" fn(*const V, *mut u32) -> u8;
            let (mut state, mut word) = (MaybeUninit::uninit(), 0);
            let integrity = probed!($integrity, Integrity<$Opaque>);
            // Safety: every pointer is valid.
            assert!(unsafe { integrity(made.as_ptr(), &mut word) } == EFT_OK, "refused");
            println!("{} {}", stringify!($integrity), cost());
            // Safety: every pointer is valid.
            assert!(unsafe { $reset(made.as_ptr(), state.as_mut_ptr()) } == EFT_OK, "refused");
            let integrity = probed!($state_integrity, Integrity<$State>);
            // Safety: every pointer is valid.
            assert!(unsafe { integrity(state.as_ptr(), &mut word) } == EFT_OK, "refused");
            println!("{} {}", stringify!($state_integrity), cost());
        })*};
    }
    costs! {
        eft_configure_f32 eft_check_f32 eft_integrity_f32 eft_reset_f32 eft_state_integrity_f32
            eft_channel<f32>, eft_state<f32>;
        eft_learner_configure_f32 eft_learner_check_f32 eft_learner_integrity_f32 eft_learner_reset_f32
            eft_learner_state_integrity_f32 eft_learner<f32>, eft_learner_state<f32>;
        eft_configure_f64 eft_check_f64 eft_integrity_f64 eft_reset_f64 eft_state_integrity_f64
            eft_channel<f64>, eft_state<f64>;
        eft_learner_configure_f64 eft_learner_check_f64 eft_learner_integrity_f64 eft_learner_reset_f64
            eft_learner_state_integrity_f64 eft_learner<f64>, eft_learner_state<f64>;
    }
}

/// The highest costs of a step, of learning, publishing and offering a window, in a run with its learner.
fn costs(p: &Parameters) -> [Cost; 4] {
    let parameters = parameters(p);
    let (mut channel, mut state) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let (mut learner, mut memory) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let mut output = MaybeUninit::<eft_output<f32>>::zeroed();
    let mut calibration = MaybeUninit::uninit();
    // Safety: every pointer is valid.
    let codes = unsafe {
        [
            eft_configure_f32(&parameters, channel.as_mut_ptr(), null_mut()),
            eft_reset_f32(channel.as_ptr(), state.as_mut_ptr()),
            eft_learner_configure_f32(&parameters, learner.as_mut_ptr(), null_mut()),
            eft_learner_reset_f32(learner.as_ptr(), memory.as_mut_ptr()),
        ]
    };
    assert!(codes == [EFT_OK; 4], "refused");
    let (channel, state, output) = (channel.as_ptr(), state.as_mut_ptr(), output.as_mut_ptr());
    let (learner, memory, calibration) = (learner.as_ptr(), memory.as_mut_ptr(), calibration.as_mut_ptr());
    let mut windows = MaybeUninit::<eft_exchange<eft_window<f32>>>::zeroed();
    let mut worst = [Cost::default(); 4];
    let (mut random, mut position, mut wait, mut closed_windows) = (Random(12345), 0.0, 0, 0);
    for tick in 0..20_000 {
        // A trip is final, so the run starts again now and then.
        if tick & 0x7f == 0 && tick & 0x1fff <= 0x800 {
            // Safety: every pointer is valid.
            let codes = unsafe { [eft_reset_f32(channel, state), eft_learner_reset_f32(learner, memory)] };
            assert!(codes == [EFT_OK; 2], "refused");
            wait = 0;
        }
        let input = rig(tick, &mut position, &mut random);
        let mut measured = |what: usize, code: u8| {
            assert!(code == EFT_OK, "refused");
            worst[what].raise(cost());
        };
        let step = probed!(eft_step_f32, Step);
        // Safety: every pointer is valid.
        measured(0, unsafe { step(channel, state, &input, output) });
        // Safety: filled by the step.
        let (closed, window) = unsafe { ((*output).window_closed != 0, &raw const (*output).window) };
        if closed {
            let learn = probed!(eft_learn_f32, Learn);
            // Safety: every pointer is valid.
            measured(1, unsafe { learn(learner, memory, window, calibration) });
            let offer = probed!(eft_offer_window_f32, Offer);
            // Safety: every pointer is valid.
            measured(3, unsafe { offer(windows.as_mut_ptr(), window) });
            // Safety: every pointer is valid.
            assert!(!unsafe { eft_take_window_f32(windows.as_mut_ptr()) }.is_null());
            wait = later(closed_windows);
            closed_windows += 1;
        } else if wait > 0 {
            wait -= 1;
            if wait == 0 {
                let publish = probed!(eft_publish_f32, Publish);
                // Safety: every pointer is valid.
                measured(2, unsafe { publish(channel, state, calibration) });
            }
        }
    }
    worst
}

/// The same rig for C.
fn parameters(p: &Parameters) -> eft_parameters {
    // Safety: plain numbers, for which zero is a value.
    let mut c: eft_parameters = unsafe { MaybeUninit::zeroed().assume_init() };
    c.table_length = p.openings.len() as u32;
    for (to, from) in c.openings.iter_mut().zip(p.openings).chain(c.flows.iter_mut().zip(p.flows)) {
        *to = *from;
    }
    (c.sample_rate, c.level) = (p.sample_rate, p.level);
    (c.piston_area, c.supply_pressure) = (p.piston_area, p.supply_pressure);
    (c.compressibility, c.leakage) = (p.compressibility, p.leakage);
    (c.friction, c.friction_velocity) = (p.friction, p.friction_velocity);
    (c.overlap, c.null_bias) = (p.overlap, p.null_bias);
    (c.flow_gain, c.valve_gain) = (p.flow_gain, p.valve_gain);
    (c.response_delay, c.lead_alpha, c.velocity_delay) = (p.response_delay, p.lead_alpha, p.velocity_delay);
    (c.force_sensitivity, c.proportional_gain, c.derivative_gain) =
        (p.force_sensitivity, p.proportional_gain, p.derivative_gain);
    c.integral_gain = p.integral_gain;
    (c.valve_command, c.valve_command_rate) = (p.valve_command, p.valve_command_rate);
    (c.spool_warning, c.velocity_range) = (p.spool_warning, p.velocity_range);
    (c.force_range, c.spool_range, c.gap_time) = (p.force_range, p.spool_range, p.gap_time);
    c.realization = match p.realization {
        Realization::Digital => EFT_REALIZATION_DIGITAL,
        Realization::Analog => EFT_REALIZATION_ANALOG,
    };
    c.mode = match p.mode {
        Mode::Off => EFT_MODE_OFF,
        Mode::Linear => EFT_MODE_LINEAR,
        Mode::Nonlinear => EFT_MODE_NONLINEAR,
    };
    c.sign_from = match p.sign_from {
        SignFrom::Spool => EFT_SIGN_FROM_SPOOL,
        SignFrom::Demand => EFT_SIGN_FROM_DEMAND,
    };
    if let VelocitySource::Observer { gains: [displacement, velocity, drift], mass } = p.velocity_source {
        c.velocity_source = EFT_VELOCITY_OBSERVER;
        (c.gain_on_displacement, c.gain_on_velocity, c.gain_on_drift) = (displacement, velocity, drift);
        c.mass = mass;
    }
    c.supply_correction = u8::from(p.supply_correction);
    c.feedforward = u8::from(p.feedforward);
    c.stuck_samples = p.stuck_samples;
    let l = &p.learning;
    c.learning = eft_learning {
        excitation: l.excitation,
        flow_gain_bounds: l.flow_gain_bounds,
        valve_gain_bounds: l.valve_gain_bounds,
        response_delay_bounds: l.response_delay_bounds,
        age_limit: l.age_limit,
        adaptive: u8::from(l.adaptive),
        curve_correction: u8::from(l.curve_correction),
        guard: u8::from(l.guard),
    };
    if let Some(p) = &p.protection {
        c.protection = eft_protection {
            force_warning: p.force.warning,
            force_trip: p.force.trip,
            displacement_warning: p.displacement.warning,
            displacement_trip: p.displacement.trip,
            velocity_warning: p.velocity.warning,
            velocity_trip: p.velocity.trip,
            spool_warning: p.spool.warning,
            spool_trip: p.spool.trip,
            start_time: p.start_time,
            ramp_time: p.ramp_time,
            shutdown_time: p.shutdown_time,
            fault_time: p.fault_time,
            period_tolerance: p.period_tolerance,
            oscillation_limit: p.oscillation_limit,
            lost_samples: p.lost_samples,
            enabled: 1,
            ..c.protection
        };
        if let Some(p) = &p.plausibility {
            c.protection.plausibility = eft_plausibility {
                enabled: 1,
                force_noise: p.force_noise,
                displacement_noise: p.displacement_noise,
                velocity_noise: p.velocity_noise,
                spool_noise: p.spool_noise,
                load_pressure_tolerance: p.load_pressure_tolerance,
                false_alarms: p.false_alarms,
                settle_time: p.settle_time,
            };
        }
    }
    c
}
