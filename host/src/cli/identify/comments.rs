//! Comments of a case file that is written anew: [`kept`] states which of them stay.

use toml_edit::{DocumentMut, Item, Table};

/// Text of a case file with the values of `after`, and with the comments, the order and the blank lines of `before`,
/// the text that it replaces.
///
/// Sections and keys that `after` lacks are removed with their comments; comments within arrays are lost, and within the
/// tables of an array (`[[structure.mode]]`) if their number changes. The result is `after` itself if `before` has no `#`, if one of the
/// texts is not TOML, or if the keys and values of the merged text would differ from those of `after`.
pub(super) fn kept(before: &str, after: &str) -> String {
    let has_comment = before.lines().any(|line| line.contains('#'));
    let (Ok(mut case), Ok(values)) = (before.parse::<DocumentMut>(), after.parse::<DocumentMut>()) else {
        return after.into();
    };
    if !has_comment {
        return after.into();
    }
    merge(case.as_table_mut(), values.as_table());
    let merged = case.to_string();
    // The merged text is used only if its keys and values are exactly those of `after`.
    let same = |text: &str| text.parse::<toml::Table>().ok();
    if same(&merged) == same(after) {
        merged
    } else {
        after.into()
    }
}

/// Gives `table` the keys and values of `values`. Comments of keys that stay are kept, with the exceptions in [`kept`].
fn merge(table: &mut Table, values: &Table) {
    let gone: Vec<String> = table
        .iter()
        .map(|(key, _)| key.to_owned())
        .filter(|key| !values.contains_key(key))
        .collect();
    for key in gone {
        table.remove(&key);
    }
    for (key, value) in values.iter() {
        match (table.get_mut(key), value) {
            (Some(Item::Table(inner)), Item::Table(new)) => merge(inner, new),
            (Some(Item::ArrayOfTables(old)), Item::ArrayOfTables(new)) if old.len() == new.len() => {
                for (inner, new) in old.iter_mut().zip(new.iter()) {
                    merge(inner, new);
                }
            }
            (Some(Item::Value(old)), Item::Value(new)) => {
                let decor = old.decor().clone();
                *old = new.clone();
                *old.decor_mut() = decor;
            }
            (Some(old), new) => *old = new.clone(),
            (None, new) => {
                table.insert(key, new.clone());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_stay_with_their_keys_and_sections() {
        let before = "# My mill.\nname = \"old\" # the big one\n\n# Four teeth.\n[tool]\nteeth = 4\nedge_angle_deg = 90.0 # square\n";
        let after = "name = \"new\"\n\n[structure]\nkind = \"modes\"\n\n[[structure.mode]]\nfrequency_hz = 17.0\n\n[tool]\nteeth = 4\nedge_angle_deg = 45.0\n";
        let text = kept(before, after);
        for words in [
            "# My mill.",
            "# the big one",
            "# Four teeth.",
            "45.0 # square",
            "\"new\"",
            "frequency_hz = 17.0",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
        let table = |text: &str| text.parse::<toml::Table>().unwrap();
        assert_eq!(table(&text), table(after));
        let before = "[structure]\n# Bending.\n[[structure.mode]]\nfrequency_hz = 17.0 # of the spindle\n[[structure.mode]]\nfrequency_hz = 30.0 # of the arm\n";
        let modes = |one: f64, two: f64| {
            format!(
                "[[structure.mode]]\nfrequency_hz = {one:?}\n[[structure.mode]]\nfrequency_hz = {two:?}\n"
            )
        };
        let text = kept(before, &modes(16.5, 31.0));
        for words in ["# Bending.", "16.5 # of the spindle", "31.0 # of the arm"] {
            assert!(text.contains(words), "{words}: {text}");
        }
        assert_eq!(kept("name = \"old\"\n", after), after);
        assert_eq!(kept("name = [ # no TOML\n", after), after);
    }
}
