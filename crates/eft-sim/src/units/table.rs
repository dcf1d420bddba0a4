//! The units: names, factors and dimensions.

/// Exponents of kg, m, s and V.
type Dimension = [i8; 4];

/// Factor to SI and dimension.
pub(super) type Unit = (f64, Dimension);

const INCH: f64 = 0.0254;
const FOOT: f64 = 0.3048;
const POUND: f64 = 0.453_592_37;
/// Standard gravity, m/s².
pub const STANDARD_GRAVITY: f64 = 9.806_65;
const POUND_FORCE: f64 = POUND * STANDARD_GRAVITY;
const PSI: f64 = POUND_FORCE / (INCH * INCH);
/// The gallon of the United States, m³.
const GALLON: f64 = 231.0 * INCH * INCH * INCH;

pub(super) const NUMBER: Dimension = [0, 0, 0, 0];

/// All names of each unit and its factor to SI, by dimension.
///
/// `lb` is a mass and `lbf` a force. `gal` is the gallon of the United States, `Gal` the unit of seismology.
#[rustfmt::skip]
const UNITS: &[(Dimension, &[(&str, f64)])] = &[
    (NUMBER, &[("1", 1.0), ("% percent", 1e-2)]),
    ([1, 0, 0, 0], &[("kg", 1.0), ("t", 1e3), ("tonne", 1e3), ("lb lbs", POUND), ("slug", POUND_FORCE / FOOT)]),
    ([0, 1, 0, 0], &[("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("µm", 1e-6), ("um", 1e-6)]),
    ([0, 1, 0, 0], &[("in inch inches", INCH), ("ft foot feet", FOOT)]),
    ([0, 0, 1, 0], &[("s sec second", 1.0), ("ms msec millisecond", 1e-3), ("µs", 1e-6)]),
    ([0, 0, 1, 0], &[("us usec microsecond", 1e-6), ("min minute", 60.0), ("h hour", 3600.0)]),
    ([0, 0, -1, 0], &[("Hz", 1.0), ("kHz", 1e3)]),
    ([1, 1, -2, 0], &[("N", 1.0), ("kN", 1e3), ("MN", 1e6), ("kgf", STANDARD_GRAVITY), ("tf", 1e3 * STANDARD_GRAVITY)]),
    ([1, 1, -2, 0], &[("lbf", POUND_FORCE), ("kip", 1e3 * POUND_FORCE)]),
    ([1, -1, -2, 0], &[("Pa", 1.0), ("kPa", 1e3), ("MPa", 1e6), ("GPa", 1e9), ("bar", 1e5)]),
    ([1, -1, -2, 0], &[("psi", PSI), ("ksi", 1e3 * PSI)]),
    ([0, 3, 0, 0], &[("L litre liter", 1e-3), ("mL", 1e-6), ("gal gals gallon", GALLON)]),
    ([0, 3, -1, 0], &[("gpm", GALLON / 60.0), ("lpm", 1e-3 / 60.0)]),
    ([0, 1, -2, 0], &[("g gs", STANDARD_GRAVITY), ("Gal Gals", 1e-2)]),
    ([1, 2, -3, 0], &[("W", 1.0), ("kW", 1e3), ("hp", FOOT * POUND_FORCE * 550.0)]),
    ([0, 0, 0, 1], &[("V volt", 1.0), ("mV", 1e-3)]),
];

/// The names of each unit, and the unit.
pub(super) fn units() -> impl Iterator<Item = (&'static str, Unit)> {
    UNITS
        .iter()
        .flat_map(|(dimension, units)| units.iter().map(|(names, factor)| (*names, (*factor, *dimension))))
}

/// Products that messages offer beside the units of the same dimension.
pub(super) const OFFERED: &str = "kgf/cm², cm², mm², in², sq in, ft², cm³, in³, L/s, L/min, in³/s, cm/s, mm/s, \
    in/s, ft/s, m/s², cm/s², mm/s², in/s², ft/s², kN/m, N/mm, kN/mm, lbf/in, kip/in, kN·s/m, lbf·s/in, \
    kip·s/in, L/MPa, in³/psi, L/min/MPa, gpm/psi, V/kN, V/kip, V/mm, V/in";

/// Names that another letter case gives another meaning, in lower case: `Gal` is not `gal`, `mPa` not `MPa`.
pub(super) const CASED: [&str; 5] = ["mn", "mpa", "mv", "gal", "gals"];

/// Names with another meaning in a file of measurements, where the quantity is known, and that meaning.
pub(super) const MEASURED: [(&str, &str); 4] =
    [("lb", "lbf"), ("lbs", "lbf"), ("gal", "Gal"), ("gals", "Gal")];
