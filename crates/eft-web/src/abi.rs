//! The functions that the page calls.

use std::cell::RefCell;

use crate::session::{Session, Told};

/// Largest number of bytes of settings.
const LONGEST: usize = 1 << 20;

struct Memory {
    settings: Vec<u8>,
    told: Told,
    message: String,
}

thread_local! {
    static MEMORY: RefCell<Memory> = RefCell::new(Memory {
        settings: Vec::new(), told: Told::default(), message: String::new(),
    });
}

/// Allocates `length` bytes for the settings in UTF-8 and returns their address; 0 if there are too many.
#[unsafe(no_mangle)]
pub extern "C" fn reserve(length: usize) -> usize {
    if length > LONGEST {
        return 0;
    }
    MEMORY.with_borrow_mut(|memory| {
        memory.settings = vec![0; length];
        memory.settings.as_mut_ptr() as usize
    })
}

/// Runs the test of the settings. It returns 1, or 0 with an error message in trace 8.
#[unsafe(no_mangle)]
pub extern "C" fn run() -> u32 {
    MEMORY.with_borrow_mut(|memory| {
        let settings = String::from_utf8_lossy(&memory.settings).into_owned();
        match Session::new(&settings).and_then(|session| session.tell()) {
            Ok(told) => {
                memory.told = told;
                memory.message.clear();
                1
            }
            Err(error) => {
                memory.message = error.to_string();
                0
            }
        }
    })
}

/// Address of a trace: 0 command, 1 force, 2 spool, 3 displacement, 4 frequency, 5 ratio, 6 numbers (64-bit
/// floats); 7 TOML, 8 message, 9 hash (UTF-8).
#[unsafe(no_mangle)]
pub extern "C" fn pointer(trace: u32) -> usize {
    MEMORY.with_borrow(|memory| place(memory, trace).0)
}

/// Length of a trace, in numbers or bytes.
#[unsafe(no_mangle)]
pub extern "C" fn length(trace: u32) -> usize {
    MEMORY.with_borrow(|memory| place(memory, trace).1)
}

fn place(memory: &Memory, trace: u32) -> (usize, usize) {
    let told = &memory.told;
    let numbers = [
        &told.command,
        &told.force,
        &told.spool,
        &told.displacement,
        &told.frequency,
        &told.ratio,
        &told.numbers,
    ];
    let texts = [&told.toml, &memory.message, &told.hash];
    match numbers.get(trace as usize) {
        Some(values) => (values.as_ptr() as usize, values.len()),
        None => texts
            .get((trace as usize).wrapping_sub(numbers.len()))
            .map_or((0, 0), |text| (text.as_ptr() as usize, text.len())),
    }
}
