//! Configurations are offered while a timer interrupt runs the step. Each step must use one whole configuration.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::ptr::{null, null_mut};
use core::sync::atomic::{AtomicBool, AtomicPtr, AtomicU32, Ordering};

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use eft_ffi::*;
use eft_golden::Xorshift;
use eft_rigs::zhao2005::{PARAMETERS, POINTS};

/// Ticks of each part.
const TICKS: u32 = 5_000;
/// Counts of the timer between two ticks, 40 ns each: 7,500 instructions under `-icount shift=6`. The interrupt with
/// its copy and its reset must take less, or the main loop never runs.
const PERIOD: u32 = 11_999;

struct Shared(UnsafeCell<MaybeUninit<eft_exchange<eft_channel<f32>>>>);
// Safety: interrupt and main loop share the exchange under test.
unsafe impl Sync for Shared {}
static EXCHANGE: Shared = Shared(UnsafeCell::new(MaybeUninit::zeroed()));

/// The configuration that the interrupt steps with.
static IN_USE: AtomicPtr<eft_channel<f32>> = AtomicPtr::new(null_mut());
/// Whether the interrupt always reads the first copy, as in a program without an exchange.
static CARELESS: AtomicBool = AtomicBool::new(false);
static COUNT: AtomicU32 = AtomicU32::new(0);
/// The answers of the two configurations, and how often the interrupt computed each, or another.
static ANSWERS: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];
static SEEN: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];
static TORN: AtomicU32 = AtomicU32::new(0);
/// Changes from one configuration to the other.
static CHANGES: AtomicU32 = AtomicU32::new(0);
static LAST: AtomicU32 = AtomicU32::new(0);

/// The output of one tick from rest, which depends on the configuration alone.
fn answer(channel: *const eft_channel<f32>) -> u32 {
    let (mut state, mut input, mut output) = (
        MaybeUninit::uninit(),
        MaybeUninit::<eft_input<f32>>::uninit(),
        MaybeUninit::<eft_output<f32>>::zeroed(),
    );
    // Safety: every pointer is valid, and the values that are read were written.
    unsafe {
        let _ = eft_reset_f32(channel, state.as_mut_ptr());
        let _ = eft_input_init_f32(input.as_mut_ptr());
        let input = input.assume_init_mut();
        (input.command, input.velocity, input.force, input.spool) = (1.0e3, 0.2, 900.0, 0.2);
        let _ = eft_step_f32(channel, state.as_mut_ptr(), input, output.as_mut_ptr());
        output.assume_init_ref().voltage.to_bits()
    }
}

fn exchange() -> *mut eft_exchange<eft_channel<f32>> {
    EXCHANGE.0.get().cast()
}

fn add(counter: &AtomicU32) {
    counter.store(counter.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
}

/// The interrupt.
pub fn tick() {
    let channel = if CARELESS.load(Ordering::Relaxed) {
        exchange().cast_const().cast()
    } else {
        // Safety: initialised before the interrupt was enabled.
        let new = unsafe { eft_take_channel_f32(exchange()) };
        if new != null() {
            IN_USE.store(new.cast_mut(), Ordering::Relaxed);
        }
        IN_USE.load(Ordering::Relaxed).cast_const()
    };
    let got = answer(channel);
    match ANSWERS.iter().zip(&SEEN).find(|(answer, _)| answer.load(Ordering::Relaxed) == got) {
        Some((_, seen)) => add(seen),
        None => add(&TORN),
    }
    if LAST.swap_(got) != got {
        add(&CHANGES);
    }
    add(&COUNT);
}

/// A swap without the atomic instruction, which some targets do not have. Only the interrupt writes.
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

fn configured(level: f64, response_delay: f64) -> Option<eft_channel<f32>> {
    // Safety: plain numbers, for which zero is a value.
    let mut p: eft_parameters = unsafe { MaybeUninit::zeroed().assume_init() };
    let r = &PARAMETERS;
    p.openings.get_mut(..POINTS)?.copy_from_slice(r.openings);
    p.flows.get_mut(..POINTS)?.copy_from_slice(r.flows);
    (p.table_length, p.mode, p.level, p.response_delay) =
        (POINTS as u32, EFT_MODE_NONLINEAR, level, response_delay);
    (p.sample_rate, p.piston_area, p.supply_pressure) = (r.sample_rate, r.piston_area, r.supply_pressure);
    (p.flow_gain, p.valve_gain, p.lead_alpha) = (r.flow_gain, r.valve_gain, r.lead_alpha);
    (p.compressibility, p.leakage) = (r.compressibility, r.leakage);
    (p.friction, p.friction_velocity) = (r.friction, r.friction_velocity);
    (p.overlap, p.null_bias) = (r.overlap, r.null_bias);
    (p.force_sensitivity, p.proportional_gain, p.derivative_gain) =
        (r.force_sensitivity, r.proportional_gain, r.derivative_gain);
    (p.valve_command, p.valve_command_rate, p.spool_warning) = (100.0, f64::MAX, r.spool_warning);
    (p.velocity_range, p.force_range, p.spool_range) = (r.velocity_range, r.force_range, r.spool_range);
    p.gap_time = r.gap_time;
    let mut channel = MaybeUninit::uninit();
    // Safety: every pointer is valid or null; filled where the code says so.
    unsafe {
        (eft_configure_f32(&p, channel.as_mut_ptr(), null_mut()) == EFT_OK).then(|| channel.assume_init())
    }
}

/// The number of configurations that the interrupt took over, or the error.
pub fn run(mut timer: SYST) -> Result<u32, &'static str> {
    let (Some(first), Some(second)) = (configured(1.0, 5.0e-3), configured(0.5, 4.0e-3)) else {
        return Err("swap: configuration refused");
    };
    for (to, config) in ANSWERS.iter().zip([&first, &second]) {
        to.store(answer(config), Ordering::Relaxed);
    }
    IN_USE.store((&raw const first).cast_mut(), Ordering::Relaxed);
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(PERIOD);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();

    let mut next = [&second, &first].into_iter().cycle();
    let mut offer = next.next();
    let mut random = Xorshift(1);
    while COUNT.load(Ordering::Acquire) < TICKS {
        // The interrupt then comes at any moment of an offer, also in the middle of the copy.
        for _ in 0..random.next() % 256 {
            cortex_m::asm::nop();
        }
        // Safety: valid pointers; no other place offers.
        if let Some(config) = offer
            && unsafe { eft_offer_channel_f32(exchange(), config) } == EFT_OK
        {
            offer = next.next();
        }
    }
    let (torn, changes) = (TORN.load(Ordering::Acquire), CHANGES.load(Ordering::Acquire));
    if torn != 0 || SEEN.iter().any(|seen| seen.load(Ordering::Relaxed) == 0) {
        return Err("swap: a torn configuration, or one that was never taken over");
    }
    // The test must be able to fail: without the exchange configurations are torn.
    CARELESS.store(true, Ordering::Release);
    let mut next = [&second, &first].into_iter().cycle();
    while COUNT.load(Ordering::Acquire) < 2 * TICKS {
        if let Some(config) = next.next() {
            // Safety: valid pointers; torn on purpose, and any bits make a configuration that steps without harm.
            unsafe { exchange().cast::<eft_channel<f32>>().write_volatile(*config) };
        }
    }
    timer.disable_interrupt();
    if TORN.load(Ordering::Acquire) == 0 {
        return Err("swap: without the exchange nothing tore either, so the check sees nothing");
    }
    Ok(changes)
}
