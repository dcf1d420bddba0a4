//! Values with their unit, such as `"12 t"`, `"15 gpm"` or `"3.96 kip/in"`: one table of units for rigs, data sheets,
//! records and files of measurements.

mod grammar;
mod table;
#[cfg(test)]
mod tests;

use grammar::unit;
pub use table::STANDARD_GRAVITY;
use table::{MEASURED, OFFERED, units};

/// Bytes of the longest number with a unit. The time for a text grows with the square of its length.
const LONGEST: usize = 100;

/// The SI value of a text with a number and a unit, if the unit has the dimension of `si`.
///
/// A text without a unit is a pure number. `None` if the text is not a quantity, or as for [`factor`].
pub fn quantity(text: &str, si: &str) -> Option<f64> {
    let text = text.trim();
    if text.len() > LONGEST {
        return None;
    }
    // The longest prefix that is a number: "1e3 m" has an exponent, "1 e" has none.
    let (number, rest) =
        (1..=text.len()).rev().filter(|end| text.is_char_boundary(*end)).find_map(|end| {
            let (head, tail) = text.split_at(end);
            Some((head.trim().parse::<f64>().ok().filter(|number| number.is_finite())?, tail))
        })?;
    Some(number * factor(rest, si)?)
}

/// One of a unit in the unit `si` of the same dimension.
///
/// A unit is a product of powers, such as `kip/in`, `kN·s/m`, `m³/(s·Pa)`, `in^2`, `sq in` or `mps2`. A name is
/// taken as it is written, else in any letter case if that leaves one meaning. `None` if a unit is unknown, or the
/// dimension differs.
pub fn factor(text: &str, si: &str) -> Option<f64> {
    let (base, wanted) = unit(si)?;
    // `ms-2` is also 1/ms², so the dimension decides.
    let found = |text: &str| unit(text).filter(|(_, dimension)| *dimension == wanted);
    let (factor, _) = found(text).or_else(|| found(&spelled_out(text)?))?;
    Some(factor / base)
}

/// The same for a column of measurements, where `lb` is a force and `gal` is 1 cm/s² in any letter case.
pub fn factor_of_column(text: &str, si: &str) -> Option<f64> {
    let meant = || {
        let name = text.trim_matches(['(', ')', '[', ']', '.', ' ']).to_ascii_lowercase();
        MEASURED.iter().find(|(known, _)| *known == name).and_then(|(_, meant)| factor(meant, si))
    };
    factor(text, si).or_else(meant)
}

/// The units of the dimension of `si`, separated by commas, with exponents as in `si`, which is the first.
pub fn units_of(si: &str) -> String {
    let wanted = unit(si).map(|(_, dimension)| dimension);
    let names = units().filter_map(|(names, _)| names.split(' ').next());
    let same = names.chain(OFFERED.split(", ")).filter(|name| unit(name).map(|(_, found)| found) == wanted);
    let raised = si.contains(['²', '³']);
    let written = |name: &str| if raised { name.into() } else { name.replace('²', "2").replace('³', "3") };
    let others = same.map(written).filter(|name| name != si);
    std::iter::once(si.into()).chain(others).collect::<Vec<_>>().join(", ")
}

/// Exponents of kg, m, s and V of an SI unit such as `m³/(s·Pa)`; `None` if it is not a unit with factor 1.
pub fn dimension(si: &str) -> Option<[i8; 4]> {
    unit(si).filter(|(factor, _)| *factor == 1.0).map(|(_, dimension)| dimension)
}

/// `m/s2` of `mps2`, `ms2` or `ms-2`, and the same of other lengths.
fn spelled_out(text: &str) -> Option<String> {
    let mut plain = text.to_ascii_lowercase().replace('²', "2").replace('⁻', "-");
    plain.retain(|c| c.is_ascii_alphanumeric() || c == '-');
    ["m", "cm", "mm", "in", "ft", "m3"].iter().find_map(|length| {
        let power = match plain.strip_prefix(length)? {
            "ps" | "s-1" => "",
            "ps2" | "s2" | "s-2" => "2",
            _ => return None,
        };
        Some(format!("{length}/s{power}"))
    })
}
