//! A bare link: nothing but the interface and what it reaches.
fn main() {
    println!("cargo:rustc-link-arg=--entry=eft_proof");
    println!("cargo:rustc-link-arg=--gc-sections");
}
