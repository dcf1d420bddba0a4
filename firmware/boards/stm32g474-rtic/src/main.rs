//! A rig's controller on an STM32G474 (Nucleo-G474RE) under RTIC: the tick in the converter's interrupt, the learner
//! in a task below it.
//!
//! TIM2 starts both converters at the sample rate; the end of their sequence runs the tick. All pins are on the
//! board's Arduino header. The clock is the internal oscillator through the PLL, 170 MHz.
#![no_std]
#![no_main]

use {defmt_rtt as _, panic_probe as _};

/// As RTIC expects a device.
mod device {
    pub use embassy_stm32::pac::{Interrupt as interrupt, *};
}

#[rtic::app(device = crate::device, peripherals = false, dispatchers = [SPI1])]
mod app {
    use eft_core::{Calibration, ChannelState, LearnerState, Window, status};
    use eft_rigs::guarded::{CHANNEL, LEARNER, PARAMETERS};
    use embassy_stm32::adc::{Adc, AdcChannel, Exten, InjectedAdc, SampleTime};
    use embassy_stm32::dac::{DacChannel, Value};
    use embassy_stm32::mode::Blocking;
    use embassy_stm32::peripherals::{ADC1, ADC2, IWDG, TIM2};
    use embassy_stm32::time::Hertz;
    use embassy_stm32::timer::low_level::{MasterMode, RoundTo, Timer};
    use embassy_stm32::wdg::IndependentWatchdog;
    use embassy_stm32::{Config, triggers};

    #[shared]
    struct Shared {
        /// From the learner to the tick.
        calibration: Option<Calibration<f32>>,
    }

    #[local]
    struct Local {
        state: ChannelState<f32>,
        started: bool,
        /// Command, force, displacement, spool opening.
        signals: InjectedAdc<'static, ADC1, 4>,
        supply_pressure: InjectedAdc<'static, ADC2, 1>,
        valve: DacChannel<'static, Blocking>,
        watchdog: IndependentWatchdog<'static, IWDG>,
        learned: LearnerState<f32>,
        _timer: Timer<'static, TIM2>,
    }

    #[init]
    fn init(_: init::Context) -> (Shared, Local) {
        let p = embassy_stm32::init(clocks());
        let mut valve = DacChannel::new_blocking(p.DAC1, p.PA4);
        valve.set(Value::Bit12Right(front_end::code(0.0)));

        let time = SampleTime::CYCLES47_5;
        let timer = Timer::new(p.TIM2);
        // Only the converter that finishes last interrupts.
        let supply_pressure = Adc::new(p.ADC2, Default::default()).setup_injected_conversions(
            [(p.PA6.degrade_adc(), time)],
            triggers::TIM2_TRGO,
            Exten::RISING_EDGE,
            false,
        );
        let signals = Adc::new(p.ADC1, Default::default()).setup_injected_conversions(
            [
                (p.PA0.degrade_adc(), time),
                (p.PA1.degrade_adc(), time),
                (p.PC0.degrade_adc(), time),
                (p.PC1.degrade_adc(), time),
            ],
            triggers::TIM2_TRGO,
            Exten::RISING_EDGE,
            true,
        );
        // Ten missed ticks reset the processor: the converter's output floats, and the valve amplifier must read
        // that as 0 V.
        let mut watchdog = IndependentWatchdog::new(p.IWDG, (10.0e6 / PARAMETERS.sample_rate) as u32);
        watchdog.unleash();
        timer.set_frequency(Hertz(PARAMETERS.sample_rate as u32), RoundTo::Slower);
        timer.set_master_mode(MasterMode::UPDATE);
        timer.start();
        defmt::info!("{} Hz", PARAMETERS.sample_rate);
        let local = Local {
            state: CHANNEL.at_rest(),
            started: false,
            signals,
            supply_pressure,
            valve,
            watchdog,
            learned: LEARNER.at_rest(),
            _timer: timer,
        };
        (Shared { calibration: None }, local)
    }

    /// The highest priority: sample, step, valve command.
    #[task(binds = ADC1_2, priority = 3, shared = [calibration],
        local = [state, started, signals, supply_pressure, valve, watchdog])]
    fn tick(mut cx: tick::Context) {
        let [command, force, displacement, spool] = cx.local.signals.read_injected_samples();
        let [supply_pressure] = cx.local.supply_pressure.read_injected_samples();
        let input = front_end::sample([command, force, displacement, spool, supply_pressure], 12);
        let state = cx.local.state;
        if !*cx.local.started {
            // A start without a bump from any position of the rig.
            CHANNEL.prime(state, &input);
            *cx.local.started = true;
        }
        if let Some(calibration) = cx.shared.calibration.lock(Option::take) {
            CHANNEL.publish(state, calibration);
        }
        let output = CHANNEL.step(state, &input);
        cx.local.valve.set(Value::Bit12Right(front_end::code(output.voltage)));
        cx.local.watchdog.pet();
        if let Some(window) = output.window {
            // A window for which the learner has no time counts as lost samples.
            learn::spawn(window, output.status).ok();
        }
    }

    /// Once a window of 16 ticks, below the tick.
    #[task(priority = 1, shared = [calibration], local = [learned, reported: u32 = 0])]
    async fn learn(mut cx: learn::Context, window: Window<f32>, flags: u32) {
        let calibration = LEARNER.update(cx.local.learned, &window);
        cx.shared.calibration.lock(|place| *place = Some(calibration));
        if flags != *cx.local.reported {
            *cx.local.reported = flags;
            defmt::info!("{}; {}", status::Words(flags), calibration);
        }
    }

    /// 170 MHz of the internal oscillator: 16 MHz / 4 · 85 / 2.
    fn clocks() -> Config {
        use embassy_stm32::rcc::{Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux};
        let mut config = Config::default();
        config.rcc.pll = Some(Pll {
            source: PllSource::HSI,
            prediv: PllPreDiv::DIV4,
            mul: PllMul::MUL85,
            divp: None,
            divq: None,
            divr: Some(PllRDiv::DIV2),
        });
        config.rcc.sys = Sysclk::PLL1_R;
        config.rcc.boost = true;
        config.rcc.mux.adc12sel = mux::Adcsel::SYS;
        config
    }
}
