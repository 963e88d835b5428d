//! What was identified, as the text of a case file.

use nalgebra::DMatrix;
use toml::{Table, Value};

use crate::structure::Direction;

/// One identified parameter with its interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Its key: `mass_kg`, `k3_n_per_m3` …
    pub key: &'static str,
    /// The directions that it belongs to: one, or two for an entry off the diagonal and for a coupling.
    pub directions: Vec<Direction>,
    /// Its value, SI.
    pub value: f64,
    /// Its standard deviation.
    pub deviation: f64,
}

/// An identified model that no case file can hold.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CaseFileError {
    /// A matrix is missing.
    #[error("a case needs {0}, which this method does not give")]
    Missing(&'static str),
    /// The same extension in two directions.
    #[error(
        "[extension.{0}] is needed in two directions; a case holds one: identify the directions one by one"
    )]
    Twice(&'static str),
}

/// The extension that holds a key.
fn extension_of(key: &str) -> Option<&'static str> {
    Some(match key {
        "k2_n_per_m2" => "quadratic-stiffness",
        "k5_n_per_m5" => "softening-hardening",
        "fc_n" => "coulomb-friction",
        "kxyy_n_per_m3" | "kxxy_n_per_m2" => "mode-coupling",
        _ => return None,
    })
}

/// The text of a case with mass, damping, stiffness and cubic terms as matrices, and everything else as extensions.
///
/// # Errors
/// No mass, or two of one extension.
pub fn text(name: &str, directions: &[Direction], estimates: &[Estimate]) -> Result<String, CaseFileError> {
    let mut structure = Table::new();
    structure.insert("kind".into(), "matrices".into());
    let names = directions.iter().map(|direction| Value::from(direction.name()));
    structure.insert("directions".into(), Value::Array(names.collect()));
    // Where k5 is, k3 stands beside it.
    let turned = estimates.iter().any(|estimate| estimate.key == "k5_n_per_m5");
    let matrices = [
        ("mass", "mass_kg", true),
        ("damping", "damping_ns_per_m", true),
        ("stiffness", "stiffness_n_per_m", true),
        ("cubic_damping", "c3_ns3_per_m3", false),
        ("cubic_stiffness", "k3_n_per_m3", false),
    ];
    for (matrix, key, needed) in matrices {
        let of_matrix: Vec<&Estimate> = estimates.iter().filter(|estimate| estimate.key == key).collect();
        if of_matrix.is_empty() && needed {
            return Err(CaseFileError::Missing(matrix));
        }
        if of_matrix.is_empty() || (turned && matrix == "cubic_stiffness") {
            continue;
        }
        structure.insert(
            matrix.into(),
            rows(directions, &of_matrix, |estimate| estimate.value),
        );
        structure.insert(
            format!("{matrix}_std"),
            rows(directions, &of_matrix, |estimate| estimate.deviation),
        );
    }
    let mut case = Table::new();
    case.insert("name".into(), name.into());
    case.insert("structure".into(), Value::Table(structure));
    let extensions = extensions(directions, estimates, turned)?;
    if !extensions.is_empty() {
        case.insert("extension".into(), Value::Table(extensions));
    }
    // A table of numbers and words is always TOML.
    Ok(toml::to_string(&case).unwrap_or_default())
}

fn extensions(
    directions: &[Direction],
    estimates: &[Estimate],
    turned: bool,
) -> Result<Table, CaseFileError> {
    let mut extensions = Table::new();
    for estimate in estimates {
        let extension = match estimate.key {
            "k3_n_per_m3" if turned => Some("softening-hardening"),
            key => extension_of(key),
        };
        let Some(extension) = extension else { continue };
        let place: Value = match estimate.directions[..] {
            [one] => one.name().into(),
            _ => Value::Array(
                estimate
                    .directions
                    .iter()
                    .map(|direction| direction.name().into())
                    .collect(),
            ),
        };
        let table = extensions
            .entry(extension)
            .or_insert_with(|| Value::Table(Table::new()));
        let Value::Table(table) = table else { continue };
        let key = if estimate.directions.len() > 1 {
            "directions"
        } else {
            "direction"
        };
        if directions.len() > 1 || key == "directions" {
            match table.get(key) {
                Some(known) if *known != place => return Err(CaseFileError::Twice(extension)),
                _ => table.insert(key.into(), place),
            };
        }
        table.insert(estimate.key.into(), estimate.value.into());
        table.insert(format!("{}_std", estimate.key), estimate.deviation.into());
    }
    Ok(extensions)
}

fn rows(directions: &[Direction], estimates: &[&Estimate], of: impl Fn(&Estimate) -> f64) -> Value {
    let mut matrix = DMatrix::zeros(directions.len(), directions.len());
    for estimate in estimates {
        let place =
            |direction: Option<&Direction>| directions.iter().position(|known| Some(known) == direction);
        if let (Some(i), Some(j)) = (
            place(estimate.directions.first()),
            place(estimate.directions.last()),
        ) {
            matrix[(i, j)] = of(estimate);
            matrix[(j, i)] = of(estimate);
        }
    }
    let rows = matrix.row_iter().map(|row| {
        let entries: Vec<Value> = row.iter().map(|entry| Value::Float(*entry)).collect();
        Value::Array(entries)
    });
    Value::Array(rows.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::simulate::Effects;
    use crate::structure::Form;

    #[test]
    fn what_is_written_is_read_again() {
        let estimate = |key, directions: &[Direction], value| Estimate {
            key,
            directions: directions.to_vec(),
            value,
            deviation: 0.01 * f64::abs(value),
        };
        let (y, z) = (Direction::Y, Direction::Z);
        let mut estimates = Vec::new();
        for direction in [y, z] {
            estimates.push(estimate("mass_kg", &[direction], 200.0));
            estimates.push(estimate("damping_ns_per_m", &[direction], 400.0));
            estimates.push(estimate("stiffness_n_per_m", &[direction], 2e6));
            estimates.push(estimate("k3_n_per_m3", &[direction], -3e12));
        }
        estimates.push(estimate("mass_kg", &[y, z], 5.0));
        estimates.push(estimate("kxyy_n_per_m3", &[y, z], 1e12));
        let text = text("found", &[y, z], &estimates).unwrap();
        let case = Case::parse(std::path::Path::new("found.toml"), &text).unwrap();
        let Form::Matrices(m) = &case.structure.as_ref().unwrap().form else {
            panic!("matrices")
        };
        assert_eq!((m.mass[(0, 1)], m.mass[(1, 1)]), (5.0, 200.0));
        assert_eq!(m.cubic_stiffness.as_ref().unwrap()[(1, 1)], -3e12);
        assert_eq!(case.deviations.len(), 2 * 4 + 2);
        let effects = Effects::of_case(&case).unwrap();
        assert_eq!(effects.0.len(), 1);
        let (_, terms) = effects.dynamics(case.structure().unwrap()).unwrap();
        assert_eq!(terms.len(), 1);
    }
}
