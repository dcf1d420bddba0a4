//! Selects the linker script of the emulated board with the target's processor.
fn main() {
    let target = std::env::var("TARGET").unwrap_or_default();
    let folder = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    // ARMv6-M code runs on a Cortex-M4. The Cortex-M33 is on another board, whose timer has another clock.
    let (board, nanoseconds) = if target.starts_with("thumbv8m") { ("an505", 50) } else { ("an386", 40) };
    println!("cargo:rustc-link-search={folder}/boards/{board}");
    println!("cargo:rustc-env=EFT_TIMER_PERIOD={nanoseconds}");
    println!("cargo:rustc-link-arg=-Tlink.x");
    println!("cargo:rerun-if-changed=build.rs");
}
