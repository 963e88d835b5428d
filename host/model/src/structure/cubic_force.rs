//! Cubic terms of a structure.

use nalgebra::DMatrix;

use super::{Matrices, Structure, StructureError};

/// Cubic terms f₃(q, v) = C₃ v∘³ + K₃ q∘³, with ∘³ the cube of each element.
#[derive(Clone, Debug, PartialEq)]
pub struct CubicForce {
    /// Number of displacements q.
    size: usize,
    /// Matrix C₃ of cubic damping, row by row.
    damping: Vec<f64>,
    /// Matrix K₃ of cubic stiffness, row by row.
    stiffness: Vec<f64>,
}

impl CubicForce {
    /// Cubic terms of the first-order form with the states q and v = q̇/`scale`, which v̇ contains with a minus sign;
    /// their matrices are M⁻¹C₃·scale² and M⁻¹K₃/scale.
    ///
    /// # Errors
    /// The mass matrix is singular, and there is a cubic matrix to divide by it.
    pub fn in_first_order(matrices: &Matrices, scale: f64) -> Result<Self, StructureError> {
        let size = matrices.mass.nrows();
        let mass = matrices.mass.clone().lu();
        let divided = |matrix: &Option<DMatrix<f64>>, factor: f64| match matrix {
            Some(matrix) => {
                let divided = mass.solve(matrix).ok_or(StructureError::SingularMass)?;
                Ok((divided.transpose() * factor).as_slice().to_vec())
            }
            None => Ok(vec![0.0; size * size]),
        };
        Ok(Self {
            size,
            damping: divided(&matrices.cubic_damping, scale * scale)?,
            stiffness: divided(&matrices.cubic_stiffness, scale.recip())?,
        })
    }

    /// Cubic terms on the tool along the machine's x, y and z, in SI units; `None` unless the structure is given by
    /// matrices with cubic terms other than zero. Rows and columns of rotations are left out.
    pub fn along_axes(structure: &Structure) -> Option<Self> {
        let super::Form::Matrices(matrices) = &structure.form else {
            return None;
        };
        let rows = |matrix: &Option<DMatrix<f64>>| {
            let mut rows = vec![0.0; 9];
            let axes: Vec<_> = structure
                .directions
                .iter()
                .map(|direction| direction.axis())
                .collect();
            for (i, row) in axes.iter().enumerate() {
                for (j, column) in axes.iter().enumerate() {
                    if let (Some(row), Some(column), Some(matrix)) = (row, column, matrix) {
                        rows[3 * row + column] = matrix[(i, j)];
                    }
                }
            }
            rows
        };
        structure.is_nonlinear().then(|| Self {
            size: 3,
            damping: rows(&matrices.cubic_damping),
            stiffness: rows(&matrices.cubic_stiffness),
        })
    }

    /// Number of displacements q.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The elements of f₃(q, v), in the order of the elements of `q`.
    pub fn at<'a>(&'a self, q: &'a [f64], v: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        let rows = self.damping.chunks_exact(self.size);
        rows.zip(self.stiffness.chunks_exact(self.size))
            .map(move |(damping, stiffness)| dot_cubes(damping, v) + dot_cubes(stiffness, q))
    }

    /// ∂f₃ᵢ/∂qⱼ and ∂f₃ᵢ/∂vⱼ, which are 3·K₃ᵢⱼ·qⱼ² and 3·C₃ᵢⱼ·vⱼ².
    pub fn slopes(&self, (i, j): (usize, usize), q: &[f64], v: &[f64]) -> [f64; 2] {
        let entry = i * self.size + j;
        [
            3.0 * self.stiffness[entry] * q[j] * q[j],
            3.0 * self.damping[entry] * v[j] * v[j],
        ]
    }

    /// ∂²f₃ᵢ/∂qⱼ² and ∂²f₃ᵢ/∂vⱼ², which are 6·K₃ᵢⱼ·qⱼ and 6·C₃ᵢⱼ·vⱼ; all mixed second derivatives are zero.
    pub fn curvatures(&self, (i, j): (usize, usize), q: &[f64], v: &[f64]) -> [f64; 2] {
        let entry = i * self.size + j;
        [
            6.0 * self.stiffness[entry] * q[j],
            6.0 * self.damping[entry] * v[j],
        ]
    }

    /// The same force with the matrix C₃ times `damping` and K₃ times `stiffness`.
    #[must_use]
    pub fn scaled(&self, damping: f64, stiffness: f64) -> Self {
        let times = |matrix: &[f64], factor: f64| matrix.iter().map(|entry| entry * factor).collect();
        Self {
            size: self.size,
            damping: times(&self.damping, damping),
            stiffness: times(&self.stiffness, stiffness),
        }
    }
}

fn dot_cubes(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b * b * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_and_curvatures_are_those_of_the_force() {
        let matrix = |entries: [f64; 4]| Some(DMatrix::from_row_slice(2, 2, &entries));
        let matrices = Matrices {
            mass: DMatrix::from_row_slice(2, 2, &[2.0, 0.3, 0.3, 1.0]),
            damping: DMatrix::zeros(2, 2),
            stiffness: DMatrix::identity(2, 2),
            cubic_damping: matrix([0.7, -0.2, 0.1, 0.4]),
            cubic_stiffness: matrix([5.0, 1.0, -2.0, 3.0]),
        };
        let cubic = CubicForce::in_first_order(&matrices, 3.0).unwrap();
        let (q, v) = ([0.4, -0.7], [0.2, 0.9]);
        let step = 1e-6;
        for i in 0..2 {
            for j in 0..2 {
                let moved = |mut x: [f64; 2], by: f64| {
                    x[j] += by;
                    x
                };
                let of = |q: [f64; 2], v: [f64; 2]| cubic.at(&q, &v).nth(i).unwrap();
                let found = cubic.slopes((i, j), &q, &v);
                let by_q = (of(moved(q, step), v) - of(moved(q, -step), v)) / (2.0 * step);
                let by_v = (of(q, moved(v, step)) - of(q, moved(v, -step))) / (2.0 * step);
                assert!((found[0] - by_q).abs() < 1e-8 && (found[1] - by_v).abs() < 1e-8);
                let bent = cubic.curvatures((i, j), &q, &v);
                let slope = |q: [f64; 2], v: [f64; 2]| cubic.slopes((i, j), &q, &v);
                let by_q = (slope(moved(q, step), v)[0] - slope(moved(q, -step), v)[0]) / (2.0 * step);
                let by_v = (slope(q, moved(v, step))[1] - slope(q, moved(v, -step))[1]) / (2.0 * step);
                assert!((bent[0] - by_q).abs() < 1e-7 && (bent[1] - by_v).abs() < 1e-7);
            }
        }
        // M⁻¹(C₃ v³·9 + K₃ q³/3), by hand.
        let force = |row: usize| {
            let c3 = [[0.7, -0.2], [0.1, 0.4]][row];
            let k3 = [[5.0, 1.0], [-2.0, 3.0]][row];
            (0..2)
                .map(|j| 9.0 * c3[j] * v[j].powi(3) + k3[j] * q[j].powi(3) / 3.0)
                .sum::<f64>()
        };
        let determinant = 2.0 * 1.0 - 0.3 * 0.3;
        let wanted = [
            (1.0 * force(0) - 0.3 * force(1)) / determinant,
            (2.0 * force(1) - 0.3 * force(0)) / determinant,
        ];
        for (found, wanted) in cubic.at(&q, &v).zip(wanted) {
            assert!((found - wanted).abs() < 1e-14, "{found} {wanted}");
        }
    }
}
