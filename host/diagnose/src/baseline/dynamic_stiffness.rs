//! The dynamic stiffness of a structure: force on the tool per displacement of the tool.

use nalgebra::{DMatrix, Matrix3};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::signal::grid::Grid;
use quietcut_model::structure::{FirstOrder, Form, Structure};

/// Dynamic stiffness Z(iω) = −ω²M + iωC + K of a structure along the machine's `axes`, N/m, at the bins of a signal
/// that is not upsampled; rows force, columns displacement.
///
/// For a `structure` given by matrices without rotations, Z is this sum of its matrices, also where K is singular and
/// no receptance exists. For other structures, Z is the inverse of the receptance of `first_order` over `axes`, and
/// zero at bins where that receptance or its inverse does not exist.
pub(crate) fn table(
    structure: &Structure,
    first_order: &FirstOrder,
    axes: &[usize],
    grid: &Grid,
) -> Vec<Matrix3<Complex64>> {
    let by_matrices = match &structure.form {
        Form::Matrices(matrices) if structure.directions.len() == axes.len() => Some(matrices),
        _ => None,
    };
    (0..grid.bins())
        .into_par_iter()
        .map(|bin| {
            let omega = grid.omega(bin);
            let part = match by_matrices {
                Some(matrices) => Some(DMatrix::from_fn(axes.len(), axes.len(), |i, j| {
                    let real = matrices.stiffness[(i, j)] - omega * omega * matrices.mass[(i, j)];
                    Complex64::new(real, omega * matrices.damping[(i, j)])
                })),
                None => first_order.receptance(omega).and_then(|receptance| {
                    DMatrix::from_fn(axes.len(), axes.len(), |i, j| receptance[(axes[i], axes[j])])
                        .try_inverse()
                }),
            };
            let mut whole = Matrix3::zeros();
            if let Some(part) = part {
                for (i, &row) in axes.iter().enumerate() {
                    for (j, &column) in axes.iter().enumerate() {
                        whole[(row, column)] = part[(i, j)];
                    }
                }
            }
            whole
        })
        .collect()
}
