//! The committed header is what the pinned cbindgen makes from the sources. It compiles in C and C++.

use std::io::Write;
use std::path::Path;
use std::process::Command;

use eft_ffi::*;

use crate::layout::laid_out;

const CRATE: &str = env!("CARGO_MANIFEST_DIR");

/// The sources with every macro expanded, because cbindgen expands none.
fn expanded() -> Vec<u8> {
    let out = Command::new(env!("CARGO"))
        .args(["rustc", "--quiet", "--lib", "--manifest-path", &format!("{CRATE}/Cargo.toml")])
        .args(["--target-dir", &format!("{CRATE}/../../target/header")])
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

/// To accept a change: `EFT_WRITE_HEADER=1 cargo test -p eft-ffi --test interface header`.
#[test]
fn the_committed_header_agrees_with_the_sources() {
    let source = Path::new(env!("CARGO_TARGET_TMPDIR")).join("eft-ffi-expanded.rs");
    std::fs::write(&source, expanded()).unwrap();
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
    }
    assert!(
        std::fs::read_to_string(&path).unwrap() == header,
        "include/eft.h differs from the sources: EFT_WRITE_HEADER=1 cargo test -p eft-ffi --test interface header"
    );
}

#[test]
fn the_proof_of_no_panics_names_every_function() {
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
    assert!(count > 50, "{count} functions found");
}

/// The header, and its example as a program.
fn sources() -> [String; 2] {
    let header = std::fs::read_to_string(format!("{CRATE}/include/eft.h")).unwrap();
    let (_, after) = header.split_once("     #include \"eft.h\"\n").unwrap();
    let (example, _) = after.split_once("\n   With the learner").unwrap();
    // For compilers that warn about a missing prototype.
    let prototypes =
        "int start(void);\nfloat tick(float command, float velocity, float force, float spool);\n";
    [
        "#include \"eft.h\"\n#include \"eft.h\"\n".to_owned(),
        format!("#include \"eft.h\"\n{prototypes}{example}"),
    ]
}

/// Writes a file and returns its path.
fn written(name: &str, text: &str) -> String {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn header_and_its_example_compile_without_a_warning() {
    let include = format!("-I{CRATE}/include");
    let strict =
        ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Wmissing-declarations", "-Werror"];
    for (n, source) in sources().iter().enumerate() {
        let path = written(&format!("header{n}.c"), source);
        for (compiler, language, standard) in [
            ("cc", "c", "-std=c99"),
            ("cc", "c", "-std=c11"),
            ("c++", "c++", "-std=c++17"),
            ("arm-none-eabi-gcc", "c", "-std=c99"),
        ] {
            let mut command = Command::new(compiler);
            match command
                .args(strict)
                .args([standard, &include, "-fsyntax-only", "-x", language, &path])
                .output()
            {
                Ok(out) => assert!(
                    out.status.success(),
                    "{compiler} {standard}: {}",
                    String::from_utf8_lossy(&out.stderr)
                ),
                Err(_) => eprintln!("{compiler} is not installed: not tried"),
            }
        }
    }
}

#[test]
fn cppcheck_finds_nothing_in_header_and_example() {
    for (n, source) in sources().iter().enumerate() {
        let path = written(&format!("checked{n}.c"), source);
        let found = Command::new("cppcheck")
            .args(["--quiet", "--error-exitcode=1", "--inconclusive", "--std=c99"])
            .args(["--enable=warning,style,performance,portability"])
            .args([&format!("-I{CRATE}/include"), &path])
            .output();
        match found {
            Ok(out) => assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr)),
            // `eprintln` would be hidden in a test that passes.
            Err(_) => writeln!(std::io::stderr(), "cppcheck is not installed: skipped").unwrap(),
        }
    }
}

#[test]
fn an_ignored_return_code_is_a_warning() {
    let path = written(
        "dropped.c",
        "#include \"eft.h\"\nvoid f(eft_state_f32 *s);\nvoid f(eft_state_f32 *s)\n{\n  eft_request_trip_f32(s);\n}\n",
    );
    for (compiler, standard) in [("cc", "-std=c99"), ("c++", "-std=c++17")] {
        let mut command = Command::new(compiler);
        command.args(["-Werror=unused-result", "-c", "-o", "/dev/null", standard]);
        command.args([&format!("-I{CRATE}/include"), &path]);
        match command.output() {
            Ok(out) => assert!(
                String::from_utf8_lossy(&out.stderr).contains("eft_request_trip_f32"),
                "{compiler} {standard}: nothing said"
            ),
            Err(_) => eprintln!("{compiler} is not installed: not tried"),
        }
    }
}
