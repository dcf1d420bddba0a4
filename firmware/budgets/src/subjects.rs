//! What is measured: the blocks as exported functions of their own, and the C interface.

use core::hint::black_box;
use core::mem::{MaybeUninit, transmute};
use core::ptr::null_mut;

use eft_core::{
    AdaptiveCompensation, AdaptiveController, AdaptiveControllerState, AdaptiveParameters, Compensation,
    CompensationParameters, CompensationState, Controller, ControllerState, FlowTable, LeadNetwork,
    LeadState, Limiter, LoadPressure, Measurements, Mode, PiecewiseLinear, ServovalveController, SignFrom,
    Tuning,
};
use eft_ffi::{
    EFT_ESTIMATORS, EFT_FEEDFORWARD, EFT_GUARD, eft_adaptive_configure_f32, eft_adaptive_f32,
    eft_adaptive_input_f32, eft_adaptive_parameters, eft_adaptive_reset_f32, eft_adaptive_state_f32,
    eft_adaptive_step_f32, eft_compensation_step_f32, eft_configure_f32, eft_controller_f32, eft_input_f32,
    eft_output_f32, eft_parameters, eft_reset_f32, eft_state_f32, eft_step_f32,
};
use semihosting::println;

use crate::probe::{self, Cost};

const IN3: f64 = 1.6387064e-5;
const OPENINGS: [f64; 21] = [
    -1.0, -0.9, -0.8, -0.7, -0.6, -0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8,
    0.9, 1.0,
];
const FLOWS: [f64; 21] = {
    let mut flows = [
        -536.2, -508.2, -480.2, -452.3, -419.9, -377.1, -324.2, -260.9, -188.2, -101.0, 0.0, 102.2, 187.2,
        260.4, 321.1, 369.8, 411.2, 441.0, 468.3, 495.7, 523.0,
    ];
    let mut i = 0;
    while i < 21 {
        flows[i] *= IN3;
        i += 1;
    }
    flows
};
const PARAMETERS: CompensationParameters = CompensationParameters {
    mode: Mode::Nonlinear,
    level: 1.0,
    piston_area: 8.212e-3,
    supply_pressure: 1.9e7,
    flow_gain: 1.64e-2,
    valve_gain: 0.1,
    proportional_gain: 0.8059,
    response_delay: 5.0e-3,
    lead_alpha: 0.1,
    sample_rate: 4096.0,
    sign_from: SignFrom::Spool,
    spool_warning: 0.6,
    velocity_range: 3.0,
    force_range: 2.0e5,
    spool_range: 1.2,
};
macro_rules! ok {
    ($e:expr) => {
        match $e {
            Ok(v) => v,
            Err(_) => panic!("refused"),
        }
    };
}
const N: usize = 21;
pub static TABLE: FlowTable<f32, N> = ok!(FlowTable::<f32, N>::new(&OPENINGS, &FLOWS));
static COMPENSATION: Compensation<f32, N> = ok!(Compensation::<f32, N>::new(&PARAMETERS, &TABLE));
static LEAD: LeadNetwork<f32> = ok!(LeadNetwork::<f32>::new(12.4, 5.0e-3, 0.1, 4096.0));
static LOAD_PRESSURE: LoadPressure<f32> = ok!(LoadPressure::<f32>::new(8.212e-3, 1.9e7));
static CONTROLLER: Controller<f32, N> = Controller {
    compensation: COMPENSATION,
    servovalve: ok!(ServovalveController::<f32>::new(5.6e-5, 0.8059, 2.0e-4, 4096.0)),
    limiter: ok!(Limiter::<f32>::new(10.0, 2.0e4, 4096.0)),
};
const fn adaptive(correct_curve: bool) -> AdaptiveController<f32, N> {
    AdaptiveController {
        compensation: ok!(AdaptiveCompensation::<f32, N>::new(
            &AdaptiveParameters {
                compensation: PARAMETERS,
                compressibility: 7.56e-13,
                leakage: 1.3e-11,
                force_sensitivity: 5.6e-5,
                computation_delay: 0,
                velocity_delay: 0.0,
                feedforward: true,
                adaptive: true,
                correct_curve,
                guard: true,
                tuning: Tuning::DEFAULT,
            },
            &TABLE,
        )),
        servovalve: CONTROLLER.servovalve,
        limiter: CONTROLLER.limiter,
    }
}
pub static ADAPTIVE: AdaptiveController<f32, N> = adaptive(false);
/// The same with the flow table corrected.
pub static CORRECTING: AdaptiveController<f32, N> = adaptive(true);

#[unsafe(no_mangle)]
extern "C" fn adaptive_step(
    c: &AdaptiveController<f32, N>,
    s: &mut AdaptiveControllerState<f32>,
    status: &mut u32,
    r: f32,
    m: &Measurements<f32>,
) -> f32 {
    let out = c.step(s, r, m);
    *status = out.status;
    out.valve_command
}
// The same under another name, for the budgets.
#[unsafe(no_mangle)]
extern "C" fn adaptive_curve_step(
    c: &AdaptiveController<f32, N>,
    s: &mut AdaptiveControllerState<f32>,
    status: &mut u32,
    r: f32,
    m: &Measurements<f32>,
) -> f32 {
    adaptive_step(c, s, status, r, m)
}
#[unsafe(no_mangle)]
extern "C" fn lead_step(c: &LeadNetwork<f32>, s: &mut LeadState<f32>, x: f32) -> f32 {
    c.step(s, x)
}
#[unsafe(no_mangle)]
extern "C" fn table_inverse(c: &PiecewiseLinear<f32, N>, x: f32) -> f32 {
    c.eval(x)
}
#[unsafe(no_mangle)]
extern "C" fn load_pressure_factor(c: &LoadPressure<f32>, f: f32, x: f32) -> f32 {
    c.factor(f, x).0
}
#[unsafe(no_mangle)]
extern "C" fn compensation_step(
    c: &Compensation<f32, N>,
    s: &mut CompensationState<f32>,
    status: &mut u32,
    v: f32,
    f: f32,
    x: f32,
    q: f32,
) -> f32 {
    let out = c.step(s, v, f, x, q);
    *status = out.status;
    out.value
}
#[unsafe(no_mangle)]
extern "C" fn controller_step(
    c: &Controller<f32, N>,
    s: &mut ControllerState<f32>,
    status: &mut u32,
    r: f32,
    v: f32,
    f: f32,
    x: f32,
) -> f32 {
    let out = c.step(s, r, v, f, x);
    *status = out.status;
    out.valve_command
}

/// Numbers as sensors send them, and as they should not.
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }
    fn sample(&mut self, scale: f32) -> f32 {
        match self.next() % 16 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => f32::NEG_INFINITY,
            3 => 0.0,
            4 => f32::from_bits(self.next()),
            5 => -scale,
            6 => scale,
            _ => (self.next() as i32 as f32) * (1.3 * scale / 2_147_483_648.0),
        }
    }
}

/// A slow swing between −1 and 1.
fn triangle(tick: u32) -> f32 {
    let phase = (tick & 0x3ff) as f32 / 256.0;
    if phase < 2.0 { phase - 1.0 } else { 3.0 - phase }
}

/// A tick of a rig whose valve passes more than its table in one direction: three quarters of the time it does as it is
/// asked, so that the estimators work.
fn rig(tick: &mut u32, r: &mut Random) -> (f32, Measurements<f32>) {
    let wild = *tick & 0x1800 == 0;
    *tick += 1;
    let opening = 0.3 * triangle(*tick);
    let side = if opening > 0.0 { 1.05 } else { 1.0 };
    let mut sample = |scale: f32, sane: f32| {
        let value = r.sample(scale);
        if wild { value } else { sane }
    };
    let command = sample(1.0e4, 0.0);
    let measured = Measurements {
        velocity: sample(1.0, side * TABLE.flow(opening) / 8.212e-3),
        force: sample(1.5e5, 0.0),
        spool: sample(1.0, 1.02 * opening),
        valve_command: 0.0,
        supply_pressure: sample(2.5e7, 1.9e7),
    };
    (command, measured)
}

/// The highest cost over many calls, printed.
fn worst(name: &str, mut call: impl FnMut(&mut Random)) {
    let mut worst = Cost::default();
    let mut random = Random(12345);
    for _ in 0..20_000 {
        call(&mut random);
        let cost = probe::cost();
        worst.instructions = worst.instructions.max(cost.instructions);
        worst.stack = worst.stack.max(cost.stack);
    }
    println!("{name} {} {}", worst.instructions, worst.stack);
}

/// `$function`, called through the probe.
macro_rules! probed {
    ($function:expr, $type:ty) => {{
        // Safety: the trampoline passes every argument on unchanged.
        unsafe { transmute::<usize, $type>(probe::arm($function as *const () as usize)) }
    }};
}

fn parameters() -> eft_parameters {
    eft_parameters {
        table_length: N as u32,
        mode: 2,
        sign_from: 0,
        reserved: 0,
        level: PARAMETERS.level,
        piston_area: PARAMETERS.piston_area,
        supply_pressure: PARAMETERS.supply_pressure,
        flow_gain: PARAMETERS.flow_gain,
        valve_gain: PARAMETERS.valve_gain,
        response_delay: PARAMETERS.response_delay,
        lead_alpha: PARAMETERS.lead_alpha,
        sample_rate: PARAMETERS.sample_rate,
        force_sensitivity: 5.6e-5,
        proportional_gain: PARAMETERS.proportional_gain,
        derivative_gain: 2.0e-4,
        valve_command: 10.0,
        valve_command_rate: 2.0e4,
        spool_warning: PARAMETERS.spool_warning,
        velocity_range: PARAMETERS.velocity_range,
        force_range: PARAMETERS.force_range,
        spool_range: PARAMETERS.spool_range,
        openings: OPENINGS,
        flows: FLOWS,
    }
}

/// Prints one line a function: name, instructions, bytes of stack.
pub fn run() {
    let mut lead = LeadState::default();
    let f = probed!(lead_step, extern "C" fn(&LeadNetwork<f32>, &mut LeadState<f32>, f32) -> f32);
    worst("lead_step", |r| {
        black_box(f(&LEAD, &mut lead, r.sample(1.0)));
    });
    let f = probed!(table_inverse, extern "C" fn(&PiecewiseLinear<f32, N>, f32) -> f32);
    worst("table_inverse", |r| {
        black_box(f(TABLE.inverse(), r.sample(8.0e-3)));
    });
    let f = probed!(load_pressure_factor, extern "C" fn(&LoadPressure<f32>, f32, f32) -> f32);
    worst("load_pressure_factor", |r| {
        black_box(f(&LOAD_PRESSURE, r.sample(1.5e5), r.sample(1.0)));
    });
    let (mut state, mut status) = (CompensationState::default(), 0);
    let f = probed!(
        compensation_step,
        extern "C" fn(
            &Compensation<f32, N>,
            &mut CompensationState<f32>,
            &mut u32,
            f32,
            f32,
            f32,
            f32,
        ) -> f32
    );
    worst("compensation_step", |r| {
        let (v, f_, x, q) = (r.sample(1.0), r.sample(1.5e5), r.sample(1.0), r.sample(1.0e-3));
        black_box(f(&COMPENSATION, &mut state, &mut status, v, f_, x, q));
    });
    let mut state = ControllerState::default();
    let f = probed!(
        controller_step,
        extern "C" fn(&Controller<f32, N>, &mut ControllerState<f32>, &mut u32, f32, f32, f32, f32) -> f32
    );
    worst("controller_step", |r| {
        let (c, v, f_, x) = (r.sample(1.0e4), r.sample(1.0), r.sample(1.5e5), r.sample(1.0));
        black_box(f(&CONTROLLER, &mut state, &mut status, c, v, f_, x));
    });

    type Adaptive = extern "C" fn(
        &AdaptiveController<f32, N>,
        &mut AdaptiveControllerState<f32>,
        &mut u32,
        f32,
        &Measurements<f32>,
    ) -> f32;
    for (name, function, controller) in [
        ("adaptive_step", adaptive_step as Adaptive, &ADAPTIVE),
        ("adaptive_curve_step", adaptive_curve_step as Adaptive, &CORRECTING),
    ] {
        let mut state = controller.at_rest();
        let f = probed!(function, Adaptive);
        let mut tick = 0_u32;
        worst(name, |r| {
            let (command, measured) = rig(&mut tick, r);
            black_box(f(controller, &mut state, &mut status, command, &measured));
        });
        let learned = &state.compensation;
        assert!(learned.flow_gain() != 1.0 && learned.valve_gain() != 1.0, "nothing was learned");
    }

    type Step = unsafe extern "C" fn(
        *const eft_controller_f32,
        *mut eft_state_f32,
        *const eft_input_f32,
        *mut eft_output_f32,
    ) -> u8;
    let (mut config, mut state) =
        (MaybeUninit::<eft_controller_f32>::uninit(), MaybeUninit::<eft_state_f32>::uninit());
    let mut output = eft_output_f32 { valve_command: 0.0, compensation: 0.0, status: 0 };
    // Safety: every pointer is valid.
    let code = unsafe { eft_configure_f32(&parameters(), config.as_mut_ptr(), null_mut()) };
    assert!(code == 0, "refused");
    for (name, function) in [
        ("eft_compensation_step_f32", eft_compensation_step_f32 as Step),
        ("eft_step_f32", eft_step_f32 as Step),
    ] {
        // Safety: every pointer is valid.
        unsafe { eft_reset_f32(state.as_mut_ptr()) };
        let f = probed!(function, Step);
        worst(name, |r| {
            let input = eft_input_f32 {
                command: r.sample(1.0e4),
                velocity: r.sample(1.0),
                force: r.sample(1.5e5),
                spool: r.sample(1.0),
                further_flow: r.sample(1.0e-3),
            };
            // Safety: every pointer is valid.
            unsafe { f(config.as_ptr(), state.as_mut_ptr(), &input, &mut output) };
        });
    }

    type AdaptiveStep = unsafe extern "C" fn(
        *const eft_adaptive_f32,
        *mut eft_adaptive_state_f32,
        *const eft_adaptive_input_f32,
        *mut eft_output_f32,
    ) -> u8;
    let parameters = eft_adaptive_parameters {
        rig: parameters(),
        compressibility: 7.56e-13,
        leakage: 1.3e-11,
        velocity_delay: 0.0,
        computation_delay: 0,
        parts: EFT_FEEDFORWARD | EFT_ESTIMATORS | EFT_GUARD,
    };
    let (mut config, mut state) =
        (MaybeUninit::<eft_adaptive_f32>::uninit(), MaybeUninit::<eft_adaptive_state_f32>::uninit());
    // Safety: every pointer is valid.
    let codes = unsafe {
        [
            eft_adaptive_configure_f32(&parameters, config.as_mut_ptr(), null_mut()),
            eft_adaptive_reset_f32(config.as_ptr(), state.as_mut_ptr()),
        ]
    };
    assert!(codes == [0, 0], "refused");
    let f = probed!(eft_adaptive_step_f32 as AdaptiveStep, AdaptiveStep);
    let mut tick = 0_u32;
    worst("eft_adaptive_step_f32", |r| {
        let (command, m) = rig(&mut tick, r);
        let input = eft_adaptive_input_f32 {
            command,
            velocity: m.velocity,
            force: m.force,
            spool: m.spool,
            supply_pressure: m.supply_pressure,
            valve_command: 0.0,
        };
        // Safety: every pointer is valid.
        unsafe { f(config.as_ptr(), state.as_mut_ptr(), &input, &mut output) };
    });
}
