//! A rig's controller on an STM32H743 (Nucleo-H743ZI2) under embassy: the tick in a task of an interrupt's priority,
//! the learner in a task of the main program.
//!
//! TIM6 wakes the tick at the sample rate. The clock is the internal oscillator through the PLL, 400 MHz.
#![no_std]
#![no_main]

use defmt_rtt as _;
use eft_core::{Calibration, Window, status};
use eft_rigs::guarded::{CHANNEL, LEARNER, PARAMETERS};
use embassy_executor::{InterruptExecutor, Spawner};
use embassy_stm32::adc::{Adc, AdcChannel, AnyAdcChannel, SampleTime};
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::mode::Blocking;
use embassy_stm32::peripherals::{ADC1, IWDG1, TIM6};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::{RoundTo, Timer};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, interrupt, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use panic_probe as _;

/// From the timer to the tick.
static TICK: Signal<CriticalSectionRawMutex, ()> = Signal::new();
/// From the tick to the learner: a window and the status at its end. If the learner has no time for a window, the next
/// one overwrites it, and its samples count as lost.
static WINDOW: Signal<CriticalSectionRawMutex, (Window<f32>, u32)> = Signal::new();
/// From the learner to the tick.
static CALIBRATION: Signal<CriticalSectionRawMutex, Calibration<f32>> = Signal::new();
/// Runs the tick, in an interrupt that nothing else uses.
static ABOVE: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
fn TIM6_DAC() {
    pac::TIM6.sr().modify(|r| r.set_uif(false));
    TICK.signal(());
}

#[interrupt]
unsafe fn UART4() {
    // Safety: this is the interrupt that the executor was started for.
    unsafe { ABOVE.on_interrupt() }
}

/// Data of the tick.
struct Board {
    timer: Timer<'static, TIM6>,
    converter: Adc<'static, ADC1>,
    /// Command, force, displacement, spool opening, supply pressure.
    signals: [AnyAdcChannel<'static, ADC1>; 5],
    valve: DacChannel<'static, Blocking>,
    watchdog: IndependentWatchdog<'static, IWDG1>,
}

/// The highest priority: sample, step, valve command.
#[embassy_executor::task]
async fn tick(mut board: Board) {
    let mut state = CHANNEL.at_rest();
    let mut started = false;
    board.timer.set_frequency(Hertz(PARAMETERS.sample_rate as u32), RoundTo::Slower);
    board.timer.enable_update_interrupt(true);
    board.timer.start();
    board.watchdog.unleash();
    loop {
        TICK.wait().await;
        // One after the other: about a microsecond apart.
        let codes =
            board.signals.each_mut().map(|pin| board.converter.blocking_read(pin, SampleTime::CYCLES16_5));
        let input = front_end::sample(codes, 16);
        if !started {
            // A start without a bump from any position of the rig.
            CHANNEL.prime(&mut state, &input);
            started = true;
        }
        if let Some(calibration) = CALIBRATION.try_take() {
            CHANNEL.publish(&mut state, calibration);
        }
        let output = CHANNEL.step(&mut state, &input);
        board.valve.set(Value::Bit12Right(front_end::code(output.voltage)));
        board.watchdog.pet();
        if let Some(window) = output.window {
            WINDOW.signal((window, output.status));
        }
    }
}

/// Once a window of 16 ticks, below the tick.
#[embassy_executor::task]
async fn learn() {
    let mut learned = LEARNER.at_rest();
    let mut reported = 0;
    loop {
        let (window, flags) = WINDOW.wait().await;
        let calibration = LEARNER.update(&mut learned, &window);
        CALIBRATION.signal(calibration);
        if flags != reported {
            reported = flags;
            defmt::info!("{}; {}", status::Words(flags), calibration);
        }
    }
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let p = embassy_stm32::init(clocks());
    let mut valve = DacChannel::new_blocking(p.DAC1, p.PA4);
    valve.set(Value::Bit12Right(front_end::code(0.0)));
    let board = Board {
        timer: Timer::new(p.TIM6),
        converter: Adc::new(p.ADC1),
        signals: [
            p.PA3.degrade_adc(),
            p.PC0.degrade_adc(),
            p.PB1.degrade_adc(),
            p.PF11.degrade_adc(),
            p.PF12.degrade_adc(),
        ],
        valve,
        // Ten missed ticks reset the processor: the converter's output floats, and the valve amplifier must read that
        // as 0 V.
        watchdog: IndependentWatchdog::new(p.IWDG1, (10.0e6 / PARAMETERS.sample_rate) as u32),
    };
    spawner.spawn(defmt::unwrap!(learn()));
    interrupt::UART4.set_priority(Priority::P7);
    interrupt::TIM6_DAC.set_priority(Priority::P6);
    ABOVE.start(interrupt::UART4).spawn(defmt::unwrap!(tick(board)));
    // Safety: its handler is above, and touches nothing but the timer's flag.
    unsafe { interrupt::TIM6_DAC.enable() };
    defmt::info!("{} Hz", PARAMETERS.sample_rate);
}

/// 400 MHz of the internal oscillator: 64 MHz / 4 · 50 / 2; 100 MHz for the converter.
fn clocks() -> Config {
    use embassy_stm32::rcc::{
        AHBPrescaler, APBPrescaler, HSIPrescaler, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk,
        VoltageScale, mux,
    };
    let mut config = Config::default();
    let pll = |divp| Pll {
        source: PllSource::HSI,
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL50,
        fracn: None,
        divp: Some(divp),
        divq: None,
        divr: None,
    };
    config.rcc.hsi = Some(HSIPrescaler::DIV1);
    config.rcc.pll1 = Some(pll(PllDiv::DIV2));
    config.rcc.pll2 = Some(pll(PllDiv::DIV8));
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV2;
    config.rcc.apb1_pre = APBPrescaler::DIV2;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.apb3_pre = APBPrescaler::DIV2;
    config.rcc.apb4_pre = APBPrescaler::DIV2;
    config.rcc.voltage_scale = VoltageScale::Scale1;
    config.rcc.mux.adcsel = mux::Adcsel::PLL2_P;
    config
}
