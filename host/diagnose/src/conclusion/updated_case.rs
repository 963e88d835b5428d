//! The text of a case with its uncertain parameters after the records.

use nalgebra::DMatrix;
use toml_edit::{Array, DocumentMut, Item, Table, Value};

use crate::conclusion::updates::Posterior;

/// `text`, the text of a case, with the values of `posterior`, and with its covariance in `[uncertainty]` in place of the
/// deviations that the text states. Comments stay. `None` if the text lacks a parameter.
pub(crate) fn updated(text: &str, posterior: &Posterior) -> Option<String> {
    let mut case: DocumentMut = text.parse().ok()?;
    let names: Vec<String> = posterior
        .parameters()
        .iter()
        .map(|parameter| parameter.name())
        .collect();
    for (name, value) in names.iter().zip(posterior.values().iter()) {
        let path: Vec<&str> = name.split('.').collect();
        set(case.as_item_mut(), &path, *value)?;
        remove_deviation(case.as_item_mut(), &path);
    }
    let mut parameters = Array::from_iter(names.iter().map(String::as_str));
    on_lines(&mut parameters);
    let mut table = Table::new();
    table.insert("parameters", toml_edit::value(parameters));
    table.insert("covariance", toml_edit::value(rows(posterior.covariance())));
    case.insert("uncertainty", Item::Table(table));
    Some(case.to_string())
}

fn rows(matrix: &DMatrix<f64>) -> Array {
    let row = |row: usize| {
        Value::from(Array::from_iter(
            (0..matrix.ncols()).map(|column| matrix[(row, column)]),
        ))
    };
    let mut rows = Array::from_iter((0..matrix.nrows()).map(row));
    on_lines(&mut rows);
    rows
}

/// Puts each entry on a line of its own.
fn on_lines(array: &mut Array) {
    for entry in array.iter_mut() {
        entry.decor_mut().set_prefix("\n    ");
    }
    array.set_trailing_comma(true);
    array.set_trailing("\n");
}

/// Index from 0 of a part of a name that counts from 1, or that names the part of a complex number.
fn index_of(part: &str) -> Option<usize> {
    match part {
        "real" => Some(0),
        "imaginary" => Some(1),
        number => number.parse::<usize>().ok()?.checked_sub(1),
    }
}

/// Sets the number at the path of a parameter's name.
fn set(item: &mut Item, path: &[&str], number: f64) -> Option<()> {
    let (part, rest) = path.split_first()?;
    match item {
        Item::ArrayOfTables(tables) => {
            let table = tables.get_mut(index_of(part)?)?;
            let (key, rest) = rest.split_first()?;
            set_in(table.get_mut(key)?, rest, number)
        }
        _ => {
            let table = item.as_table_like_mut()?;
            if rest.is_empty() && !table.contains_key(part) {
                table.insert(part, toml_edit::value(number));
                return Some(());
            }
            set_in(table.get_mut(part)?, rest, number)
        }
    }
}

fn set_in(item: &mut Item, path: &[&str], number: f64) -> Option<()> {
    match item {
        Item::Value(value) => set_value(value, path, number),
        other => set(other, path, number),
    }
}

fn set_value(value: &mut Value, path: &[&str], number: f64) -> Option<()> {
    let Some((part, rest)) = path.split_first() else {
        let decor = value.decor().clone();
        *value = Value::from(number);
        *value.decor_mut() = decor;
        return Some(());
    };
    let inner = match value {
        Value::Array(array) => array.get_mut(index_of(part)?)?,
        Value::InlineTable(table) => table.get_mut(part)?,
        _ => return None,
    };
    set_value(inner, rest, number)
}

/// Removes the key that ends in `_std` beside the parameter, if there is one.
fn remove_deviation(item: &mut Item, path: &[&str]) {
    let Some((part, rest)) = path.split_first() else {
        return;
    };
    if let Item::ArrayOfTables(tables) = item {
        if let (Some(table), Some((key, _))) = (
            index_of(part).and_then(|index| tables.get_mut(index)),
            rest.split_first(),
        ) {
            table.remove(&format!("{key}_std"));
        }
        return;
    }
    let Some(table) = item.as_table_like_mut() else {
        return;
    };
    table.remove(&format!("{part}_std"));
    if let Some(inner) = table.get_mut(part) {
        remove_deviation(inner, rest);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use nalgebra::DVector;

    use super::*;
    use quietcut_model::case::Case;
    use quietcut_stability::Variable;

    /// Modes with complex shapes in an array of tables, and an own key for each deviation.
    const MODES: &str = r#"
# My robot.
[structure]
kind = "modes"
directions = ["x"]

[[structure.mode]]
frequency_hz = 17.0 # the first
frequency_hz_std = 0.2
damping_ratio = 0.02
left = [[0.1, 0.0]]
right = [[0.1, 0.01]]
right_std = [[0.005, 0.001]]

[material]
ktc_mpa = 700.0
krc_mpa = 200.0
kac_mpa = 0.0
kte_n_per_mm = 0.0
kre_n_per_mm = 0.0
kae_n_per_mm = 0.0
ktc_mpa_std = 20.0
"#;

    #[test]
    fn the_text_reads_as_the_moved_case_with_the_covariance_after_the_records() {
        let case = Case::parse(Path::new("case.toml"), MODES).unwrap();
        let variables = Variable::of_case(&case);
        let count = variables.len();
        assert_eq!(count, 4);
        let z = DVector::from_fn(count, |index, _| 0.5 - 0.3 * index as f64);
        let covariance = DMatrix::from_fn(count, count, |i, j| if i == j { 0.3 } else { 0.05 });
        let posterior = Posterior::new(&case, &variables, &z, &covariance).unwrap();
        let text = updated(MODES, &posterior).unwrap();
        let read = Case::parse(Path::new("case.toml"), &text).unwrap();
        let mut moved = case.clone();
        assert!(posterior.shift(&mut moved));
        for parameter in quietcut_model::case::Parameter::of_case(&case) {
            assert_eq!(
                parameter.value(&read),
                parameter.value(&moved),
                "{}",
                parameter.name()
            );
        }
        assert!(read.deviations.is_empty());
        let known = read.covariance.unwrap();
        assert_eq!(known.parameters, posterior.parameters());
        assert_eq!(&known.covariance, posterior.covariance());
        assert!(
            text.contains("# My robot.") && text.contains("# the first"),
            "{text}"
        );
        // A second update takes the place of the first.
        let again = updated(&text, &posterior).unwrap();
        assert_eq!(again, text);
    }

    #[test]
    fn entries_of_matrices_are_found() {
        let matrices = "[structure]\nkind = \"matrices\"\ndirections = [\"x\", \"y\"]\nmass = [[1.0, 0.0], [0.0, 2.0]]\n\
            damping = [[1.0, 0.0], [0.0, 1.0]]\nstiffness = [[1e4, 10.0], [10.0, 1e4]]\nstiffness_std = [[100.0, 5.0], [5.0, 0.0]]\n";
        let case = Case::parse(Path::new("case.toml"), matrices).unwrap();
        let variables = Variable::of_case(&case);
        let z = DVector::from_element(variables.len(), 1.0);
        let covariance = DMatrix::identity(variables.len(), variables.len());
        let posterior = Posterior::new(&case, &variables, &z, &covariance).unwrap();
        let read = Case::parse(Path::new("case.toml"), &updated(matrices, &posterior).unwrap()).unwrap();
        let mut moved = case.clone();
        assert!(posterior.shift(&mut moved));
        assert_eq!(read.structure, moved.structure);
    }
}
