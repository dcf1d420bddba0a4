//! Links only the interface and the functions that it calls.
fn main() {
    println!("cargo:rustc-link-arg=--entry=eft_proof");
    println!("cargo:rustc-link-arg=--gc-sections");
}
