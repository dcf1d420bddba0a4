//! Real ground motions, compared with values from another program (PGA in g, points, step).
//!
//! They may not be distributed: `EFT_RECORDS` names their folder, and without it these tests are skipped with
//! a message.

use eft_sim::RigConfig;
use eft_sim::records::{STANDARD_GRAVITY, read_record};
use std::path::{Path, PathBuf};

fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("EFT_RECORDS").filter(|value| !value.is_empty());
    if folder.is_none() {
        eprintln!("skipped: EFT_RECORDS does not name a folder with ground motions");
    }
    folder.map(PathBuf::from)
}

#[test]
fn real_records_have_their_known_peaks() {
    let Some(folder) = folder() else { return };
    for (file, points, dt, pga) in [
        ("northridge1994_sylmar_county_360.csv", 3000, 0.02, 0.8431),
        ("RSN6_IMPVALL.I_I-ELC180-hor1.AT2", 5372, 0.01, 0.2808),
        ("RSN77_SFERN_PUL164-hor1.AT2", 4172, 0.01, 1.2190),
    ] {
        let record = read_record(folder.join(file)).unwrap();
        assert_eq!((record.acceleration.len(), record.dt), (points, dt), "{file}");
        assert!((record.pga() / STANDARD_GRAVITY - pga).abs() < 5e-5, "{file}: {}", record.pga());
    }
}

#[test]
fn the_shipped_record_is_el_centro() {
    let shipped = "../../python/eft/data/RSN6_IMPVALL.I_I-ELC180-hor1.AT2";
    let record = read_record(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(shipped)).unwrap();
    assert_eq!(record.name, "Imperial Valley-02, 5/19/1940, El Centro Array #9, 180");
    assert_eq!((record.acceleration.len(), record.dt), (5372, 0.01));
    // The first and the last line of the file, in g.
    assert_eq!(record.acceleration[0], 0.998_485_2e-3 * STANDARD_GRAVITY);
    assert_eq!(record.acceleration[5371], -0.179_015_8e-3 * STANDARD_GRAVITY);
    assert!((record.pga() / STANDARD_GRAVITY - 0.2808).abs() < 5e-5);
}

/// A pipe would make the reader wait for its other end, and a device would fill the memory.
#[test]
#[cfg(unix)]
fn pipes_and_devices_are_refused_at_once() {
    let pipe = std::env::temp_dir().join(format!("eft-pipe-{}", std::process::id()));
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for path in [pipe.as_path(), Path::new("/dev/zero")] {
        for error in [read_record(path).unwrap_err(), RigConfig::read(path).unwrap_err()] {
            let says = format!("{}: is a pipe or a device, must be an ordinary file", path.display());
            assert_eq!(error.to_string(), says);
        }
    }
    std::fs::remove_file(&pipe).unwrap();
}
