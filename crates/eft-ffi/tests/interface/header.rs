//! The committed header compiles in C and C++. `make lint` compares it with the sources.

use std::io::Write;
use std::path::Path;
use std::process::Command;

const CRATE: &str = env!("CARGO_MANIFEST_DIR");

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
