//! Configurations are offered while a timer interrupt runs the step: each step must be that of one of them, whole.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::ptr::null_mut;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use eft_ffi::*;
use eft_golden::Xorshift;
use eft_rigs::zhao2005::{FLOWS, OPENINGS, PARAMETERS, POINTS};

/// Ticks of each part.
const TICKS: u32 = 5_000;
/// Counts of the timer between two ticks, 40 ns each: 937 instructions under `-icount shift=6`, of which a tick takes 300.
const PERIOD: u32 = 1_499;

struct Shared(UnsafeCell<MaybeUninit<eft_shadow_f32>>);
// Safety: what the interrupt and the main loop share is the interface under test.
unsafe impl Sync for Shared {}
static SHADOW: Shared = Shared(UnsafeCell::new(MaybeUninit::zeroed()));

/// Whether the interrupt reads the first copy whatever was offered, as a program without a shadow would.
static CARELESS: AtomicBool = AtomicBool::new(false);
static COUNT: AtomicU32 = AtomicU32::new(0);
/// The answers of the two configurations, and how often the interrupt saw each, and something else.
static ANSWERS: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];
static SEEN: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];
static TORN: AtomicU32 = AtomicU32::new(0);
/// Changes from one configuration to the other.
static CHANGES: AtomicU32 = AtomicU32::new(0);
static LAST: AtomicU32 = AtomicU32::new(0);

const INPUT: eft_input_f32 =
    eft_input_f32 { command: 1.0e3, velocity: 0.2, force: 900.0, spool: 0.2, further_flow: 0.0 };

/// What one tick from rest answers: it depends on the configuration alone.
fn answer(config: *const eft_controller_f32) -> u32 {
    let mut state = MaybeUninit::uninit();
    let mut output = eft_output_f32 { valve_command: 0.0, compensation: 0.0, status: 0 };
    // Safety: every pointer is valid.
    unsafe {
        eft_reset_f32(state.as_mut_ptr());
        eft_step_f32(config, state.as_mut_ptr(), &INPUT, &mut output);
    }
    output.valve_command.to_bits()
}

fn shadow() -> *mut eft_shadow_f32 {
    SHADOW.0.get().cast()
}

fn add(counter: &AtomicU32) {
    counter.store(counter.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
}

/// The interrupt.
pub fn tick() {
    let config = if CARELESS.load(Ordering::Relaxed) {
        shadow().cast_const().cast()
    } else {
        // Safety: initialised before the interrupt was enabled.
        unsafe { eft_shadow_take_f32(shadow()) }
    };
    let got = answer(config);
    match ANSWERS.iter().zip(&SEEN).find(|(answer, _)| answer.load(Ordering::Relaxed) == got) {
        Some((_, seen)) => add(seen),
        None => add(&TORN),
    }
    if LAST.swap_(got) != got {
        add(&CHANGES);
    }
    add(&COUNT);
}

/// A swap without the atomic instruction that not every target has; only the interrupt writes.
trait Swap {
    fn swap_(&self, value: u32) -> u32;
}
impl Swap for AtomicU32 {
    fn swap_(&self, value: u32) -> u32 {
        let before = self.load(Ordering::Relaxed);
        self.store(value, Ordering::Relaxed);
        before
    }
}

fn configured(level: f64, response_delay: f64) -> Option<eft_controller_f32> {
    let (mut openings, mut flows) = ([0.0; EFT_TABLE_CAPACITY], [0.0; EFT_TABLE_CAPACITY]);
    openings.get_mut(..POINTS)?.copy_from_slice(&OPENINGS);
    flows.get_mut(..POINTS)?.copy_from_slice(&FLOWS);
    let p = &PARAMETERS;
    let parameters = eft_parameters {
        table_length: POINTS as u32,
        mode: EFT_MODE_NONLINEAR,
        sign_from: EFT_SIGN_FROM_SPOOL,
        reserved: 0,
        level,
        piston_area: p.piston_area,
        supply_pressure: p.supply_pressure,
        flow_gain: p.flow_gain,
        valve_gain: p.valve_gain,
        response_delay,
        lead_alpha: p.lead_alpha,
        sample_rate: p.sample_rate,
        force_sensitivity: 5.6e-5,
        proportional_gain: p.proportional_gain,
        derivative_gain: 2.0e-4,
        valve_command: 100.0,
        valve_command_rate: f64::MAX,
        spool_warning: p.spool_warning,
        velocity_range: p.velocity_range,
        force_range: p.force_range,
        spool_range: p.spool_range,
        openings,
        flows,
    };
    let mut config = MaybeUninit::uninit();
    // Safety: every pointer is valid or null; filled where the code says so.
    unsafe {
        (eft_configure_f32(&parameters, config.as_mut_ptr(), null_mut()) == EFT_OK)
            .then(|| config.assume_init())
    }
}

/// How many configurations the interrupt took over, or what went wrong.
pub fn run(mut timer: SYST) -> Result<u32, &'static str> {
    let (Some(first), Some(second)) = (configured(1.0, 5.0e-3), configured(0.5, 4.0e-3)) else {
        return Err("swap: configuration refused");
    };
    for (to, config) in ANSWERS.iter().zip([&first, &second]) {
        to.store(answer(config), Ordering::Relaxed);
    }
    // Safety: valid pointers; the interrupt is not enabled yet.
    unsafe { eft_shadow_init_f32(shadow(), &first) };
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(PERIOD);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();

    let mut next = [&second, &first].into_iter().cycle();
    let mut offer = next.next();
    let mut random = Xorshift(1);
    while COUNT.load(Ordering::Acquire) < TICKS {
        // So that the interrupt comes at any moment of an offer, also in the middle of its copying.
        for _ in 0..random.next() % 256 {
            cortex_m::asm::nop();
        }
        // Safety: valid pointers; only here is offered.
        if let Some(config) = offer
            && unsafe { eft_shadow_offer_f32(shadow(), config) } == EFT_OK
        {
            offer = next.next();
        }
    }
    let (torn, changes) = (TORN.load(Ordering::Acquire), CHANGES.load(Ordering::Acquire));
    if torn != 0 || SEEN.iter().any(|seen| seen.load(Ordering::Relaxed) == 0) {
        return Err("swap: a torn configuration, or one that was never taken over");
    }
    // The test must be able to fail: the same without the shadow tears.
    CARELESS.store(true, Ordering::Release);
    let mut next = [&second, &first].into_iter().cycle();
    while COUNT.load(Ordering::Acquire) < 2 * TICKS {
        if let Some(config) = next.next() {
            // Safety: valid pointers; torn on purpose, and any bits make a configuration that steps without harm.
            unsafe { shadow().cast::<eft_controller_f32>().write_volatile(*config) };
        }
    }
    timer.disable_interrupt();
    if TORN.load(Ordering::Acquire) == 0 {
        return Err("swap: without the shadow nothing tore either, so the check sees nothing");
    }
    Ok(changes)
}
