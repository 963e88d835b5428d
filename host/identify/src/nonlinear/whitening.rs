//! Whitened residuals of steady motions: measured minus predicted Fourier coefficients, multiplied by the inverse root
//! of their covariance.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::dwells::differentiation::derivative;
use crate::dwells::dwell::{Dwell, FourierSeries};
use crate::nonlinear::harmonic_balance::Solution;
use quietcut_model::structure::Direction;

/// Map from the degrees of freedom q of a structure to its measured directions, u = S q, and from forces F in these
/// directions to generalized forces Sᵀ F.
#[derive(Clone, Copy)]
pub(crate) struct OutputMap<'a> {
    /// The directions of the entries of the displacement u and the force F.
    pub(crate) directions: &'a [Direction],
    /// The matrix S of the map u = S q: a row for each direction, a column for each degree of freedom.
    pub(crate) shape: &'a DMatrix<f64>,
}

impl OutputMap<'_> {
    fn row(&self, line: &FourierSeries) -> Option<usize> {
        self.directions
            .iter()
            .position(|direction| *direction == line.direction)
    }

    /// Fourier coefficients of the generalized force of a dwell on every degree of freedom, without the mean, which
    /// dynamic load cells do not measure.
    pub(crate) fn force(&self, dwell: &Dwell, width: usize) -> DVector<f64> {
        let dofs = self.shape.ncols();
        let mut force = DVector::zeros(dofs * width);
        for line in &dwell.forces {
            let Some(row) = self.row(line) else { continue };
            for dof in 0..dofs {
                force.rows_mut(dof * width + 1, width - 1).axpy(
                    self.shape[(row, dof)],
                    &line.coefficients.rows(1, width - 1),
                    1.0,
                );
            }
        }
        force
    }

    /// Fourier coefficients of the motion in the direction `row`, from those of all degrees of freedom.
    fn moved(&self, row: usize, q: &DMatrix<f64>, width: usize) -> DMatrix<f64> {
        let mut moved = DMatrix::zeros(width, q.ncols());
        for (dof, share) in self.shape.row(row).iter().enumerate() {
            if *share != 0.0 {
                moved += q.rows(dof * width, width) * *share;
            }
        }
        moved
    }

    /// The whitened residual of a dwell, measured − predicted motion, and the Jacobian of the whitened prediction with
    /// respect to θ.
    ///
    /// The covariance comprises the noise of the motion, and the noise of force and frequency propagated through the
    /// derivatives of the predicted motion. `None` if the Jacobian of the harmonic balance is singular, or the
    /// covariance is not positive definite.
    pub(crate) fn whitened(
        &self,
        dwell: &Dwell,
        solution: &Solution,
        width: usize,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let lines: Vec<(&FourierSeries, usize)> = dwell
            .motions
            .iter()
            .filter_map(|line| Some((line, self.row(line)?)))
            .collect();
        let used = width - 1;
        let (by_theta, by_force, by_omega) = solution.sensitivities(0..self.shape.ncols() * width)?;
        let motion = DMatrix::from_column_slice(solution.x.len(), 1, solution.x.as_slice());
        let by_omega = DMatrix::from_column_slice(by_omega.len(), 1, by_omega.as_slice());
        let size = lines.len() * used;
        let mut residual = DVector::zeros(size);
        let mut slope = DMatrix::zeros(size, by_theta.ncols());
        let mut force_slope = DMatrix::zeros(size, by_force.ncols());
        let mut omega_slope = DVector::zeros(size);
        let noise = dwell.gram_inverse.view((1, 1), (used, used));
        let mut covariance = DMatrix::zeros(size, size);
        for (index, (line, row)) in lines.iter().enumerate() {
            let order = derivative(line.quantity);
            let of = |q: &DMatrix<f64>| {
                let mut moved = self.moved(*row, q, width);
                differentiate(&mut moved, order, dwell.omega);
                moved.rows(1, used).into_owned()
            };
            let rows = index * used;
            let predicted = of(&motion);
            residual
                .rows_mut(rows, used)
                .copy_from(&(line.coefficients.rows(1, used) - predicted.column(0)));
            slope.rows_mut(rows, used).copy_from(&of(&by_theta));
            force_slope.rows_mut(rows, used).copy_from(&of(&by_force));
            let own = predicted.column(0) * (f64::from(order) / dwell.omega);
            omega_slope
                .rows_mut(rows, used)
                .copy_from(&(of(&by_omega).column(0) + own));
            covariance
                .view_mut((rows, rows), (used, used))
                .copy_from(&(noise * line.variance));
        }
        for line in &dwell.forces {
            let Some(row) = self.row(line) else { continue };
            let mut part = DMatrix::zeros(size, used);
            for dof in 0..self.shape.ncols() {
                part += force_slope.columns(dof * width + 1, used) * self.shape[(row, dof)];
            }
            covariance += &part * (noise * line.variance) * part.transpose();
        }
        covariance += &omega_slope * omega_slope.transpose() * dwell.omega_variance;
        let root = Cholesky::new(covariance)?.unpack();
        root.solve_lower_triangular_mut(&mut residual).then_some(())?;
        root.solve_lower_triangular_mut(&mut slope).then_some(())?;
        Some((residual, slope))
    }
}

/// Replaces the Fourier coefficients of 1, cos, sin, cos 2 … in every column by those of the `order`-th time
/// derivative.
fn differentiate(x: &mut DMatrix<f64>, order: u8, omega: f64) {
    for _ in 0..order {
        for mut column in x.column_iter_mut() {
            column[0] = 0.0;
            for h in 1..=column.len() / 2 {
                let (c, s) = (column[2 * h - 1], column[2 * h]);
                let factor = h as f64 * omega;
                (column[2 * h - 1], column[2 * h]) = (factor * s, -factor * c);
            }
        }
    }
}
