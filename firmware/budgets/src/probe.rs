//! Instructions and stack of one call.

use core::arch::global_asm;

use semihosting::println;

use crate::inputs::Random;

/// The trampoline's arguments, the registers that it saves, and its results.
#[repr(C)]
struct Probe {
    function: usize,
    /// Bytes of stack that are painted.
    depth: u32,
    saved: [u32; 8],
    start: u32,
    end: u32,
    stack: u32,
}

#[unsafe(no_mangle)]
static mut EFT_PROBE: Probe = Probe { function: 0, depth: 0, saved: [0; 8], start: 0, end: 0, stack: 0 };

// Calls the function with its caller's registers and stack pointer, since arguments may be on the stack.
global_asm!(
    ".syntax unified",
    // For the emulated processor, which may differ from the target of the other code.
    ".arch armv7e-m",
    ".thumb",
    ".section .text.eft_probe_call, \"ax\"",
    ".balign 4",
    ".global eft_probe_call",
    ".type eft_probe_call, %function",
    ".thumb_func",
    "eft_probe_call:",
    "ldr r12, =EFT_PROBE + 8",
    "stm r12, {{r4-r10, lr}}",
    "ldr r4, =0xC0DEC0DE",
    "mov r5, sp",
    "ldr r6, =EFT_PROBE + 4",
    "ldr r6, [r6]",
    "sub r6, r5, r6",
    "1: str r4, [r5, #-4]!",
    "cmp r5, r6",
    "bne 1b",
    "ldr r9, =EFT_PROBE",
    "ldr r10, [r9]",
    "ldr r6, =0xE000E018",
    "ldr r7, [r6]",
    "blx r10",
    "ldr r8, [r6]",
    "str r7, [r9, #40]",
    "str r8, [r9, #44]",
    "ldr r5, [r9, #4]",
    "sub r5, sp, r5",
    "2: ldr r6, [r5], #4",
    "cmp r5, sp",
    "beq 3f",
    "cmp r6, r4",
    "beq 2b",
    "3: sub r5, r5, #4",
    "sub r5, sp, r5",
    "str r5, [r9, #48]",
    "ldr r12, =EFT_PROBE + 8",
    "ldm r12, {{r4-r10, pc}}",
    ".ltorg",
);

unsafe extern "C" {
    fn eft_probe_call();
}

/// The cost of one call.
#[derive(Clone, Copy, Default)]
pub struct Cost {
    pub instructions: u32,
    pub stack: u32,
}

impl Cost {
    /// The higher of both instructions and of both stacks.
    pub fn raise(&mut self, other: Self) {
        self.instructions = self.instructions.max(other.instructions);
        self.stack = self.stack.max(other.stack);
    }
}

impl core::fmt::Display for Cost {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} {}", self.instructions, self.stack)
    }
}

/// Most bytes of stack: of functions in the tick or of its learner, and of functions that make a configuration.
pub const TICK: u32 = 1024;
pub const CONFIGURE: u32 = 32_768;

/// Arms the probe for `function`, which uses `depth` bytes of stack at most. Returns the address of the trampoline,
/// which is called with the signature of `function`.
pub fn arm(function: usize, depth: u32) -> usize {
    // Safety: single-threaded, no interrupt touches the probe.
    unsafe { (EFT_PROBE.function, EFT_PROBE.depth) = (function, depth) };
    eft_probe_call as *const () as usize
}

pub fn cost() -> Cost {
    // Safety: as above.
    let (start, end, stack) = unsafe { (EFT_PROBE.start, EFT_PROBE.end, EFT_PROBE.stack) };
    let ticks = start.wrapping_sub(end) & 0x00ff_ffff;
    Cost { instructions: instructions(ticks), stack }
}

/// Period of the timer's clock (ns).
const TIMER_PERIOD: u32 = match u32::from_str_radix(env!("EFT_TIMER_PERIOD"), 10) {
    Ok(period) => period,
    Err(_) => panic!("no number"),
};

/// One instruction takes 2^8 ns under `-icount shift=8`, which is several ticks of the timer. So one tick more or less
/// does not count. The call and the reading of the timer are two instructions.
fn instructions(ticks: u32) -> u32 {
    ((ticks * TIMER_PERIOD + 128) / 256).wrapping_sub(2)
}

/// The highest cost over many calls, printed.
pub fn worst(name: impl core::fmt::Display, mut call: impl FnMut(&mut Random)) {
    let mut worst = Cost::default();
    let mut random = Random(12345);
    for _ in 0..20_000 {
        call(&mut random);
        worst.raise(cost());
    }
    println!("{name} {worst}");
}

/// `$function`, called through the probe.
macro_rules! probed {
    ($function:expr, $type:ty) => {
        $crate::probe::probed!($function, $type, $crate::probe::TICK)
    };
    ($function:expr, $type:ty, $depth:expr) => {{
        let armed = $crate::probe::arm($function as *const () as usize, $depth);
        // Safety: the trampoline passes every argument on unchanged.
        unsafe { core::mem::transmute::<usize, $type>(armed) }
    }};
}
pub(crate) use probed;
