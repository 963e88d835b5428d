//! A piece of a period without a switch, collocated about the states at its nodes.

use nalgebra::{DMatrix, DVector};

use crate::stability::gauss::Gauss;

/// Newton stops at steps below this, relative to the size of the orbit.
const TOLERANCE: f64 = 1e-12;

/// Derivatives about states within this share of the orbit are those about the states themselves: Newton that uses them gains
/// eight digits in a step.
const SAME: f64 = 1e-8;

/// Solves for the states at the nodes of a piece from a guess, and linearizes about them.
///
/// Newton with a factorization that is kept while steps shrink tenfold. `None` where it does not settle.
pub(super) fn settle<'a>(
    start: &DVector<f64>,
    guess: &DMatrix<f64>,
    rates: impl Fn(&DMatrix<f64>) -> Vec<DVector<f64>>,
    linearized: impl Fn(&DMatrix<f64>) -> Linearized<'a>,
) -> Option<(DMatrix<f64>, Linearized<'a>)> {
    let mut states = guess.clone();
    let mut about = linearized(&states);
    let (mut moved, mut last) = (0.0, f64::INFINITY);
    for _ in 0..24 {
        let step = about.correction(start, &states, &rates(&states))?;
        states += &step;
        let size = step.amax();
        moved += size;
        if size <= TOLERANCE * states.amax() {
            if moved > SAME * states.amax() {
                about = linearized(&states);
            }
            return Some((states, about));
        }
        if size > 0.1 * last {
            about = linearized(&states);
            moved = 0.0;
        }
        last = size;
    }
    None
}

/// A piece linearized about the states at its nodes.
pub(super) struct Linearized<'a> {
    gauss: &'a Gauss,
    duration_s: f64,
    /// Jacobian at each node.
    jacobians: Vec<DMatrix<f64>>,
    /// (I − h a⊗J), factored.
    factored: nalgebra::LU<f64, nalgebra::Dyn, nalgebra::Dyn>,
}

impl<'a> Linearized<'a> {
    /// From the Jacobians at the nodes.
    pub(super) fn new(gauss: &'a Gauss, duration_s: f64, jacobians: Vec<DMatrix<f64>>) -> Self {
        let (order, nodes) = (jacobians[0].nrows(), gauss.nodes.len());
        let mut matrix = DMatrix::identity(order * nodes, order * nodes);
        for i in 0..nodes {
            for (j, jacobian) in jacobians.iter().enumerate() {
                let weight = duration_s * gauss.integrals[(i, j)];
                let mut block = matrix.view_mut((i * order, j * order), (order, order));
                block.zip_apply(jacobian, |entry, value| *entry -= weight * value);
            }
        }
        Self {
            gauss,
            duration_s,
            jacobians,
            factored: matrix.lu(),
        }
    }

    /// Number of states.
    pub(super) fn order(&self) -> usize {
        self.jacobians[0].nrows()
    }

    /// The values at the nodes that a right-hand side makes, (n m) × anything; `None` where the piece is singular.
    pub(super) fn solve(&self, right: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        self.factored.solve(right)
    }

    /// What of x₁ the values at the nodes make: h Σ b_j J_j Y_j.
    pub(super) fn gather(&self, values: &DMatrix<f64>) -> DMatrix<f64> {
        let order = self.order();
        let mut sum = DMatrix::zeros(order, values.ncols());
        for (j, jacobian) in self.jacobians.iter().enumerate() {
            let weight = self.duration_s * self.gauss.weights[j];
            sum.gemm(weight, jacobian, &values.rows(j * order, order), 1.0);
        }
        sum
    }

    /// The change of the states at the nodes, n × m, that Newton makes of their rates, from a start; `None` where the piece is
    /// singular or the numbers are no longer finite.
    pub(super) fn correction(
        &self,
        start: &DVector<f64>,
        states: &DMatrix<f64>,
        rates: &[DVector<f64>],
    ) -> Option<DMatrix<f64>> {
        let (order, nodes) = (self.order(), self.gauss.nodes.len());
        let mut residual = DMatrix::zeros(order * nodes, 1);
        for i in 0..nodes {
            let mut row = start - states.column(i);
            for (j, rate) in rates.iter().enumerate() {
                row.axpy(self.duration_s * self.gauss.integrals[(i, j)], rate, 1.0);
            }
            residual.view_mut((i * order, 0), (order, 1)).copy_from(&row);
        }
        let step = self.solve(&residual)?;
        step.iter()
            .all(|entry| entry.is_finite())
            .then(|| DMatrix::from_column_slice(order, nodes, step.as_slice()))
    }

    /// What the values at the nodes and the end of the piece become under forces at the nodes, n × anything each, and a start.
    pub(super) fn response(
        &self,
        start: &DMatrix<f64>,
        forces: &[DMatrix<f64>],
    ) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let (order, nodes) = (self.order(), self.gauss.nodes.len());
        let mut right = DMatrix::zeros(order * nodes, start.ncols());
        for i in 0..nodes {
            let mut row = start.clone();
            for (j, force) in forces.iter().enumerate() {
                let weight = self.duration_s * self.gauss.integrals[(i, j)];
                row.zip_apply(force, |entry, value| *entry += weight * value);
            }
            right.rows_mut(i * order, order).copy_from(&row);
        }
        let values = self.solve(&right)?;
        let mut end = start + self.gather(&values);
        for (force, weight) in forces.iter().zip(&self.gauss.weights) {
            let weight = self.duration_s * weight;
            end.zip_apply(force, |entry, value| *entry += weight * value);
        }
        Some((values, end))
    }
}
