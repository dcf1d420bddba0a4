//! Prints the hash of the force for settings on standard input, which the page in the browser must reproduce.

use std::io::{Read, stdin};

use eft_web::Session;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut settings = String::new();
    stdin().read_to_string(&mut settings)?;
    println!("{}", Session::new(&settings)?.tell()?.hash);
    Ok(())
}
