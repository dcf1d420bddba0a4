//! Values and units in texts.

use proptest::prelude::*;

use super::table::CASED;
use super::*;
use crate::config::KEYS;

fn near(text: &str, si: &str, expected: f64) {
    let found = quantity(text, si).unwrap_or_else(|| panic!("{text} in {si}"));
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{text}: {found} {si}");
}

#[test]
fn values_convert() {
    near("12 t", "kg", 12_000.0);
    near("12 tonne", "kg", 12_000.0);
    near("5000 kgf", "N", 5000.0 * 9.806_65);
    near("210 kgf/cm2", "Pa", 210.0 * 9.806_65e4);
    near("5 tf", "N", 5000.0 * 9.806_65);
    near("250kN", "N", 250e3);
    near("3000 psi", "Pa", 3000.0 * 6_894.757_293_168_361);
    near("15 gpm", "m³/s", 15.0 * 6.309_019_64e-5);
    near("3.96 kip/in", "N/m", 3.96e3 * 4.448_221_615_260_5 / 0.0254);
    near("1e3 N·s/mm", "N·s/m", 1e6);
    near("12.73 in^2", "m²", 12.73 * 0.0254 * 0.0254);
    near("80 cm2", "m²", 8e-3);
    near("2 L/(min bar)", "m³/(s·Pa)", 2e-3 / 60.0 / 1e5);
    near("2 L/min/bar", "m³/(s·Pa)", 2e-3 / 60.0 / 1e5);
    near("-5 %", "", -0.05);
    near("0.3 g", "m/s²", 0.3 * 9.806_65);
    near("4 1/h", "1/h", 4.0);
    near("0.5 lbf s / in", "N·s/m", 0.5 * 4.448_221_615_260_5 / 0.0254);
    near("0.25", "", 0.25);
    near("12.73 sq. in.", "m²", 12.73 * 0.0254 * 0.0254);
    near("3 cu ft", "m³", 3.0 * 0.3048 * 0.3048 * 0.3048);
    near("2 hp", "W", 2.0 * 745.699_871_582_270_2);
    near("10 Gal", "m/s²", 0.1);
    near("10 Gallons", "m³", 10.0 * 3.785_411_784e-3);
}

#[test]
fn a_unit_has_its_spellings() {
    for (si, spellings) in [
        ("m", "in In inch Inches"),
        ("m²", "in2 in^2 in**2 in² sq_in sq._in. SQ_IN square_inches in·in"),
        ("kg", "lb lbs LB lb."),
        ("N", "kip kips Kip KIPS"),
        ("N", "kN KN kn"),
        ("Pa", "psi PSI lbf/in2 lbf/sq_in"),
        ("m³/s", "lpm LPM l/min L/min L/MIN litre/minute liters_/_min"),
        ("m³/s", "gpm GPM gal/min"),
        ("m³/s", "in3/s in3/sec cu_in/s"),
        ("m/s", "in/s in/sec inps in_s-1 in·s⁻¹ ins-1"),
        ("m/s²", "ft/s2 ft/s/s ft/sec/sec ft/sec^2 FT/SEC**2 ftps2 fts2 fts-2 ft·s⁻²"),
        ("m/s²", "g G g's gs"),
        ("s", "ms msec MSEC milliseconds"),
        ("s", "µs μs us usec microsecond"),
        ("1", "% percent"),
    ] {
        let values: Vec<_> = spellings.split(' ').map(|text| factor(&text.replace('_', " "), si)).collect();
        assert!(
            values[0].is_some() && values.iter().all(|value| *value == values[0]),
            "{spellings}: {values:?}"
        );
    }
}

#[test]
fn a_column_of_measurements_decides_between_two_meanings() {
    for (name, si, meant) in
        [("lb", "N", "lbf"), ("Lbs.", "N", "lbf"), ("GAL", "m/s²", "cm/s²"), ("gals", "m/s²", "Gal")]
    {
        assert_eq!(factor(name, si), None, "{name}");
        assert_eq!(factor_of_column(name, si), factor(meant, si), "{name}");
    }
    assert_eq!(factor_of_column("gal", "m³"), factor("gal", "m³"));
    assert_eq!(factor_of_column("lb", "m"), None);
}

proptest! {
    #[test]
    fn any_text_is_a_unit_or_not(text in ".*", brackets in 0_usize..100_000) {
        for text in [text, format!("{}m", "(".repeat(brackets))] {
            for si in ["m", "m/s²", "N", ""] {
                prop_assert!(factor_of_column(&text, si).is_none_or(|one| one > 0.0 && one.is_finite()));
            }
        }
    }
}

#[test]
fn a_name_means_one_unit_and_every_offered_unit_is_known() {
    let names: Vec<_> = units().flat_map(|(names, _)| names.split(' ')).collect();
    for (at, name) in names.iter().enumerate() {
        assert!(!names[..at].contains(name), "{name}");
        let alone = !names[..at].iter().any(|other| other.eq_ignore_ascii_case(name));
        assert!(alone || CASED.contains(&name.to_ascii_lowercase().as_str()), "{name}");
    }
    for name in OFFERED.split(", ") {
        assert!(unit(name).is_some(), "{name}");
    }
}

#[test]
fn a_text_that_is_not_a_quantity_of_the_dimension_is_refused() {
    for (text, si) in [
        ("", "kg"),
        ("t", "kg"),
        ("12", "kg"),
        ("12 kip", "kg"),
        ("12 foo", "kg"),
        ("12 t t", "kg"),
        ("nan kg", "kg"),
        ("inf m", "m"),
        ("12 (t", "kg"),
        ("12 t)", "kg"),
        ("12 /t", "kg"),
        ("12 t/", "kg"),
        ("3 lb", "N"),
        ("1,5 m", "m"),
        ("5 12", ""),
        ("5 % g", "m/s²"),
        ("5 mN", "N"),
        ("5 MPA", "Pa"),
        ("5 mpa", "Pa"),
        ("5 GAL", "m³"),
        ("5 gal", "m/s²"),
        ("5 kN s", "N"),
        ("5 in sq", "m²"),
    ] {
        assert_eq!(quantity(text, si), None, "{text}");
    }
}

/// A million digits took more than a minute.
#[test]
fn a_text_longer_than_any_quantity_is_refused_at_once() {
    for filler in ["9", " "] {
        assert_eq!(quantity(&format!("1{} x m", filler.repeat(1_000_000)), "m"), None);
    }
    assert_eq!(quantity(&format!("{}1 m", " ".repeat(1_000_000)), "m"), Some(1.0));
}

#[test]
fn a_unit_is_the_first_of_those_that_convert_to_it() {
    assert_eq!(units_of("kg"), "kg, t, tonne, lb, slug");
    assert_eq!(units_of("1/h"), "1/h, Hz, kHz");
    assert_eq!(units_of("m³/s"), "m³/s, gpm, lpm, L/s, L/min, in³/s");
    assert_eq!(units_of("samples"), "samples");
}

#[test]
fn every_unit_of_the_schema_is_known() {
    for row in KEYS.iter().filter(|row| !["bits", "samples"].contains(&row.unit)) {
        assert!(unit(row.unit).is_some(), "{}: {}", row.key, row.unit);
    }
}
