//! Normal equations N x = g of least squares: N = AᴴA and g = Aᴴb, summed over the rows.

use nalgebra::{Cholesky, ComplexField, DMatrix, DVector, Dyn};

/// Treatment of a parameter that has no effect on the prediction, so that its column of A is zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Idle {
    /// A parameter whose diagonal entry of N is not a positive finite number is refused: [`NormalEquations::new`]
    /// returns `None`.
    Refuse,
    /// A parameter whose diagonal entry of N is not a positive finite number is fixed at zero, with a covariance of
    /// zero.
    Hold,
}

/// Factored normal equations N x = g of least squares, for data that are given as sums or are too many to be held as a
/// matrix.
///
/// The factors are those of D N D + λI = L Lᴴ with D = diag(N)^(−1/2) and a ridge λ, where D is used since the
/// parameters of one fit differ by many powers of ten. The condition number of N is the square of that of A: a
/// [`super::LinearProblem`] loses only half as many digits.
///
/// ```
/// use nalgebra::{DMatrix, DVector};
/// use quietcut_numerics::least_squares::{Idle, NormalEquations};
///
/// let normal = DMatrix::from_row_slice(2, 2, &[4.0, 2.0, 2.0, 3.0]);
/// let equations = NormalEquations::new(&normal, 0.0, Idle::Refuse).ok_or("singular")?;
/// let x: DVector<f64> = equations.solve(&DVector::from_vec(vec![10.0, 8.0]));
/// assert!((x[0] - 1.75).abs() < 1e-14 && (x[1] - 1.5).abs() < 1e-14);
/// # Ok::<(), &str>(())
/// ```
#[derive(Clone, Debug)]
pub struct NormalEquations<T: ComplexField = f64> {
    cholesky: Cholesky<T, Dyn>,
    /// Diagonal of the matrix D that scales N to a unit diagonal; 0 for a parameter that is fixed at zero.
    scale: DVector<f64>,
}

impl<T: ComplexField<RealField = f64>> NormalEquations<T> {
    /// Factors N = `matrix`, n × n and Hermitian, of which only the lower triangle is used. `ridge` is added to the
    /// diagonal after it is scaled to 1.
    ///
    /// A ridge λ is the damping of the Levenberg–Marquardt method, or regularizes columns of A that are linearly
    /// dependent within the accuracy √λ. `None` if `idle` refuses a parameter, or if a pivot of the Cholesky decomposition
    /// of N, with the ridge and without the fixed parameters, is not positive and finite: N is then not positive definite
    /// or has an entry below its diagonal that is not finite.
    pub fn new(matrix: &DMatrix<T>, ridge: f64, idle: Idle) -> Option<Self> {
        let size = matrix.nrows();
        let mut scale = DVector::zeros(size);
        for i in 0..size {
            let square = matrix[(i, i)].clone().real();
            scale[i] = if square > 0.0 && square.is_finite() {
                square.sqrt().recip()
            } else if idle == Idle::Hold {
                0.0
            } else {
                return None;
            };
        }
        // Only the lower triangle is filled, since the Cholesky decomposition uses no other entries.
        let mut scaled = DMatrix::zeros(size, size);
        for j in 0..size {
            scaled[(j, j)] = T::from_real(1.0 + ridge);
            for i in j + 1..size {
                scaled[(i, j)] = matrix[(i, j)].clone().scale(scale[i]).scale(scale[j]);
            }
        }
        let cholesky = Cholesky::new(scaled)?;
        // The decomposition takes the root of any complex pivot but zero; that of a negative one is imaginary.
        let pivots = cholesky.l_dirty().diagonal();
        let is_positive =
            |pivot: &T| pivot.clone().real() > pivot.clone().imaginary().abs() && pivot.is_finite();
        pivots.iter().all(is_positive).then_some(Self { cholesky, scale })
    }

    /// Solution x of (N + λ diag N) x = g with g = `right` and the ridge λ; 0 for fixed parameters.
    pub fn solve(&self, right: &DVector<T>) -> DVector<T> {
        let mut solution = right.clone();
        self.scaled(&mut solution);
        self.cholesky.solve_mut(&mut solution);
        self.scaled(&mut solution);
        solution
    }

    /// As [`Self::solve`] for several right sides, each one column of `right`; each column of the result is one
    /// solution.
    pub fn solve_columns(&self, right: &DMatrix<T>) -> DMatrix<T> {
        let mut solution = right.clone();
        self.scaled(&mut solution);
        self.cholesky.solve_mut(&mut solution);
        self.scaled(&mut solution);
        solution
    }

    /// Inverse of N + λ diag N with the ridge λ; its rows and columns are zero for fixed parameters.
    /// Without a ridge it is the covariance of the parameters if each row of A is divided by the standard deviation of
    /// its noise, which is independent.
    pub fn inverse(&self) -> DMatrix<T> {
        let mut inverse = self.cholesky.inverse();
        for j in 0..self.scale.len() {
            for i in 0..self.scale.len() {
                let entry = inverse[(i, j)].clone();
                inverse[(i, j)] = entry.scale(self.scale[i]).scale(self.scale[j]);
            }
        }
        inverse
    }

    /// gᴴ (N + λ diag N)⁻¹ g with g = `right` and the ridge λ: without a ridge, the decrease of the sum of squared
    /// residuals from x = 0 to the solution x of N x = g.
    pub fn explained(&self, right: &DVector<T>) -> f64 {
        let mut whitened = right.clone();
        self.scaled(&mut whitened);
        self.cholesky.l_dirty().solve_lower_triangular_mut(&mut whitened);
        whitened.norm_squared()
    }

    fn scaled<C: nalgebra::Dim, S: nalgebra::StorageMut<T, Dyn, C>>(
        &self,
        rows: &mut nalgebra::Matrix<T, Dyn, C, S>,
    ) {
        for (mut row, scale) in rows.row_iter_mut().zip(self.scale.iter()) {
            row.scale_mut(*scale);
        }
    }
}

/// Solution x of the normal equations N x = g without a ridge; `None` if N is not positive definite or not finite.
pub fn solve_normal_equations(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    Some(NormalEquations::new(matrix, 0.0, Idle::Refuse)?.solve(right))
}

/// Inverse of the normal matrix N without a ridge; `None` if N is not positive definite or not finite.
pub fn invert_normal_equations(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    Some(NormalEquations::new(matrix, 0.0, Idle::Refuse)?.inverse())
}
