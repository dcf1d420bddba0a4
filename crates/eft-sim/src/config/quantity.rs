//! Values with their unit, such as `"12 t"`, `"15 gpm"` or `"3.96 kip/in"`.

/// Exponents of kg, m, s and V.
type Dimension = [i8; 4];

/// Factor to SI and dimension.
type Unit = (f64, Dimension);

const INCH: f64 = 0.0254;
const POUND: f64 = 0.453_592_37;
/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;
const POUND_FORCE: f64 = POUND * GRAVITY;
const PSI: f64 = POUND_FORCE / (INCH * INCH);
/// The gallon of the United States, m³.
const GALLON: f64 = 231.0 * INCH * INCH * INCH;

const NUMBER: Dimension = [0, 0, 0, 0];

/// All units by dimension. `lb` is a mass and `lbf` a force; `g` is standard gravity, `gal` the gallon of the
/// United States.
#[rustfmt::skip]
const UNITS: &[(Dimension, &[(&str, f64)])] = &[
    (NUMBER, &[("1", 1.0), ("%", 1e-2)]),
    ([1, 0, 0, 0], &[("kg", 1.0), ("t", 1e3), ("tonne", 1e3), ("lb", POUND), ("slug", POUND_FORCE / (12.0 * INCH))]),
    ([0, 1, 0, 0], &[("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("µm", 1e-6), ("um", 1e-6)]),
    ([0, 1, 0, 0], &[("in", INCH), ("ft", 12.0 * INCH)]),
    ([0, 0, 1, 0], &[("s", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("us", 1e-6), ("min", 60.0), ("h", 3600.0)]),
    ([0, 0, -1, 0], &[("Hz", 1.0), ("kHz", 1e3)]),
    ([1, 1, -2, 0], &[("N", 1.0), ("kN", 1e3), ("MN", 1e6), ("kgf", GRAVITY), ("tf", 1e3 * GRAVITY)]),
    ([1, 1, -2, 0], &[("lbf", POUND_FORCE), ("kip", 1e3 * POUND_FORCE)]),
    ([1, -1, -2, 0], &[("Pa", 1.0), ("kPa", 1e3), ("MPa", 1e6), ("GPa", 1e9), ("bar", 1e5)]),
    ([1, -1, -2, 0], &[("psi", PSI), ("ksi", 1e3 * PSI)]),
    ([0, 3, 0, 0], &[("L", 1e-3), ("l", 1e-3), ("mL", 1e-6), ("gal", GALLON)]),
    ([0, 3, -1, 0], &[("gpm", GALLON / 60.0), ("lpm", 1e-3 / 60.0)]),
    ([0, 1, -2, 0], &[("g", GRAVITY)]),
    ([1, 2, -3, 0], &[("W", 1.0), ("kW", 1e3)]),
    ([0, 0, 0, 1], &[("V", 1.0), ("mV", 1e-3)]),
];

/// The SI value of a text with a number and a unit, if the unit has the dimension of `si`.
///
/// A unit is a product of powers: `kip/in`, `kN·s/m`, `m³/(s·Pa)`, `in^2`. A text without a unit is a pure number.
/// `None` if the text is not a quantity, a unit is unknown, or its dimension differs.
pub fn quantity(text: &str, si: &str) -> Option<f64> {
    let text = text.trim();
    // The longest prefix that is a number: "1e3 m" has an exponent, "1 e" has none.
    let (number, rest) =
        (1..=text.len()).rev().filter(|end| text.is_char_boundary(*end)).find_map(|end| {
            let (head, tail) = text.split_at(end);
            Some((head.trim().parse::<f64>().ok().filter(|number| number.is_finite())?, tail.trim()))
        })?;
    let (factor, dimension) = unit(rest)?;
    let (base, wanted) = unit(si)?;
    (dimension == wanted).then_some(number * factor / base)
}

/// A unit and the names of all units that convert to it, separated by commas.
pub fn units_of(si: &str) -> String {
    let wanted = unit(si).map(|(_, dimension)| dimension);
    let same = UNITS.iter().filter(|(dimension, _)| Some(*dimension) == wanted);
    let others = same.flat_map(|(_, units)| *units).map(|(name, _)| *name).filter(|name| *name != si);
    std::iter::once(si).chain(others).collect::<Vec<_>>().join(", ")
}

/// Exponents of kg, m, s and V of an SI unit such as `m³/(s·Pa)`; `None` if it is not a unit with factor 1.
pub fn dimension(si: &str) -> Option<[i8; 4]> {
    unit(si).filter(|(factor, _)| *factor == 1.0).map(|(_, dimension)| dimension)
}

/// A product of powers of units; an empty text is a pure number.
fn unit(text: &str) -> Option<Unit> {
    let text: Vec<char> = text.chars().collect();
    if text.is_empty() {
        return Some((1.0, NUMBER));
    }
    let (found, rest) = product(&text)?;
    rest.is_empty().then_some(found)
}

/// Factors up to the end or a closing bracket.
fn product(text: &[char]) -> Option<(Unit, &[char])> {
    let (mut found, mut rest) = factor(text)?;
    loop {
        let sign = match rest {
            [] | [')', ..] => return Some((found, rest)),
            ['/', ..] => -1,
            ['·' | '*' | '-' | ' ', ..] => 1,
            _ => return None,
        };
        let next;
        (next, rest) = factor(rest.get(1..)?)?;
        found = times(found, next, sign)?;
    }
}

/// A unit or a bracket, with its exponent.
fn factor(text: &[char]) -> Option<(Unit, &[char])> {
    let spaces = text.iter().take_while(|one| **one == ' ').count();
    let text = text.get(spaces..)?;
    let (base, rest) = if let ['(', inner @ ..] = text {
        match product(inner)? {
            (found, [')', rest @ ..]) => (found, rest),
            _ => return None,
        }
    } else {
        let letters = text.iter().take_while(|one| one.is_alphabetic() || **one == '%').count();
        // The numerator 1, as in 1/s, is the only number allowed as a unit.
        let length = if letters == 0 && text.first() == Some(&'1') { 1 } else { letters };
        let name: String = text.get(..length)?.iter().collect();
        let known = |(dimension, units): &(Dimension, &[(&str, f64)])| {
            units.iter().find(|(known, _)| *known == name).map(|(_, factor)| (*factor, *dimension))
        };
        (UNITS.iter().find_map(known)?, text.get(length..)?)
    };
    let (exponent, rest) = match rest {
        ['²', rest @ ..] | ['^', '2', rest @ ..] | ['2', rest @ ..] => (2, rest),
        ['³', rest @ ..] | ['^', '3', rest @ ..] | ['3', rest @ ..] => (3, rest),
        rest => (1, rest),
    };
    let spaces = rest.iter().take_while(|one| **one == ' ').count();
    // A space before a sign belongs to the sign; a space between two units multiplies.
    let rest = match rest.get(spaces..)? {
        tight @ ([] | ['/' | '·' | '*' | '-' | ')', ..]) => tight,
        _ => rest,
    };
    times((1.0, NUMBER), base, exponent).map(|found| (found, rest))
}

/// `left · rightᵉ`.
fn times(left: Unit, right: Unit, exponent: i8) -> Option<Unit> {
    let mut dimension = left.1;
    for (sum, part) in dimension.iter_mut().zip(right.1) {
        *sum = sum.checked_add(part.checked_mul(exponent)?)?;
    }
    let factor: f64 = (0..exponent.unsigned_abs()).map(|_| right.0).product();
    Some((if exponent < 0 { left.0 / factor } else { left.0 * factor }, dimension))
}

#[cfg(test)]
mod tests {
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
        ] {
            assert_eq!(quantity(text, si), None, "{text}");
        }
    }

    #[test]
    fn a_unit_is_the_first_of_those_that_convert_to_it() {
        assert_eq!(units_of("kg"), "kg, t, tonne, lb, slug");
        assert_eq!(units_of("1/h"), "1/h, Hz, kHz");
        assert_eq!(units_of("m³/s"), "m³/s, gpm, lpm");
        assert_eq!(units_of("N/m"), "N/m");
    }

    #[test]
    fn every_unit_of_the_schema_is_known() {
        for row in KEYS.iter().filter(|row| !["bits", "samples"].contains(&row.unit)) {
            assert!(unit(row.unit).is_some(), "{}: {}", row.key, row.unit);
        }
    }
}
