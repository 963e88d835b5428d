//! Section `[uncertainty]` of a case file: the joint covariance of identified parameters.

use std::fmt::Write;

use nalgebra::DMatrix;
use quietcut_numerics::eigenvalues::of_symmetric;
use toml::{Table, Value};

use crate::modes::ModalModel;
use quietcut_model::case::{Parameter, ParameterCovariance};
use quietcut_model::structure::Direction;

/// Name of the section.
pub(crate) const SECTION: &str = "uncertainty";
const PARAMETERS: &str = "parameters";
const COVARIANCE: &str = "covariance";

/// The section for the modes of a model: frequency, damping ratio, and the entries of both shapes in the given
/// directions, mode by mode. Parameters without variance, such as
/// the shape of a mode in a direction that is taken as uncoupled, are left out.
pub(crate) fn of_modes(model: &ModalModel, directions: &[Direction]) -> Table {
    let place = |all: &[Direction], direction: &Direction| all.iter().position(|known| known == direction);
    let (lefts, rights) = (2 * model.forces.len(), 2 * model.responses.len());
    let width = 2 + lefts + rights;
    let mut parameters = Vec::new();
    let mut places = Vec::new();
    for mode in 0..model.modes.len() {
        let at = width * mode;
        parameters.extend([Parameter::Frequency(mode), Parameter::DampingRatio(mode)]);
        places.extend([at, at + 1]);
        for (all, first, is_left) in [
            (&model.forces, at + 2, true),
            (&model.responses, at + 2 + lefts, false),
        ] {
            for (entry, direction) in directions.iter().enumerate() {
                let Some(index) = place(all, direction) else {
                    continue;
                };
                for imaginary in [false, true] {
                    parameters.push(if is_left {
                        Parameter::Left(mode, entry, imaginary)
                    } else {
                        Parameter::Right(mode, entry, imaginary)
                    });
                    places.push(first + 2 * index + usize::from(imaginary));
                }
            }
        }
    }
    let is_uncertain: Vec<bool> = places
        .iter()
        .map(|&at| model.covariance[(at, at)] != 0.0)
        .collect();
    let mut kept = is_uncertain.iter();
    parameters.retain(|_| kept.next() == Some(&true));
    let mut kept = is_uncertain.iter();
    places.retain(|_| kept.next() == Some(&true));
    let covariance = DMatrix::from_fn(places.len(), places.len(), |i, j| {
        let (a, b) = (places[i], places[j]);
        // Rounding leaves the two triangles of the covariance slightly different.
        0.5 * (model.covariance[(a, b)] + model.covariance[(b, a)])
    });
    let names: Vec<String> = parameters.iter().map(|parameter| parameter.name()).collect();
    let known = ParameterCovariance {
        parameters,
        covariance,
    };
    section(&names, &semidefinite(&known))
}

/// The covariance, with the same variances and without negative eigenvalues of its correlation matrix, which averages
/// over few lines leave: they are set to 0, and rows and columns are scaled back. If the eigenvalues cannot be
/// computed, the variances alone.
fn semidefinite(known: &ParameterCovariance) -> DMatrix<f64> {
    let Ok(eigen) = of_symmetric(known.correlation()) else {
        return DMatrix::from_diagonal(&known.covariance.diagonal());
    };
    if eigen.eigenvalues.min() >= 0.0 {
        return known.covariance.clone();
    }
    let roots = DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| value.max(0.0)));
    let possible = &eigen.eigenvectors * roots * eigen.eigenvectors.transpose();
    let size = possible.nrows();
    let scale = |i: usize| (known.covariance[(i, i)].max(0.0) / possible[(i, i)]).sqrt();
    DMatrix::from_fn(size, size, |i, j| {
        0.5 * (possible[(i, j)] + possible[(j, i)]) * scale(i) * scale(j)
    })
}

fn section(names: &[String], covariance: &DMatrix<f64>) -> Table {
    let mut section = Table::new();
    let names = names.iter().map(|name| Value::from(name.as_str())).collect();
    section.insert(PARAMETERS.into(), Value::Array(names));
    let row = |row: usize| Value::Array(covariance.row(row).iter().copied().map(Value::Float).collect());
    let rows = (0..covariance.nrows()).map(row).collect();
    section.insert(COVARIANCE.into(), Value::Array(rows));
    section
}

/// Names of the parameters and their covariance; `None` if one is missing, if a name is no string or an entry no
/// number, or if there is not one entry for each pair of names.
fn parts(section: &Value) -> Option<(Vec<String>, DMatrix<f64>)> {
    let names = section.get(PARAMETERS)?.as_array()?;
    let names: Vec<String> = names
        .iter()
        .map(|name| name.as_str().map(str::to_owned))
        .collect::<Option<_>>()?;
    let rows = section.get(COVARIANCE)?.as_array()?;
    let number = |entry: &Value| entry.as_float().or_else(|| entry.as_integer().map(|i| i as f64));
    let entries: Vec<f64> = rows
        .iter()
        .flat_map(|row| row.as_array().into_iter().flatten().map(number))
        .collect::<Option<_>>()?;
    (entries.len() == names.len() * names.len()).then(|| {
        (
            names.clone(),
            DMatrix::from_row_slice(names.len(), names.len(), &entries),
        )
    })
}

/// Puts into `case` the covariance that the case `other` has of parameters of the sections `sections`, beside that of
/// the identified parameters. The covariance between the two sets is 0, since they come from different measurements.
pub(crate) fn take_over(case: &mut Table, other: &Table, sections: &[&str]) {
    let Some((names, covariance)) = other.get(SECTION).and_then(parts) else {
        return;
    };
    let kept: Vec<usize> = (0..names.len())
        .filter(|&i| {
            let section = names[i].split('.').next().unwrap_or_default();
            sections.contains(&section)
        })
        .collect();
    if kept.is_empty() {
        return;
    }
    let (mut all, own) = case
        .get(SECTION)
        .and_then(parts)
        .unwrap_or_else(|| (Vec::new(), DMatrix::zeros(0, 0)));
    let first = all.len();
    all.extend(kept.iter().map(|&i| names[i].clone()));
    let joint = DMatrix::from_fn(all.len(), all.len(), |i, j| {
        if i < first && j < first {
            own[(i, j)]
        } else if i >= first && j >= first {
            covariance[(kept[i - first], kept[j - first])]
        } else {
            0.0
        }
    });
    case.insert(SECTION.into(), Value::Table(section(&all, &joint)));
}

/// The section as text, with one line for each parameter and each row; empty if [`parts`] gives `None`.
pub(crate) fn text(section: &Value) -> String {
    let Some((names, covariance)) = parts(section) else {
        return String::new();
    };
    let mut text = format!("\n[{SECTION}]\n{PARAMETERS} = [\n");
    for name in &names {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  \"{name}\",");
    }
    let _ = write!(text, "]\n{COVARIANCE} = [\n");
    for row in covariance.row_iter() {
        let entries: Vec<String> = row.iter().map(|entry| format!("{entry:e}")).collect();
        let _ = writeln!(text, "  [{}],", entries.join(", "));
    }
    text.push_str("]\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_covariance_of_the_job_is_kept_beside_that_of_new_modes() {
        let other = r#"
[uncertainty]
parameters = ["structure.mode.1.frequency_hz", "material.ktc_mpa", "material.krc_mpa"]
covariance = [[0.1, 0.5, 0.0], [0.5, 400, 90.0], [0.0, 90.0, 25.0]]
"#;
        let own = r#"
[uncertainty]
parameters = ["structure.mode.1.damping_ratio"]
covariance = [[1e-6]]
"#;
        let [mut case, other]: [Table; 2] = [own, other].map(|text| text.parse().unwrap());
        take_over(&mut case, &other, &["tool", "material"]);
        let written: Table = text(&case[SECTION]).parse().unwrap();
        let (names, covariance) = parts(&written[SECTION]).unwrap();
        assert_eq!(
            names,
            [
                "structure.mode.1.damping_ratio",
                "material.ktc_mpa",
                "material.krc_mpa"
            ]
        );
        let expected = [1e-6, 0.0, 0.0, 0.0, 400.0, 90.0, 0.0, 90.0, 25.0];
        assert_eq!(covariance, DMatrix::from_row_slice(3, 3, &expected));
        let mut empty = Table::new();
        take_over(&mut empty, &other, &["cut"]);
        assert!(empty.is_empty());
    }

    #[test]
    fn correlations_that_exclude_each_other_are_replaced_by_possible_ones_of_the_same_variances() {
        let correlation = -0.6;
        let known = ParameterCovariance {
            parameters: vec![Parameter::Ktc, Parameter::Krc, Parameter::Kac],
            covariance: DMatrix::from_fn(3, 3, |i, j| {
                let size = [1.0, 10.0, 0.1];
                size[i] * size[j] * if i == j { 1.0 } else { correlation }
            }),
        };
        let possible = semidefinite(&known);
        for i in 0..3 {
            assert!((possible[(i, i)] / known.covariance[(i, i)] - 1.0).abs() < 1e-12);
        }
        // Three equal correlations are possible from −1/2 on.
        assert!((possible[(0, 1)] / 10.0 + 0.5).abs() < 1e-12, "{possible}");
    }
}
