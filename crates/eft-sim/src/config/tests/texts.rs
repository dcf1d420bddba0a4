//! Rigs as TOML and as files.

use proptest::prelude::*;

use super::*;

#[test]
fn toml_keeps_every_optional_part() {
    let config = RigConfig::from_tree(everything()).unwrap();
    assert_eq!(RigConfig::from_toml(&config.to_toml()).unwrap(), config);
    assert_eq!(RigConfig::from_toml(&config.to_commented_toml()).unwrap(), config);
}

#[test]
fn commented_toml_names_every_key() {
    let text = RigConfig::zhao2005().to_commented_toml();
    assert_eq!(RigConfig::from_toml(&text).unwrap(), RigConfig::zhao2005());
    for row in KEYS.iter() {
        assert!(text.contains(row.doc), "{}", row.key);
    }
}

#[test]
fn files_that_cannot_be_read() {
    let folder = std::env::temp_dir().join(format!("eft-config-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("rig.toml");
    assert!(matches!(RigConfig::read(&path), Err(Error::Io { path: named, .. }) if named == path));
    std::fs::write(&path, [b'a', 0xff]).unwrap();
    assert!(message(RigConfig::read(&path)).ends_with("rig.toml: not UTF-8 text at byte 1"));
    std::fs::write(&path, "a = [").unwrap();
    assert!(message(RigConfig::read(&path)).contains("rig.toml: line 1, column 6"));
    std::fs::write(&path, vec![b'#'; 2 << 20]).unwrap();
    assert!(message(RigConfig::read(&path)).contains("larger than 1 MiB"));
    std::fs::write(&path, RigConfig::zhao2005().to_toml()).unwrap();
    assert_eq!(RigConfig::read(&path).unwrap(), RigConfig::zhao2005());
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A key with a value; half of the keys of the plant are under `truth`.
fn any_row() -> impl Strategy<Value = (String, Value)> {
    (0..KEYS.len(), 0.0..=1.0_f64, any::<u64>(), ".*", any::<bool>()).prop_map(
        |(row, share, bits, text, truth)| {
            let row = &KEYS[row];
            let value = match row.kind {
                // Distributed evenly over the decades of the range.
                Kind::Float(low, high) if low > 0.0 => {
                    Value::Float((low * (high / low).powf(share)).clamp(low, high))
                }
                Kind::Float(low, high) => Value::Float((low + share * (high - low)).clamp(low, high)),
                Kind::Int(low, high) => {
                    Value::Integer(low + (bits % (high - low).unsigned_abs().max(1)) as i64)
                }
                Kind::Bool => Value::Boolean(bits % 2 == 0),
                Kind::Choice(words) => Value::String(words[bits as usize % words.len()].into()),
                Kind::Text => Value::String(text),
                Kind::Floats(..) => tree::get(&everything(), row.key).unwrap().clone(),
            };
            // Two values that must agree with others.
            let bound = row.key == "structure.kind" || row.key.starts_with("servovalve.flow_table");
            let truth = if truth && row.is_of_the_plant() && !bound { "truth." } else { "" };
            (format!("{truth}{}", row.key), value)
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn to_toml_then_from_toml_is_the_identity(changes in prop::collection::vec(any_row(), 0..60)) {
        let mut whole = everything();
        for (key, value) in changes {
            tree::set(&mut whole, &key, value).unwrap();
        }
        let config = match RigConfig::from_tree(whole) {
            // For some rigs no robust force loop exists.
            Err(error) if error.to_string().contains("robust") => return Ok(()),
            made => made.unwrap(),
        };
        prop_assert_eq!(&RigConfig::from_toml(&config.to_toml()).unwrap(), &config);
        prop_assert_eq!(&RigConfig::from_toml(&config.to_commented_toml()).unwrap(), &config);
        prop_assert_eq!(&RigConfig::from_tree(config.to_tree()).unwrap(), &config);
    }

    #[test]
    fn no_text_panics(text in ".{0,200}") {
        let _ = RigConfig::from_toml(&text);
    }

    #[test]
    fn no_damaged_file_panics(start in 0usize..3000, length in 0usize..40, insert in ".{0,10}") {
        let text = RigConfig::zhao2005().to_toml();
        let cut = |at: usize| (0..=at.min(text.len())).rev().find(|at| text.is_char_boundary(*at)).unwrap();
        let (from, to) = (cut(start), cut(start + length));
        let _ = RigConfig::from_toml(&format!("{}{insert}{}", &text[..from], &text[to..]));
    }
}
