//! Collocation of the orbit over a subinterval without entry or exit of a tooth, linearized about the states at its
//! nodes.

use nalgebra::{DMatrix, DVector};

use super::collocation_matrix::CollocationMatrix;
use quietcut_numerics::quadrature::Gauss;

/// Collocated motion in a subinterval after one Newton step, from a given state at its start.
pub(super) struct Advanced {
    /// States at the nodes of the subinterval, n states × m nodes.
    pub(super) states: DMatrix<f64>,
    /// State at the end of the subinterval.
    pub(super) end: DVector<f64>,
    /// Derivatives of the states at the nodes of the subinterval with respect to the state at the start of the period
    /// and the depth, (n m) × number of these variables.
    pub(super) values: DMatrix<f64>,
    /// Derivatives of the state at the end of the subinterval with respect to the state at the start of the period and
    /// the depth.
    pub(super) end_by: DMatrix<f64>,
    /// Largest change of a state at a node by the Newton step, relative to the largest state in the subinterval.
    pub(super) moved: f64,
}

/// Equation of motion collocated in a subinterval and linearized about the states at its nodes.
pub(super) struct Linearized<'a> {
    gauss: &'a Gauss,
    duration_s: f64,
    /// Jacobian ∂ẋ/∂x of the equation of motion at each node.
    jacobians: Vec<DMatrix<f64>>,
    /// Factors of the matrix I − h a⊗J of the collocation equations, with the duration h, the Gauss integrals a and the
    /// Jacobians J.
    factored: CollocationMatrix,
}

impl<'a> Linearized<'a> {
    /// Factors the matrix of the collocation equations, from the Jacobians of the equation of motion at the nodes.
    pub(super) fn new(gauss: &'a Gauss, duration_s: f64, jacobians: Vec<DMatrix<f64>>) -> Self {
        Self {
            factored: CollocationMatrix::new(gauss, duration_s, &jacobians),
            gauss,
            duration_s,
            jacobians,
        }
    }

    /// Number of states.
    pub(super) fn order(&self) -> usize {
        self.jacobians[0].nrows()
    }

    /// Solves the collocation equations for the changes of the states at the nodes, (n m) × columns; `None` if they are
    /// singular.
    pub(super) fn solve(&self, mut right: DMatrix<f64>) -> Option<DMatrix<f64>> {
        self.factored.solve_mut(&mut right).then_some(right)
    }

    /// Contribution of the states Y_j at the nodes to the state at the end of the subinterval: h Σ b_j J_j Y_j, with
    /// the Jacobians J_j and Gauss weights b_j.
    pub(super) fn gather(&self, values: &DMatrix<f64>) -> DMatrix<f64> {
        let order = self.order();
        let mut sum = DMatrix::zeros(order, values.ncols());
        for (j, jacobian) in self.jacobians.iter().enumerate() {
            let weight = self.duration_s * self.gauss.weights[j];
            sum.gemm(weight, jacobian, &values.rows(j * order, order), 1.0);
        }
        sum
    }

    /// Newton step of a subinterval from the state `start` at its start, with the derivatives `by` of that state.
    /// `states` are the states at the nodes, `rates` their time derivatives, and `forces` the explicit derivatives of
    /// the rates (those not through the states), n × number of variables each.
    ///
    /// `None` if the equations are singular or a result is not finite.
    pub(super) fn advance(
        &self,
        start: &DVector<f64>,
        by: &DMatrix<f64>,
        states: &DMatrix<f64>,
        rates: &[DVector<f64>],
        forces: &[DMatrix<f64>],
    ) -> Option<Advanced> {
        let (order, nodes, columns) = (self.order(), self.gauss.nodes.len(), by.ncols());
        // Right-hand sides: the first column is the residual of the collocation equations, the others belong to the
        // derivatives with respect to the variables. Column j of `explicit` holds the rates and forces at node j.
        let mut explicit = DMatrix::zeros(order * (columns + 1), nodes);
        for (mut column, (rate, force)) in explicit.column_iter_mut().zip(rates.iter().zip(forces)) {
            let (of_rate, of_force) = column.as_mut_slice().split_at_mut(order);
            of_rate.copy_from_slice(rate.as_slice());
            of_force.copy_from_slice(force.as_slice());
        }
        let integrated = &explicit * self.gauss.integrals.transpose() * self.duration_s;
        let mut right = DMatrix::zeros(order * nodes, columns + 1);
        for (i, integrated) in integrated.column_iter().enumerate() {
            let mut block = right.view_mut((i * order, 0), (order, columns + 1));
            block.copy_from_slice(integrated.as_slice());
            let mut residual = block.column_mut(0);
            residual += start - states.column(i);
            let mut others = block.columns_mut(1, columns);
            others += by;
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

    /// Derivatives of the states at the nodes and at the end of the subinterval with respect to the state at its start;
    /// `None` if the collocation equations are singular.
    pub(super) fn flow(&self) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let (order, nodes) = (self.order(), self.gauss.nodes.len());
        let start = DMatrix::from_fn(order * nodes, order, |row, column| {
            f64::from(row % order == column)
        });
        let values = self.solve(start)?;
        let mut end = self.gather(&values);
        for i in 0..order {
            end[(i, i)] += 1.0;
        }
        Some((values, end))
    }
}
