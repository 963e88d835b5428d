//! The cubic matrices of a structure as a restoring force f_r = C₃ v∘³ + K₃ x∘³.

use nalgebra::Matrix3;

use quietcut_model::structure::{Form, Structure};
use quietcut_simulate::{MotionState, Regime, RestoringForce};

#[derive(Debug)]
struct CubicMatrices {
    damping: Matrix3<f64>,
    stiffness: Matrix3<f64>,
}

/// The restoring force of a structure's cubic matrices along x, y and z; `None` without such matrices. Rows and columns of rotations are
/// omitted, because the state `At` holds translations only.
pub(crate) fn cubic_term(structure: &Structure) -> Option<Box<dyn RestoringForce>> {
    let Form::Matrices(matrices) = &structure.form else {
        return None;
    };
    if !structure.is_nonlinear() {
        return None;
    }
    let of = |matrix: &Option<nalgebra::DMatrix<f64>>| {
        let mut whole = Matrix3::zeros();
        if let Some(matrix) = matrix {
            for (i, row) in structure.directions.iter().enumerate() {
                for (j, column) in structure.directions.iter().enumerate() {
                    if let (Some(row), Some(column)) = (row.axis(), column.axis()) {
                        whole[(row, column)] = matrix[(i, j)];
                    }
                }
            }
        }
        whole
    };
    Some(Box::new(CubicMatrices {
        damping: of(&matrices.cubic_damping),
        stiffness: of(&matrices.cubic_stiffness),
    }))
}

impl RestoringForce for CubicMatrices {
    fn restoring_n(&self, _: Regime, at: &MotionState, _: &[f64]) -> [f64; 3] {
        let cube = |x: [f64; 3]| nalgebra::Vector3::from(x.map(|x| x * x * x));
        (self.stiffness * cube(at.x) + self.damping * cube(at.v)).into()
    }
}
