//! usage: export rust|c [RIG.toml]
//!
//! Prints a rig's controller as source text; the paper's rig without a file.

use std::error::Error;

use eft_sim::RigConfig;
use eft_sim::export::export;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (target, rig) = match &arguments[..] {
        [target] => (target, RigConfig::zhao2005()),
        [target, path] => (target, RigConfig::from_toml(&std::fs::read_to_string(path)?)?),
        _ => return Err("usage: rust|c [RIG.toml]".into()),
    };
    print!("{}", export(&rig, None, target.parse()?)?);
    Ok(())
}
