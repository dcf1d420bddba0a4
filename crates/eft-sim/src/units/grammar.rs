//! The grammar of units: a product of powers, such as `kip/in`, `m³/(s·Pa)`, `sq in` or `m s-2`.

use super::table::{CASED, NUMBER, Unit, units};

/// Characters of the longest unit.
const LONGEST: usize = 40;

/// Signs that may be written in another way, and that way.
#[rustfmt::skip]
const SAME: [(&str, &str); 10] = [
    ("'s", "s"), ("**", ""), ("^", ""), ("⁻", "-"), ("¹", "1"), ("²", "2"), ("³", "3"), ("μ", "µ"), ("[", "("), ("]", ")"),
];
const EXPONENTS: [(&str, i8); 6] = [("-1", -1), ("-2", -2), ("-3", -3), ("1", 1), ("2", 2), ("3", 3)];
const BLANKS: [char; 2] = [' ', '_'];

/// A product of powers of units; an empty text and `-` are a pure number.
pub(super) fn unit(text: &str) -> Option<Unit> {
    if text.chars().count() > LONGEST {
        return None;
    }
    let plain = SAME.iter().fold(text.to_owned(), |text, (sign, same)| text.replace(sign, same));
    let plain = plain.trim();
    if plain.is_empty() || plain == "-" {
        return Some((1.0, NUMBER));
    }
    let (found, rest) = product(plain)?;
    rest.is_empty().then_some(found)
}

/// Powers up to the end or a closing bracket, and the rest.
fn product(text: &str) -> Option<(Unit, &str)> {
    let (mut found, mut rest) = power(text)?;
    while !rest.is_empty() && !rest.starts_with(')') {
        let mut signs = rest.chars();
        let exponent = match signs.next()? {
            '/' => -1,
            '·' | '*' | '.' | '-' | ' ' | '_' => 1,
            _ => return None,
        };
        let next;
        (next, rest) = power(signs.as_str())?;
        found = times(found, next, exponent)?;
    }
    Some((found, rest))
}

/// A unit or a bracket with its exponent, and the rest.
fn power(text: &str) -> Option<(Unit, &str)> {
    let text = text.trim_start_matches(BLANKS);
    let (first, after) = word(text);
    let prefix = match first.to_ascii_lowercase().as_str() {
        "sq" | "square" => 2,
        "cu" | "cubic" => 3,
        _ => 1,
    };
    let text =
        if prefix == 1 { text } else { after.strip_prefix('.').unwrap_or(after).trim_start_matches(BLANKS) };
    // The numerator of 1/s is the only number allowed as a unit, and has no exponent.
    if let Some(rest) = text.strip_prefix('1') {
        return Some(((1.0, NUMBER), rest.trim_start_matches(BLANKS)));
    }
    let (base, rest) = if let Some(inner) = text.strip_prefix('(') {
        let (base, rest) = product(inner)?;
        (base, rest.strip_prefix(')')?)
    } else {
        let (name, rest) = word(text);
        (named(name)?, rest)
    };
    let exponents = EXPONENTS.iter().find_map(|(sign, exponent)| Some((*exponent, rest.strip_prefix(sign)?)));
    let (exponent, rest) = exponents.unwrap_or((1, rest));
    // A point may end an abbreviation, as in `sq. in.`.
    let ended = rest.strip_prefix('.').filter(|tail| !tail.starts_with(|c: char| c.is_ascii_alphabetic()));
    let rest = ended.unwrap_or(rest);
    // A blank before a sign belongs to the sign; a blank between two units multiplies.
    let tight = rest.trim_start_matches(BLANKS);
    let rest = if tight.is_empty() || tight.starts_with(['/', '·', '*', '-', ')']) {
        tight
    } else if text.starts_with('%') {
        // A percentage of a unit is not a unit.
        return None;
    } else {
        rest
    };
    Some((times((1.0, NUMBER), base, prefix * exponent)?, rest))
}

/// The letters at the beginning, and the rest.
fn word(text: &str) -> (&str, &str) {
    let is_letter = |c: char| c.is_ascii_alphabetic() || matches!(c, 'µ' | '%');
    text.split_at(text.find(|c| !is_letter(c)).unwrap_or(text.len()))
}

/// The unit of a name: as written, else in any letter case that changes no meaning, else as a plural of a word.
fn named(name: &str) -> Option<Unit> {
    let lower = name.to_ascii_lowercase();
    let any_case = |known: &str| known.eq_ignore_ascii_case(name) && !CASED.contains(&lower.as_str());
    let singular = lower.strip_suffix('s').filter(|word| word.len() > 2);
    let find =
        |is: &dyn Fn(&str) -> bool| units().find(|(names, _)| names.split(' ').any(is)).map(|(_, unit)| unit);
    find(&|known| known == name)
        .or_else(|| find(&any_case))
        .or_else(|| find(&|known| Some(known) == singular))
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
