//! Compares the committed header with what the pinned cbindgen makes from the sources. `EFT_WRITE_HEADER=1 make header`
//! writes it.

mod layout;

use std::path::Path;
use std::process::{Command, ExitCode};

use eft_ffi::*;

use crate::layout::laid_out;

const CRATE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The sources with every macro expanded, because cbindgen expands none.
fn expanded(target: &Path) -> Vec<u8> {
    let out = Command::new(env!("CARGO"))
        .args(["rustc", "--quiet", "--lib", "--manifest-path", &format!("{CRATE}/Cargo.toml")])
        .arg("--target-dir")
        .arg(target)
        .args(["--", "-Zunpretty=expanded"])
        // Unpretty output needs a nightly compiler. Nothing that is built here is kept.
        .env("RUSTC_BOOTSTRAP", "1")
        .output()
        .unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    out.stdout
}

/// The header's assertions: sizes of structs, or of a struct in both precisions.
macro_rules! sizes {
    ($($Name:ident)*) => {
        vec![$(format!("EFT_STATIC_ASSERT(sizeof({}) == {});", stringify!($Name), size_of::<$Name>())),*]
    };
    ($($Name:ident)*; f32 f64) => {
        vec![$(format!(
            "EFT_SIZES({}, {}, {});", stringify!($Name), size_of::<$Name<f32>>(), size_of::<$Name<f64>>()
        )),*]
    };
}

fn main() -> ExitCode {
    let target = Path::new(CRATE).join("../../target/header");
    let source = target.join("eft-ffi-expanded.rs");
    std::fs::write(&source, expanded(&target)).unwrap();
    let config = cbindgen::Config::from_file(format!("{CRATE}/cbindgen.toml")).unwrap();
    // Flags, causes and the input come from the core.
    let core = format!("{CRATE}/../eft-core/src");
    let bindings = cbindgen::Builder::new()
        .with_config(config)
        .with_src(source)
        .with_src(format!("{core}/status.rs"))
        .with_src(format!("{core}/cause.rs"))
        .with_src(format!("{core}/signals.rs"))
        .generate()
        .unwrap();
    let mut raw = Vec::new();
    bindings.write(&mut raw);
    let sizes = [
        sizes!(eft_learning eft_plausibility eft_protection eft_parameters eft_error eft_saved_calibration),
        sizes!(eft_channel eft_state eft_input eft_output eft_window eft_calibration eft_learner eft_learner_state
            eft_learned; f32 f64),
    ]
    .concat();
    let header = laid_out(&String::from_utf8(raw).unwrap(), &sizes);
    let path = format!("{CRATE}/include/eft.h");
    if std::env::var_os("EFT_WRITE_HEADER").is_some() {
        std::fs::write(&path, &header).unwrap();
    } else if std::fs::read_to_string(&path).unwrap() != header {
        eprintln!("include/eft.h differs from the sources: EFT_WRITE_HEADER=1 make header");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
