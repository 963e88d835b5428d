//! Location of an effect in a structure: the axis of a direction, and the static stiffness along the axes.

use nalgebra::{DMatrix, Matrix3};

use super::EffectError;
use crate::structure::{Direction, Structure};

/// Index 0, 1, 2 of the axis of `direction`; of the only axis of the structure if `direction` is `None`.
pub(super) fn axis_of(
    structure: &Structure,
    direction: Option<Direction>,
    name: &'static str,
) -> Result<usize, EffectError> {
    let wrong = |what: String| EffectError::Direction {
        name,
        what,
        directions: directions_in_words(structure),
    };
    match direction {
        Some(direction) if !structure.directions.contains(&direction) => {
            Err(wrong(format!("there is no direction {direction}")))
        }
        Some(direction) => direction
            .axis()
            .ok_or_else(|| wrong(format!("{direction} is a rotation; x, y or z is needed"))),
        None => {
            let axes: Vec<usize> = structure.directions.iter().filter_map(|d| d.axis()).collect();
            match axes[..] {
                [only] => Ok(only),
                _ => Err(wrong("it must say its direction (direction = \"x\")".into())),
            }
        }
    }
}

/// The directions of a structure, separated by commas.
pub(super) fn directions_in_words(structure: &Structure) -> String {
    let names: Vec<String> = structure.directions.iter().map(ToString::to_string).collect();
    names.join(", ")
}

/// Static stiffness matrix at the tool along x, y and z, N/m: the inverse of the static receptance. For a structure
/// given by matrices, all of whose directions are axes, its entries are those of the stiffness matrix K. Rows and
/// columns of axes that the structure does not have are zero.
pub(super) fn static_stiffness(
    structure: &Structure,
    name: &'static str,
) -> Result<Matrix3<f64>, EffectError> {
    let unknown = |reason: &str| EffectError::Structure {
        name,
        what: format!("the static stiffness of the structure is not known: {reason}"),
    };
    let axes: Vec<usize> = structure.directions.iter().filter_map(|d| d.axis()).collect();
    let first_order = structure
        .first_order()
        .map_err(|error| unknown(&error.to_string()))?;
    let receptance = first_order
        .receptance(0.0)
        .ok_or_else(|| unknown("it is free to move as a rigid body"))?;
    let compliance = DMatrix::from_fn(axes.len(), axes.len(), |i, j| receptance[(axes[i], axes[j])].re);
    let stiffness = compliance
        .try_inverse()
        .ok_or_else(|| unknown("its static receptance has no inverse"))?;
    let mut whole = Matrix3::zeros();
    for (i, &row) in axes.iter().enumerate() {
        for (j, &column) in axes.iter().enumerate() {
            whole[(row, column)] = stiffness[(i, j)];
        }
    }
    Ok(whole)
}

/// Vector of a force of `force_n`, N, along one axis.
pub(super) fn along(axis: usize, force_n: f64) -> [f64; 3] {
    let mut force = [0.0; 3];
    force[axis] = force_n;
    force
}
