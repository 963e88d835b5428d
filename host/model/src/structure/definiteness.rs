//! Definiteness of mass, damping and stiffness matrices, and changes of entries that restore it.

use std::fmt;

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::eigenvalues::of_symmetric;

use crate::criteria::ZERO_EIGENVALUE;

use super::{Direction, Matrices};

/// A mass matrix whose symmetric part is not positive definite, or a damping or stiffness matrix whose symmetric part
/// is not positive semidefinite.
#[derive(Clone, Debug, PartialEq)]
pub struct Indefinite {
    /// Name of the matrix: mass, damping or stiffness.
    pub matrix: &'static str,
    /// Smallest eigenvalue of the indefinite matrix's symmetric part, in the unit of the matrix; NaN if it cannot be
    /// computed.
    pub eigenvalue: f64,
    /// One change, or two changes together, that make the matrix definite; empty if the search finds none. It tries one
    /// reversed sign, one larger diagonal entry, and one of each, in this order.
    pub remedy: Vec<Remedy>,
}

/// A change of a matrix that, alone or together with another, makes the matrix definite.
#[derive(Clone, Debug, PartialEq)]
pub enum Remedy {
    /// Reversed sign of the off-diagonal entries (row, column) and (column, row).
    Sign {
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// Mean of both entries as they are.
        value: f64,
        /// Degrees of freedom of the row and of the column.
        directions: (Direction, Direction),
    },
    /// Larger diagonal entry.
    Diagonal {
        /// Row and column, from 1.
        row: usize,
        /// The entry as it is.
        value: f64,
        /// Lower bound that the diagonal entry must exceed for a definite matrix, after the other change if there is
        /// one, in the unit of the matrix.
        above: f64,
        /// Degree of freedom of the row.
        direction: Direction,
    },
}

impl fmt::Display for Indefinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the {} matrix is indefinite: its smallest eigenvalue is {:.4e}",
            self.matrix, self.eigenvalue
        )?;
        for (count, remedy) in self.remedy.iter().enumerate() {
            write!(f, "{}{remedy}", if count == 0 { "; " } else { ", and " })?;
        }
        match self.remedy.len() {
            0 => write!(f, "; no change of one or two entries makes it definite"),
            1 => write!(f, " (that alone makes it definite)"),
            _ => write!(f, " (both together make it definite)"),
        }
    }
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sign {
                row,
                column,
                value,
                directions: (a, b),
            } => write!(
                f,
                "entry ({row},{column}), {a}-{b}, is {value}: its sign is wrong, as is that of ({column},{row})"
            ),
            Self::Diagonal {
                row,
                value,
                above,
                direction,
            } => write!(
                f,
                "entry ({row},{row}), {direction}-{direction}, is {value}: it must exceed {above:.4}"
            ),
        }
    }
}

/// The indefinite matrices of a structure, in the order mass, stiffness, damping.
///
/// The test uses the symmetric parts, since only these store or dissipate energy. Mass must be positive definite,
/// stiffness and damping at least positive semidefinite.
pub(super) fn indefinite(matrices: &Matrices, directions: &[Direction]) -> Vec<Indefinite> {
    let requirements = [
        ("mass", &matrices.mass, true),
        ("stiffness", &matrices.stiffness, false),
        ("damping", &matrices.damping, false),
    ];
    requirements
        .into_iter()
        .filter_map(|(name, matrix, strict)| violation(name, matrix, strict, &matrices.mass, directions))
        .collect()
}

fn violation(
    name: &'static str,
    matrix: &DMatrix<f64>,
    strict: bool,
    mass: &DMatrix<f64>,
    directions: &[Direction],
) -> Option<Indefinite> {
    let symmetric = (matrix + matrix.transpose()) * 0.5;
    if is_definite(&symmetric, strict) {
        return None;
    }
    Some(Indefinite {
        matrix: name,
        eigenvalue: smallest_eigenvalue(&symmetric),
        remedy: remedy(matrix, &symmetric, strict, mass, directions),
    })
}

/// True if a symmetric matrix is positive definite, or, unless `strict`, at least positive semidefinite, within
/// [`ZERO_EIGENVALUE`]. Rows and columns are first scaled so that positive diagonal entries become 1, since
/// translations and rotations have different units.
fn is_definite(symmetric: &DMatrix<f64>, strict: bool) -> bool {
    let scaled = scaled(symmetric, &scale(symmetric));
    // A matrix whose eigenvalues cannot be computed, such as one with an entry that is not finite, counts as not
    // definite.
    let Ok(eigenvalues) = of_symmetric(scaled).map(|eigen| eigen.eigenvalues) else {
        return false;
    };
    let threshold = ZERO_EIGENVALUE * eigenvalues.amax();
    if strict {
        eigenvalues.min() > threshold
    } else {
        eigenvalues.min() >= -threshold
    }
}

/// Factors of rows and columns that make positive diagonal entries 1.
fn scale(symmetric: &DMatrix<f64>) -> DVector<f64> {
    symmetric
        .diagonal()
        .map(|d| if d > 0.0 { d.sqrt().recip() } else { 1.0 })
}

fn scaled(symmetric: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(symmetric.nrows(), symmetric.ncols(), |i, j| {
        symmetric[(i, j)] * scale[i] * scale[j]
    })
}

fn smallest_eigenvalue(symmetric: &DMatrix<f64>) -> f64 {
    of_symmetric(symmetric.clone()).map_or(f64::NAN, |eigen| eigen.eigenvalues.min())
}

/// The first change that makes the matrix definite, in the order of [`Indefinite::remedy`]; empty if none is found.
///
/// The sign to reverse need not be unique: if entries (i,j), (j,k) and (i,k) have a product of the wrong sign,
/// reversing any one of them corrects the product. Entries whose sign differs from that in the mass matrix are tried
/// first.
fn remedy(
    matrix: &DMatrix<f64>,
    symmetric: &DMatrix<f64>,
    strict: bool,
    mass: &DMatrix<f64>,
    directions: &[Direction],
) -> Vec<Remedy> {
    let size = symmetric.nrows();
    let mut signs: Vec<(usize, usize)> = (0..size)
        .flat_map(|i| (i + 1..size).map(move |j| (i, j)))
        .filter(|&entry| symmetric[entry] != 0.0)
        .collect();
    signs.sort_by_key(|&entry| symmetric[entry] * mass[entry] >= 0.0);
    let sign = |(i, j): (usize, usize)| Remedy::Sign {
        row: i + 1,
        column: j + 1,
        value: matrix[(i, j)],
        directions: (directions[i], directions[j]),
    };
    let diagonal = |row: usize, above: f64| Remedy::Diagonal {
        row: row + 1,
        value: symmetric[(row, row)],
        above,
        direction: directions[row],
    };
    for &entry in &signs {
        if is_definite(&with_reversed_sign(symmetric, entry), strict) {
            return vec![sign(entry)];
        }
    }
    for row in 0..size {
        if let Some(above) = least_diagonal(symmetric, row, strict) {
            return vec![diagonal(row, above)];
        }
    }
    for &entry in &signs {
        let reversed = with_reversed_sign(symmetric, entry);
        for row in 0..size {
            if let Some(above) = least_diagonal(&reversed, row, strict) {
                return vec![sign(entry), diagonal(row, above)];
            }
        }
    }
    Vec::new()
}

fn with_reversed_sign(symmetric: &DMatrix<f64>, (i, j): (usize, usize)) -> DMatrix<f64> {
    let mut reversed = symmetric.clone();
    reversed[(i, j)] = -reversed[(i, j)];
    reversed[(j, i)] = -reversed[(j, i)];
    reversed
}

/// Lower bound of the diagonal entry `row` for a definite matrix, sᵀ R⁺ s (from the Schur complement): s is the
/// remainder of the row, R the matrix without row and column; 0 for a matrix of one row. `None` if R is not definite, or
/// if s is not in the range of a singular R: then no diagonal entry is large enough.
fn least_diagonal(symmetric: &DMatrix<f64>, row: usize, strict: bool) -> Option<f64> {
    let rest = symmetric.clone().remove_row(row).remove_column(row);
    if rest.is_empty() {
        return Some(0.0);
    }
    if !is_definite(&rest, strict) {
        return None;
    }
    let scale = scale(&rest);
    let side = symmetric
        .column(row)
        .into_owned()
        .remove_row(row)
        .component_mul(&scale);
    let eigen = of_symmetric(scaled(&rest, &scale)).ok()?;
    let least = ZERO_EIGENVALUE * eigen.eigenvalues.amax();
    let parts = eigen.eigenvectors.tr_mul(&side);
    let null: f64 = (0..parts.len())
        .filter(|&i| eigen.eigenvalues[i] <= least)
        .map(|i| parts[i] * parts[i])
        .sum();
    // The square of a part along the null space is as uncertain as the eigenvalue zero.
    if null > ZERO_EIGENVALUE * side.norm_squared() {
        return None;
    }
    let terms = (0..parts.len()).filter(|&i| eigen.eigenvalues[i] > least);
    Some(terms.map(|i| parts[i] * parts[i] / eigen.eigenvalues[i]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::tests::case;
    use crate::structure::{Form, StructureError};

    #[test]
    fn the_printed_matrices_are_refused_with_the_entries_to_blame() {
        let case = case("staubli-tx200-as-printed");
        let StructureError::Indefinite(found) = case.structure().unwrap().check().unwrap_err() else {
            panic!("not indefinite")
        };
        let names: Vec<&str> = found.iter().map(|indefinite| indefinite.matrix).collect();
        assert_eq!(names, ["stiffness", "damping"]);
        assert!(found.iter().all(|indefinite| indefinite.eigenvalue < 0.0));
        let sign = |value| Remedy::Sign {
            row: 1,
            column: 6,
            value,
            directions: (Direction::X, Direction::Rz),
        };
        assert_eq!(found[0].remedy, [sign(4.35e6)]);
        assert_eq!(found[1].remedy[0], sign(4616.0));
        // With the reversed sign, a definite damping matrix needs C44 > 489 instead of 12.
        let Remedy::Diagonal {
            row: 4,
            value: 12.0,
            above,
            ..
        } = found[1].remedy[1]
        else {
            panic!("{:?}", found[1].remedy)
        };
        assert!((above - 489.0).abs() < 1.0, "{above}");
    }

    #[test]
    fn a_diagonal_entry_beside_a_free_body_is_blamed() {
        let directions = [Direction::X, Direction::Y, Direction::Z];
        let mut mass = DMatrix::identity(3, 3);
        (mass[(1, 2)], mass[(2, 1)]) = (0.1, 0.1);
        let of = |values: &[f64]| {
            let matrix = DMatrix::from_row_slice(3, 3, values);
            violation("stiffness", &matrix, false, &mass, &directions).unwrap()
        };
        // x and y share a spring of 4 and are otherwise free; z is tied to their difference: sᵀ R⁺ s = 4·2²/16.
        let found = of(&[4.0, -4.0, 2.0, -4.0, 4.0, -2.0, 2.0, -2.0, 0.5]);
        let [Remedy::Diagonal { row: 3, above, .. }] = found.remedy[..] else {
            panic!("{found}")
        };
        assert!((above - 1.0).abs() < 1e-9, "{above}");
        // A coupling to the free motion: no entry of z is large enough.
        let found = of(&[4.0, -4.0, 2.0, -4.0, 4.0, 2.5, 2.0, 2.5, 0.5]);
        assert!(found.remedy.is_empty(), "{found}");
        // The entry as it is in a matrix that is not symmetric.
        let found = of(&[1.0, 0.9, 0.9, 0.9, 1.0, -0.8, 0.9, -0.6, 1.0]);
        let values: Vec<f64> = found
            .remedy
            .iter()
            .map(|remedy| match remedy {
                Remedy::Sign {
                    row: 2,
                    column: 3,
                    value,
                    ..
                } => *value,
                other => panic!("{other}"),
            })
            .collect();
        assert_eq!(values, [-0.8]);
    }

    #[test]
    fn every_other_case_is_definite() {
        for name in [
            "staubli-tx200",
            "kuka-kr90-full",
            "insperger-2dof-ad1",
            "kuka-kr90-z10",
        ] {
            case(name).structure().unwrap().check().unwrap();
        }
    }

    #[test]
    fn a_free_body_is_no_fault_and_a_body_without_mass_is() {
        let mut case = case("insperger-2dof-ad1");
        let Some(structure) = &mut case.structure else {
            panic!("no structure")
        };
        let Form::Matrices(matrices) = &mut structure.form else {
            panic!("no matrices")
        };
        matrices.stiffness = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.0]);
        assert!(structure.check().is_ok());
        let Form::Matrices(matrices) = &mut structure.form else {
            panic!("no matrices")
        };
        matrices.mass[(1, 1)] = 0.0;
        let message = structure.check().unwrap_err().to_string();
        assert!(
            message.contains("mass") && message.contains("entry (2,2)"),
            "{message}"
        );
    }
}
