//! Results that may change within a test's bounds. `results.txt` keeps them, and its changes are reviewed like code.
//! `EFT_WRITE_RESULTS=1 cargo test --test adaptation` rewrites those of one binary.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::sync::Mutex;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/results/results.txt");

/// Allowed relative difference of a result from the kept one, which has three digits.
const TOLERANCE: f64 = 0.01;

/// The rows of this binary that were rewritten so far.
static TAKEN_OVER: Mutex<BTreeMap<String, String>> = Mutex::new(BTreeMap::new());

/// Compares the results of one case with their row.
#[track_caller]
pub(crate) fn keep(case: impl Display, results: &[(&str, f64)]) {
    let name = format!("{}: {case}", env!("CARGO_CRATE_NAME"));
    let found: Vec<_> = results.iter().map(|(what, value)| format!("{what} {}", digits(*value))).collect();
    let found = found.join(", ");
    if std::env::var_os("EFT_WRITE_RESULTS").is_some() {
        return take_over(name, found);
    }
    let table = std::fs::read_to_string(PATH).unwrap();
    let kept = table.lines().find_map(|line| line.strip_prefix(&name)?.strip_prefix(" | "));
    let kept = kept.ok_or_else(|| format!("no row in results.txt: {name} | {found}")).unwrap();
    let pairs: Vec<_> = kept.split(", ").map(|pair| pair.rsplit_once(' ').unwrap()).collect();
    let near = |((what, value), (kept_what, kept)): (&(&str, f64), &(&str, &str))| {
        let kept: f64 = kept.parse().unwrap();
        // The time of an event that never happened is NaN.
        let equal = (value - kept).abs() <= TOLERANCE * kept.abs() || value.is_nan() && kept.is_nan();
        what == kept_what && equal
    };
    let same = pairs.len() == results.len() && results.iter().zip(&pairs).all(near);
    assert!(same, "{name}: {found}; results.txt keeps {kept}");
}

/// A number with at least three digits.
fn digits(value: f64) -> String {
    if (1e-3..1e5).contains(&value.abs()) {
        format!("{value:.*}", (2.0 - value.abs().log10().floor()).max(0.0) as usize)
    } else {
        format!("{value:.2e}")
    }
}

fn take_over(name: String, found: String) {
    let mut rows = TAKEN_OVER.lock().unwrap();
    let of_this_binary = concat!(env!("CARGO_CRATE_NAME"), ":");
    if let Some(other) = rows.insert(name.clone(), found.clone()) {
        assert_eq!(other, found, "{name} names two cases");
    }
    let table = std::fs::read_to_string(PATH).unwrap_or_default();
    let others = table.lines().filter(|line| !line.starts_with(of_this_binary)).map(str::to_owned);
    let mut lines: Vec<_> =
        others.chain(rows.iter().map(|(name, found)| format!("{name} | {found}"))).collect();
    lines.sort();
    std::fs::write(PATH, lines.join("\n") + "\n").unwrap();
}
