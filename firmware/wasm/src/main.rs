//! Interprets the module that `lib.rs` makes: prints the bits of each line of `bits.txt` as WebAssembly computes them.
//!
//! usage: eft-wasm MODULE

use std::error::Error;

use wasmi::{Engine, Linker, Module, Store};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: eft-wasm MODULE")?;
    let engine = Engine::default();
    let module = Module::new(&engine, &std::fs::read(path)?)?;
    let mut store = Store::new(&engine, ());
    let instance = Linker::new(&engine).instantiate_and_start(&mut store, &module)?;
    for line in eft_golden::BITS.lines() {
        let (name, _) = line.rsplit_once(' ').ok_or("bits.txt: no hash in a line")?;
        let replay = instance.get_typed_func::<(), u64>(&store, &name.replace(' ', "_"))?;
        println!("{name} {:016x}", replay.call(&mut store, ())?);
    }
    Ok(())
}
