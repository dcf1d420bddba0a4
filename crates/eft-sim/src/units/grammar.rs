//! The grammar of units: a product of powers, such as `kip/in`, `m³/(s·Pa)`, `sq in` or `m s-2`.

use super::table::{CASED, NUMBER, Unit, units};

/// Characters of the longest unit.
const LONGEST: usize = 40;

/// A product of powers of units; an empty text and `-` are a pure number.
pub(super) fn unit(text: &str) -> Option<Unit> {
    if text.chars().count() > LONGEST {
        return None;
    }
    let plain = text.replace("'s", "s").replace("**", "").replace('^', "");
    const OTHER: [char; 8] = ['⁻', '¹', '²', '³', 'μ', '[', ']', '_'];
    const SAME: [char; 8] = ['-', '1', '2', '3', 'µ', '(', ')', ' '];
    let sign = |c| OTHER.iter().position(|other| *other == c).map_or(c, |at| SAME[at]);
    let text: Vec<char> = plain.trim().chars().map(sign).collect();
    if matches!(text.as_slice(), [] | ['-']) {
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
            ['·' | '*' | '.' | '-' | ' ', ..] => 1,
            _ => return None,
        };
        let next;
        (next, rest) = factor(rest.get(1..)?)?;
        found = times(found, next, sign)?;
    }
}

/// A unit or a bracket, with its exponent.
fn factor(text: &[char]) -> Option<(Unit, &[char])> {
    let text = after_blanks(text);
    let (head, tail) = word(text);
    let tail = after_blanks(tail.strip_prefix(&['.']).unwrap_or(tail));
    let (power, text) = match head.to_ascii_lowercase().as_str() {
        "sq" | "square" => (2, tail),
        "cu" | "cubic" => (3, tail),
        _ => (1, text),
    };
    let (base, rest) = match text {
        ['(', inner @ ..] => match product(inner)? {
            (found, [')', rest @ ..]) => (found, rest),
            _ => return None,
        },
        // The numerator of 1/s is the only number allowed as a unit, and has no exponent.
        ['1', rest @ ..] => return Some(((1.0, NUMBER), after_blanks(rest))),
        _ => {
            let (name, rest) = word(text);
            (named(&name)?, rest)
        }
    };
    let (exponent, rest) = match rest {
        ['-', digit @ '1'..='3', rest @ ..] => (-(*digit as i8 - '0' as i8), rest),
        [digit @ '1'..='3', rest @ ..] => (*digit as i8 - '0' as i8, rest),
        rest => (1, rest),
    };
    // A point may end an abbreviation, as in `sq. in.`.
    let rest = match rest {
        ['.', tail @ ..] if !tail.first().is_some_and(|next| next.is_ascii_alphabetic()) => tail,
        rest => rest,
    };
    // A blank before a sign belongs to the sign; a blank between two units multiplies.
    let rest = match after_blanks(rest) {
        tight @ ([] | ['/' | '·' | '*' | '-' | ')', ..]) => tight,
        // A percentage of a unit is not a unit.
        _ if text.first() == Some(&'%') => return None,
        _ => rest,
    };
    times((1.0, NUMBER), base, power * exponent).map(|found| (found, rest))
}

fn after_blanks(text: &[char]) -> &[char] {
    &text[text.iter().take_while(|one| **one == ' ').count()..]
}

/// The letters at the beginning, and the rest.
fn word(text: &[char]) -> (String, &[char]) {
    let length = text.iter().take_while(|one| one.is_ascii_alphabetic() || matches!(one, 'µ' | '%')).count();
    (text[..length].iter().collect(), &text[length..])
}

/// The unit of a name: as written, else in any letter case if only one unit is meant, else as a plural of a word.
fn named(name: &str) -> Option<Unit> {
    let lower = name.to_ascii_lowercase();
    let of = |is: &dyn Fn(&str) -> bool| {
        let mut found = units().filter(|(names, _)| names.split(' ').any(is)).map(|(_, unit)| unit);
        found.next().filter(|_| found.next().is_none())
    };
    let singular = lower.strip_suffix('s').filter(|word| word.len() > 2);
    of(&|known| known == name)
        .or_else(|| {
            of(&|known| known.to_ascii_lowercase() == lower).filter(|_| !CASED.contains(&lower.as_str()))
        })
        .or_else(|| of(&|known| Some(known) == singular))
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
