//! The matrix I − h a⊗J of the collocation equations of a subinterval, factored.
//!
//! A structure with mass has the states (q, v) with q̇ = s v. With the Jacobians J_j = [0, sI; K_j, D_j] at the nodes,
//! the displacements Y_q at the nodes follow from the velocities Y_v,
//!
//!   q_i = r_i + h s Σ_j a_ij v_j,
//!
//! where r are the right-hand sides of these rows, and the velocities solve a system of half the size,
//!
//!   v_i − Σ_k [h a_ik D_k + h² s (Σ_j a_ij a_jk K_j)] v_k = ρ_i + h Σ_j a_ij K_j r_j.
//!
//! Its factors take about an eighth of the time.

use nalgebra::linalg::LU;
use nalgebra::{DMatrix, Dyn};

use quietcut_numerics::quadrature::Gauss;

/// Factors of the matrix I − h a⊗J of a subinterval, with its duration h, the Gauss integrals a and the Jacobians J at
/// the nodes.
pub(super) enum CollocationMatrix {
    /// LU factors of the whole matrix.
    Whole(LU<f64, Dyn, Dyn>),
    /// LU factors of the equations of the velocities.
    Velocities(Velocities),
}

/// Equations of the velocities at the nodes, after the displacements are eliminated. The unknowns are ordered by
/// velocity, and by node within each.
pub(super) struct Velocities {
    /// Rate s of the displacements per velocity state, 1/s.
    rate: f64,
    /// Gauss integrals a times the duration h, s.
    integrals_s: DMatrix<f64>,
    /// Jacobians [0, sI; K, D] at the nodes, 1/s.
    jacobians: Vec<DMatrix<f64>>,
    factored: LU<f64, Dyn, Dyn>,
}

impl CollocationMatrix {
    /// Factors the matrix of the collocation equations.
    pub(super) fn new(gauss: &Gauss, duration_s: f64, jacobians: &[DMatrix<f64>]) -> Self {
        if let Some(rate) = displacement_rate(jacobians) {
            return Self::Velocities(Velocities::new(gauss, duration_s, rate, jacobians));
        }
        let (order, nodes) = (jacobians[0].nrows(), gauss.nodes.len());
        let mut matrix = DMatrix::identity(order * nodes, order * nodes);
        for i in 0..nodes {
            for (j, jacobian) in jacobians.iter().enumerate() {
                let weight = duration_s * gauss.integrals[(i, j)];
                let mut block = matrix.view_mut((i * order, j * order), (order, order));
                block.zip_apply(jacobian, |entry, value| *entry -= weight * value);
            }
        }
        Self::Whole(matrix.lu())
    }

    /// Solves the collocation equations in place, (n m) × columns; false if they are singular.
    pub(super) fn solve_mut(&self, right: &mut DMatrix<f64>) -> bool {
        match self {
            Self::Whole(factored) => factored.solve_mut(right),
            Self::Velocities(velocities) => velocities.solve_mut(right),
        }
    }
}

/// Rate s for which the upper half of every Jacobian is [0, sI]; `None` if there is none.
fn displacement_rate(jacobians: &[DMatrix<f64>]) -> Option<f64> {
    let size = jacobians.first()?.nrows() / 2;
    let rate = *jacobians.first()?.get((0, size))?;
    let is_second_order = |jacobian: &DMatrix<f64>| {
        jacobian.nrows() == 2 * size
            && (0..2 * size).all(|column| {
                (0..size).all(|row| jacobian[(row, column)] == if column == size + row { rate } else { 0.0 })
            })
    };
    jacobians.iter().all(is_second_order).then_some(rate)
}

impl Velocities {
    fn new(gauss: &Gauss, duration_s: f64, rate: f64, jacobians: &[DMatrix<f64>]) -> Self {
        let (size, nodes) = (jacobians[0].nrows() / 2, gauss.nodes.len());
        let integrals_s = &gauss.integrals * duration_s;
        let mut matrix = DMatrix::identity(size * nodes, size * nodes);
        let mut weighted = integrals_s.clone();
        for (row, column) in (0..size).flat_map(|row| (0..size).map(move |column| (row, column))) {
            // Column j of the integrals times an entry of the Jacobian at node j.
            let weigh = |weighted: &mut DMatrix<f64>, factor: f64, entry: (usize, usize)| {
                let columns = weighted.as_mut_slice().chunks_exact_mut(nodes);
                let integrals = integrals_s.as_slice().chunks_exact(nodes);
                for ((column, integrals), jacobian) in columns.zip(integrals).zip(jacobians) {
                    let weight = factor * jacobian[entry];
                    for (value, integral) in column.iter_mut().zip(integrals) {
                        *value = weight * integral;
                    }
                }
            };
            let mut block = matrix.view_mut((row * nodes, column * nodes), (nodes, nodes));
            weigh(&mut weighted, 1.0, (size + row, size + column));
            block -= &weighted;
            weigh(&mut weighted, rate, (size + row, column));
            block.gemm(-1.0, &weighted, &integrals_s, 1.0);
        }
        Self {
            rate,
            integrals_s,
            jacobians: jacobians.to_vec(),
            factored: matrix.lu(),
        }
    }

    fn solve_mut(&self, right: &mut DMatrix<f64>) -> bool {
        let (size, nodes, columns) = (self.jacobians[0].nrows() / 2, self.jacobians.len(), right.ncols());
        // Each of these matrices has one row for each node, and one column for each state and column of `right`.
        let mut displacements = DMatrix::zeros(nodes, size * columns);
        let mut velocities = DMatrix::zeros(nodes, size * columns);
        let mut pushes = DMatrix::zeros(nodes, size * columns);
        for (column, entries) in right.column_iter().enumerate() {
            let entries = entries.as_slice().chunks_exact(2 * size);
            for (node, (entries, jacobian)) in entries.zip(&self.jacobians).enumerate() {
                for row in 0..size {
                    let at = column * size + row;
                    displacements[(node, at)] = entries[row];
                    velocities[(node, at)] = entries[size + row];
                    pushes[(node, at)] = (0..size)
                        .map(|from| jacobian[(size + row, from)] * entries[from])
                        .sum();
                }
            }
        }
        velocities.gemm(1.0, &self.integrals_s, &pushes, 1.0);
        let mut velocities = velocities.reshape_generic(Dyn(nodes * size), Dyn(columns));
        if !self.factored.solve_mut(&mut velocities) {
            return false;
        }
        let velocities = velocities.reshape_generic(Dyn(nodes), Dyn(size * columns));
        displacements.gemm(self.rate, &self.integrals_s, &velocities, 1.0);
        for (column, mut entries) in right.column_iter_mut().enumerate() {
            let entries = entries.as_mut_slice().chunks_exact_mut(2 * size);
            for (node, entries) in entries.enumerate() {
                for row in 0..size {
                    let at = column * size + row;
                    entries[row] = displacements[(node, at)];
                    entries[size + row] = velocities[(node, at)];
                }
            }
        }
        true
    }
}

#[cfg(test)]
mod tests;
