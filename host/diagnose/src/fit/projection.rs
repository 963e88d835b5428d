//! Uncertain parameters of the baseline projected out of the steps of a search (Golub and Pereyra, 1973).
//!
//! A cause may have almost the effect of an uncertain parameter z of the baseline, as a change of the stiffness has. Along the
//! valley between both, χ² changes only by what the case states of z, and a damping in proportion to the diagonal of the normal
//! matrix would allow no step. With z′ = z + N_zz⁻¹ N_zb·b in place of z the normal matrix has the blocks N_bb − N_bz N_zz⁻¹ N_zb
//! and N_zz, and a step in b takes z along.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::fit::unknowns::{FitProblem, FreeParameter};

/// The places of both kinds of parameters, and their coupling.
pub(crate) struct Projection {
    /// Places of the uncertain parameters of the baseline.
    uncertain: Vec<usize>,
    /// Places of all others.
    others: Vec<usize>,
    /// N_zz⁻¹ N_zb.
    coupling: DMatrix<f64>,
}

impl Projection {
    /// `None` if the baseline has no uncertain parameters, or nothing else is fitted.
    pub(crate) fn new(problem: &FitProblem<'_>, normal: &DMatrix<f64>) -> Option<Self> {
        let (uncertain, others): (Vec<usize>, Vec<usize>) = (0..problem.slots.len())
            .partition(|place| matches!(problem.slots[*place].0, FreeParameter::Baseline(_)));
        if uncertain.is_empty() || others.is_empty() {
            return None;
        }
        let rows = normal.select_rows(&uncertain);
        let own = Cholesky::new(rows.select_columns(&uncertain))?;
        let coupling = own.solve(&rows.select_columns(&others));
        Some(Self {
            uncertain,
            others,
            coupling,
        })
    }

    /// Gives the normal matrix and the gradient in z′ and b.
    pub(crate) fn separate(&self, normal: &mut DMatrix<f64>, gradient: &mut DVector<f64>) {
        let mixed = normal.select_rows(&self.uncertain).select_columns(&self.others);
        let taken = mixed.tr_mul(&self.coupling);
        let of_uncertain = gradient.select_rows(&self.uncertain);
        let pulled = self.coupling.tr_mul(&of_uncertain);
        for (i, &row) in self.others.iter().enumerate() {
            gradient[row] -= pulled[i];
            for (j, &column) in self.others.iter().enumerate() {
                normal[(row, column)] -= taken[(i, j)];
            }
            for &column in &self.uncertain {
                normal[(row, column)] = 0.0;
                normal[(column, row)] = 0.0;
            }
        }
    }

    /// A step in z and b from one in z′ and b.
    pub(crate) fn whole(&self, step: &DVector<f64>) -> DVector<f64> {
        let mut whole = step.clone();
        let along = &self.coupling * step.select_rows(&self.others);
        for (along, &place) in along.iter().zip(&self.uncertain) {
            whole[place] -= along;
        }
        whole
    }
}
