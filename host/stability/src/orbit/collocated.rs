//! A subinterval of a period without a switch, collocated about the states at its nodes.

use nalgebra::{DMatrix, DVector};

use crate::problem::gauss::Gauss;

/// A subinterval after a step of Newton from its start.
pub(super) struct Advanced {
    /// The states at the nodes, n × m.
    pub(super) states: DMatrix<f64>,
    /// The state at the end.
    pub(super) end: DVector<f64>,
    /// The derivatives of the states at the nodes, (n m) × anything.
    pub(super) values: DMatrix<f64>,
    /// The derivatives of the state at the end.
    pub(super) end_by: DMatrix<f64>,
    /// The largest change of a state at a node, as a share of the largest there.
    pub(super) moved: f64,
}

/// A subinterval linearized about the states at its nodes.
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

    /// The values at the nodes that a right-hand side makes, (n m) × anything; `None` where the subinterval is singular.
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

    /// Newton's step from a start with its derivatives `by`, for the states at the nodes that the subinterval is linearized about,
    /// their rates, and what acts on them: the derivatives of the rates beside those through the states, n × anything each.
    ///
    /// `None` where the subinterval is singular or the numbers are no longer finite.
    pub(super) fn advance(
        &self,
        start: &DVector<f64>,
        by: &DMatrix<f64>,
        states: &DMatrix<f64>,
        rates: &[DVector<f64>],
        forces: &[DMatrix<f64>],
    ) -> Option<Advanced> {
        let (order, nodes, columns) = (self.order(), self.gauss.nodes.len(), by.ncols());
        // The first column is the residual, the others are the derivatives.
        let mut right = DMatrix::zeros(order * nodes, columns + 1);
        for i in 0..nodes {
            let mut block = right.view_mut((i * order, 0), (order, columns + 1));
            block.column_mut(0).copy_from(&(start - states.column(i)));
            block.columns_mut(1, columns).copy_from(by);
            for (j, (rate, force)) in rates.iter().zip(forces).enumerate() {
                let weight = self.duration_s * self.gauss.integrals[(i, j)];
                block.column_mut(0).axpy(weight, rate, 1.0);
                let mut others = block.columns_mut(1, columns);
                others.zip_apply(force, |entry, value| *entry += weight * value);
            }
        }
        if !self.factored.solve_mut(&mut right) {
            return None;
        }
        let gathered = self.gather(&right);
        let mut end = start + gathered.column(0);
        let mut end_by = by + gathered.columns(1, columns);
        for ((rate, force), weight) in rates.iter().zip(forces).zip(&self.gauss.weights) {
            let weight = self.duration_s * weight;
            end.axpy(weight, rate, 1.0);
            end_by.zip_apply(force, |entry, value| *entry += weight * value);
        }
        let step = DMatrix::from_column_slice(order, nodes, right.column(0).as_slice());
        let states = states + &step;
        let moved = step.amax() / states.amax().max(f64::MIN_POSITIVE);
        (moved.is_finite() && end.iter().all(|entry| entry.is_finite())).then(|| Advanced {
            states,
            end,
            values: right.remove_column(0),
            end_by,
            moved,
        })
    }

    /// The values at the nodes and the end of the subinterval, both by its start.
    pub(super) fn flow(&self) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let (order, nodes) = (self.order(), self.gauss.nodes.len());
        let start = DMatrix::from_fn(order * nodes, order, |row, column| {
            f64::from(row % order == column)
        });
        let values = self.solve(&start)?;
        let mut end = self.gather(&values);
        for i in 0..order {
            end[(i, i)] += 1.0;
        }
        Some((values, end))
    }
}
