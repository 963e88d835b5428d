//! Tables `[extension.NAME]` of a case file.

use toml::{Table, Value};

/// Joins the tables `[extension.NAME]` of the same name, in the order of their first occurrence. A key that several of
/// them have gets the list of its values, in the order of the tables.
pub(crate) fn joined<'a>(parts: impl IntoIterator<Item = (&'a str, &'a Table)>) -> Vec<(String, Table)> {
    let mut all: Vec<(String, Table)> = Vec::new();
    for (name, table) in parts {
        match all.iter_mut().find(|(known, _)| known == name) {
            None => all.push((name.to_owned(), table.clone())),
            Some((_, known)) => {
                for (key, value) in table {
                    match known.get_mut(key) {
                        Some(Value::Array(list)) => list.push(value.clone()),
                        Some(one) => *one = Value::Array(vec![one.clone(), value.clone()]),
                        None => {
                            known.insert(key.clone(), value.clone());
                        }
                    }
                }
            }
        }
    }
    all
}
