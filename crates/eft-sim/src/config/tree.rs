//! Dotted keys over a tree of sections.

use std::collections::HashMap;
use std::sync::LazyLock;

use toml::{Table, Value};

use super::KEYS;
use super::schema::Key;
use crate::{Error, Result};

/// The section for values of the true plant that differ from the controller's.
pub(super) const TRUTH: &str = "truth";

/// The value at a dotted key.
pub(super) fn get<'a>(tree: &'a Table, key: &str) -> Option<&'a Value> {
    let mut parts = key.split('.');
    let mut value = tree.get(parts.next()?)?;
    for part in parts {
        value = value.as_table()?.get(part)?;
    }
    Some(value)
}

/// Most parts of a dotted key. Those of the schema have fewer. A deeper tree would take quadratic time and memory, and
/// too much stack.
const MOST_PARTS: usize = 32;

/// Sets the value of a dotted key and adds missing sections. It does not check that the schema has the key, but refuses
/// one of very many parts.
pub(super) fn set(tree: &mut Table, key: &str, value: Value) -> Result<()> {
    if key.split('.').nth(MOST_PARTS).is_some() {
        return Err(unknown(key));
    }
    let mut section = tree;
    let (path, leaf) = key.rsplit_once('.').map_or((None, key), |(path, leaf)| (Some(path), leaf));
    for part in path.into_iter().flat_map(|path| path.split('.')) {
        let next = section.entry(part).or_insert_with(|| Value::Table(Table::new()));
        section = match next {
            Value::Table(table) => table,
            other => {
                check_known(key)?;
                return Err(Error::value(part, other.to_string(), "must be a section"));
            }
        };
    }
    section.insert(leaf.to_owned(), value);
    Ok(())
}

/// Removes the value or section of a dotted key.
pub(super) fn remove(tree: &mut Table, key: &str) -> Result<()> {
    check_known(key)?;
    let mut section = tree;
    let (path, leaf) = key.rsplit_once('.').unwrap_or(("", key));
    for part in path.split('.').filter(|part| !part.is_empty()) {
        match section.get_mut(part).and_then(Value::as_table_mut) {
            Some(next) => section = next,
            None => return Ok(()),
        }
    }
    section.remove(leaf);
    Ok(())
}

/// Every dotted key below a tree with its value; an empty section counts as one.
pub(super) fn leaves(tree: &Table) -> Vec<(String, &Value)> {
    fn walk<'a>(prefix: &str, tree: &'a Table, found: &mut Vec<(String, &'a Value)>) {
        for (name, value) in tree {
            let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
            match value {
                // A table in the place of a value is kept whole, so that the error names it.
                Value::Table(inner) if !inner.is_empty() && !is_leaf(&key) => walk(&key, inner, found),
                _ => found.push((key, value)),
            }
        }
    }
    let mut found = Vec::new();
    walk("", tree, &mut found);
    found
}

/// The row of a key in the schema; a key under `truth` has the row of the plant's key.
pub(super) fn row(key: &str) -> Option<&'static Key> {
    // A map is faster, because studies check thousands of rigs of a hundred keys each.
    static ROWS: LazyLock<HashMap<&str, &Key>> =
        LazyLock::new(|| KEYS.iter().map(|row| (row.key, row)).collect());
    let row = |key| ROWS.get(key).copied();
    match under_truth(key) {
        Some(key) => row(key).filter(|row| row.is_of_the_plant()),
        None => row(key),
    }
}

/// The part of a key after `truth.`, if it begins with that.
pub(super) fn under_truth(key: &str) -> Option<&str> {
    key.strip_prefix(TRUTH)?.strip_prefix('.')
}

/// Whether the schema has a value of this key.
pub(super) fn is_leaf(key: &str) -> bool {
    row(key).is_some()
}

/// Whether the schema has a section of this name.
pub(super) fn is_section(key: &str) -> bool {
    let section = under_truth(key).unwrap_or(key);
    let begins = |row: &Key| row.key.strip_prefix(section).is_some_and(|rest| rest.starts_with('.'));
    key == TRUTH || KEYS.iter().any(|row| begins(row) && (section == key || row.is_of_the_plant()))
}

/// Refuses a key outside the schema.
pub(super) fn check_known(key: &str) -> Result<()> {
    if is_leaf(key) || is_section(key) { Ok(()) } else { Err(unknown(key)) }
}

/// The error for a key outside the schema, with the nearest known key.
pub(super) fn unknown(key: &str) -> Error {
    fn last(key: &str) -> &str {
        key.rsplit('.').next().unwrap_or(key)
    }
    // The last name is compared in all sections, because a correct name in a wrong section is a common
    // mistake. The section decides between equal distances.
    let of_the_plant = KEYS.iter().filter(|row| row.is_of_the_plant());
    let true_keys = of_the_plant.map(|row| format!("{TRUTH}.{}", row.key));
    let nearest = KEYS
        .iter()
        .map(|row| row.key.to_owned())
        .filter(|_| under_truth(key).is_none())
        .chain(true_keys)
        // The time for a distance is proportional to the length of the key.
        .filter(|known| key.len() <= 4 * known.len())
        .map(|known| {
            let name = strsim::normalized_damerau_levenshtein(last(key), last(&known));
            let whole = strsim::normalized_damerau_levenshtein(key, &known);
            (name, name + 0.2 * whole, known)
        })
        .filter(|(name, ..)| *name >= 0.6)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(.., known)| known);
    Error::UnknownKey { key: shortened(key), nearest }
}

/// A text for a message, shortened if it is long.
pub(super) fn shortened(text: &str) -> String {
    match text.char_indices().nth(80) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
