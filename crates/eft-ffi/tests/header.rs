//! The committed header is what the pinned cbindgen makes of the sources, and compiles where it is used.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::Command;

const CRATE: &str = env!("CARGO_MANIFEST_DIR");

/// The sources with every macro expanded: cbindgen sees no further than that.
fn expanded() -> Vec<u8> {
    let out = Command::new(env!("CARGO"))
        .args(["rustc", "--quiet", "--lib", "--manifest-path", &format!("{CRATE}/Cargo.toml")])
        .args(["--target-dir", &format!("{CRATE}/../../target/header")])
        .args(["--", "-Zunpretty=expanded"])
        // Unpretty output is for nightly compilers; nothing that is built here is kept.
        .env("RUSTC_BOOTSTRAP", "1")
        .output()
        .unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    out.stdout
}

/// To take over a change: `EFT_WRITE_HEADER=1 cargo test -p eft-ffi --test header`.
#[test]
fn committed_header_is_what_the_sources_say() {
    let source = Path::new(env!("CARGO_TARGET_TMPDIR")).join("eft-ffi-expanded.rs");
    std::fs::write(&source, expanded()).unwrap();
    let config = cbindgen::Config::from_file(format!("{CRATE}/cbindgen.toml")).unwrap();
    let bindings = cbindgen::Builder::new().with_config(config).with_src(source).generate().unwrap();
    let mut header = Vec::new();
    bindings.write(&mut header);
    let header = String::from_utf8(header).unwrap();
    let path = format!("{CRATE}/include/eft.h");
    if std::env::var_os("EFT_WRITE_HEADER").is_some() {
        std::fs::write(&path, &header).unwrap();
    }
    assert!(
        std::fs::read_to_string(&path).unwrap() == header,
        "include/eft.h is not what the sources say: EFT_WRITE_HEADER=1 cargo test -p eft-ffi --test header"
    );
}

#[test]
fn the_proof_without_panics_names_every_function() {
    let header = std::fs::read_to_string(format!("{CRATE}/include/eft.h")).unwrap();
    let proof = std::fs::read_to_string(format!("{CRATE}/../../firmware/proof/src/main.rs")).unwrap();
    let named: Vec<_> = proof
        .split(|c: char| !c.is_alphanumeric() && c != '_')
        .filter(|word| word.starts_with("eft_"))
        .collect();
    let declared = header.split('(').filter_map(|before| {
        before
            .rsplit(|c: char| !c.is_alphanumeric() && c != '_')
            .next()
            .filter(|word| word.starts_with("eft_"))
    });
    let mut count = 0;
    for function in declared {
        assert!(named.contains(&function), "firmware/proof does not keep {function}");
        count += 1;
    }
    assert!(count > 80, "{count} functions found");
}

#[test]
fn header_compiles_without_a_warning() {
    let include = format!("-I{CRATE}/include");
    let header = format!("{CRATE}/include/eft.h");
    let strict = ["-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-fsyntax-only"];
    for (compiler, language, standard) in [
        ("cc", "c", "-std=c99"),
        ("cc", "c", "-std=c11"),
        ("c++", "c++", "-std=c++17"),
        ("arm-none-eabi-gcc", "c", "-std=c99"),
    ] {
        let run =
            Command::new(compiler).args(strict).args([standard, &include, "-x", language, &header]).output();
        match run {
            Ok(out) => assert!(
                out.status.success(),
                "{compiler} {standard}: {}",
                String::from_utf8_lossy(&out.stderr)
            ),
            Err(_) => eprintln!("{compiler} is not installed: not tried"),
        }
    }
}
