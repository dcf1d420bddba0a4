//! Gives the linker its scripts: the memory of the board that `EFT_MEMORY` names, or of QEMU's.
use std::{env, fs, path::PathBuf};

fn main() {
    println!("cargo:rerun-if-env-changed=EFT_MEMORY");
    let memory = env::var("EFT_MEMORY").unwrap_or_else(|_| "memory.x".into());
    println!("cargo:rerun-if-changed={memory}");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    fs::copy(&memory, out.join("memory.x")).unwrap_or_else(|e| panic!("EFT_MEMORY = {memory}: {e}"));
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg=-Tlink.x");
    if env::var_os("CARGO_FEATURE_RTT").is_some() {
        println!("cargo:rustc-link-arg=-Tdefmt.x");
    }
}
