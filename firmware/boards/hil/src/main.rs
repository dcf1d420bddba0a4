//! The core on your processor: the golden bits and the cycles. The report is a table to send back.
#![no_std]
#![no_main]

mod board;
mod cycles;
mod report;

use cortex_m::Peripherals;
use cortex_m_rt::{entry, exception};
use eft_core::{
    Calibration, Channel, ChannelState, Compensation, Input, LearnerState, Output, Parameters, Window,
};
use eft_rigs::{adaptive, guarded, uneven, worn, zhao2005};

use cycles::{Counter, Cycles};
use report::{exit, line};

/// Whether a hash is the committed one; a line of the report.
fn compare(rig: &str, replay: &str, hash: u64) -> bool {
    let committed = eft_golden::BITS.lines().find_map(|bits| {
        let bits = bits.strip_prefix(rig)?.strip_prefix(' ')?.strip_prefix(replay)?.strip_prefix(' ')?;
        u64::from_str_radix(bits, 16).ok()
    });
    let equal = committed == Some(hash);
    line!("| {} | {} | {:016x} | {} |", rig, replay, hash, if equal { "equal" } else { "DIFFERENT" });
    equal
}

/// The bits of a controller that learns nothing; 0 where the rig is refused.
fn controller<const N: usize>(rig: &str, parameters: &Parameters) -> bool {
    let channel = Channel::<f32, N>::new(&eft_golden::fixed(*parameters));
    compare(rig, "controller", channel.as_ref().map_or(0, eft_golden::controller))
}

/// The same, and the bits of its compensation.
fn fixed<const N: usize>(rig: &str, parameters: &Parameters) -> bool {
    let controller = controller::<N>(rig, parameters);
    let compensation =
        Compensation::<f32, N>::new(parameters).map_or(0, |core| eft_golden::compensation(&core));
    compare(rig, "compensation", compensation) && controller
}

/// A rig, called as in its firmware.
struct Subject {
    rig: &'static str,
    state: ChannelState<f32>,
    step: fn(&mut ChannelState<f32>, &Input<f32>) -> Output<f32>,
    learn: Option<(LearnerState<f32>, Update)>,
    publish: fn(&mut ChannelState<f32>, Calibration<f32>),
}
type Update = fn(&mut LearnerState<f32>, &Window<f32>) -> Calibration<f32>;

macro_rules! subject {
    ($rig:ident, $learn:expr) => {
        Subject {
            rig: stringify!($rig),
            state: $rig::CHANNEL.at_rest(),
            step: |state, input| $rig::CHANNEL.step(state, input),
            learn: $learn,
            publish: |state, calibration| $rig::CHANNEL.publish(state, calibration),
        }
    };
}

impl Subject {
    /// Replays the golden run in which a rig learns: its hash, and the cycles of tick and learner.
    fn replay(mut self, counter: Option<Counter>) -> (u64, Cycles, Cycles) {
        let (mut tick, mut update) = (Cycles::NONE, Cycles::NONE);
        let hash = eft_golden::learning(|sample| {
            let input = sample.input();
            let output = tick.of(counter, || (self.step)(&mut self.state, &input));
            if let (Some(window), Some((learned, learn))) = (&output.window, &mut self.learn) {
                let calibration = update.of(counter, || learn(learned, window));
                (self.publish)(&mut self.state, calibration);
            }
            (output.voltage, output.status)
        });
        (hash, tick, update)
    }
}

#[entry]
fn main() -> ! {
    board::start();
    let Some(mut peripherals) = Peripherals::take() else { exit(false) };
    let counter = Counter::start(&mut peripherals);
    line!("eft-core {}, CPUID {:08x}", env!("CARGO_PKG_VERSION"), peripherals.CPUID.base.read());
    line!("");
    line!("| rig | replay | bits | against the committed ones |");
    line!("| --- | --- | --- | --- |");
    let mut equal = fixed::<{ zhao2005::POINTS }>("zhao2005", &zhao2005::PARAMETERS);
    equal &= fixed::<{ uneven::POINTS }>("uneven", &uneven::PARAMETERS);
    equal &= controller::<{ worn::POINTS }>("worn", &worn::PARAMETERS);
    let learns = [
        subject!(adaptive, Some((adaptive::LEARNER.at_rest(), |s, w| adaptive::LEARNER.update(s, w)))),
        subject!(guarded, Some((guarded::LEARNER.at_rest(), |s, w| guarded::LEARNER.update(s, w)))),
        subject!(worn, Some((worn::LEARNER.at_rest(), |s, w| worn::LEARNER.update(s, w)))),
    ]
    .map(|subject| {
        let rig = subject.rig;
        let (hash, tick, update) = subject.replay(counter);
        equal &= compare(rig, "learning", hash);
        (rig, tick, update)
    });
    // The paper's rig has no golden run of this kind. It is measured for its cycles.
    let (_, paper, _) = subject!(zhao2005, None).replay(counter);

    line!("");
    line!("| rig | call | calls | least, cycles | mean | most |");
    line!("| --- | --- | --- | --- | --- | --- |");
    row("zhao2005", "tick", &paper);
    for (rig, tick, update) in &learns {
        row(rig, "tick", tick);
        row(rig, "learner", update);
    }
    if counter.is_none() {
        line!("No cycles: this processor, or its emulator, has no cycle counter.");
    }
    exit(equal)
}

fn row(rig: &str, call: &str, cycles: &Cycles) {
    if cycles.calls > 0 {
        line!(
            "| {} | {} | {} | {} | {} | {} |",
            rig,
            call,
            cycles.calls,
            cycles.least,
            cycles.mean(),
            cycles.most
        );
    }
}

#[exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    line!("hard fault");
    exit(false)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    line!("panic");
    exit(false)
}
