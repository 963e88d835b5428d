//! Uncertain parameters of the baseline in a regression: fitted with every set of regression columns, within what the case states.
//!
//! With the whitened derivatives J of the readings by the standard normal variables z, at z = z₀ of the baseline, a fit of
//! columns X has the least of |r − Xb − J·Δ|² + |z₀ + Δ|². Over Δ that is a fit whose inner products are aᵀb − s_aᵀs_b, with
//! s_a = L⁻¹Jᵀa and L·Lᵀ = 1 + JᵀJ; of the residual s_r = L⁻¹(Jᵀr − z₀), and |z₀|² is added to its square.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use crate::candidates::altered_structure::{AlteredStructure, response_to};
use crate::fit::segment::{Segment, Subset};
use crate::records::study::Study;
use crate::signal::dot::dot;

/// Change of a variable, in its standard deviations, for the central difference of the readings. Derivatives of a cause that
/// changes the same parameter must agree with these beyond what the records resolve, 1/J of the whitened derivatives J (1e-5 of
/// a standard deviation, and less, in long records), so that their common direction is paid for by the prior alone. Near a
/// resonance of quality Q the relative error of a relative change δ is (Qδ)².
const STEP: f64 = 1e-4;

/// The subsets of segments.
const SUBSETS: [Subset; 3] = [Subset::Fitted, Subset::HeldOut, Subset::Whole];

/// The uncertain parameters in one subset of segments.
struct OfSubset {
    /// 1 + JᵀJ.
    factor: Cholesky<f64, Dyn>,
    /// s_r.
    residual: DVector<f64>,
    /// s_x of each regression column.
    columns: Vec<DVector<f64>>,
}

/// The uncertain parameters of the baseline of a study.
pub(crate) struct Nuisances {
    at: DVector<f64>,
    /// Whitened derivatives of the readings, by variable and segment.
    slopes: Vec<Vec<Vec<f64>>>,
    of_subsets: Vec<OfSubset>,
}

impl Nuisances {
    /// `None` if the study has no uncertain parameters.
    pub(crate) fn new(study: &Study<'_>, segments: &[Segment]) -> Option<Self> {
        let uncertain = &study.uncertain;
        if uncertain.len() == 0 {
            return None;
        }
        let slopes = (0..uncertain.len())
            .into_par_iter()
            .map(|variable| {
                let readings = readings(study, variable);
                segments
                    .iter()
                    .map(|segment| segment.whiten(&readings[segment.record]))
                    .collect()
            })
            .collect();
        Some(Self {
            at: uncertain.at.clone(),
            slopes,
            of_subsets: Vec::new(),
        })
    }

    /// Begins with the residuals of the segments and without regression columns.
    pub(crate) fn start(&mut self, segments: &[Segment], residuals: &[Vec<f64>]) {
        let size = self.slopes.len();
        self.of_subsets = SUBSETS
            .into_iter()
            .filter_map(|subset| {
                let own = || (0..segments.len()).filter(move |index| segments[*index].subset == subset);
                let information = DMatrix::from_fn(size, size, |i, j| {
                    let of_prior = if i == j { 1.0 } else { 0.0 };
                    of_prior
                        + own()
                            .map(|segment| dot(&self.slopes[i][segment], &self.slopes[j][segment]))
                            .sum::<f64>()
                });
                let factor = Cholesky::new(information)?;
                let right = self.projected(own(), residuals) - &self.at;
                let residual = factor.l_dirty().solve_lower_triangular(&right)?;
                Some(OfSubset {
                    factor,
                    residual,
                    columns: Vec::new(),
                })
            })
            .collect();
        // Finite derivatives give a positive definite matrix.
        debug_assert_eq!(self.of_subsets.len(), SUBSETS.len());
    }

    /// Jᵀ times what the segments numbered `own` hold.
    fn projected(&self, own: impl Iterator<Item = usize>, values: &[Vec<f64>]) -> DVector<f64> {
        let mut sum = DVector::zeros(self.slopes.len());
        for segment in own {
            for (sum, slopes) in sum.iter_mut().zip(&self.slopes) {
                *sum += dot(&slopes[segment], &values[segment]);
            }
        }
        sum
    }

    /// Takes the next regression column, whitened, by segment.
    pub(crate) fn add(&mut self, segments: &[Segment], column: &[Vec<f64>]) {
        for (number, subset) in SUBSETS.into_iter().enumerate() {
            let own = (0..segments.len()).filter(|index| segments[*index].subset == subset);
            let right = self.projected(own, column);
            let of_subset = &mut self.of_subsets[number];
            let taken = of_subset
                .factor
                .l_dirty()
                .solve_lower_triangular(&right)
                .unwrap_or_else(|| DVector::zeros(right.len()));
            of_subset.columns.push(taken);
        }
    }

    /// By subset: what the square of the residual gains.
    pub(crate) fn of_residual(&self) -> impl Iterator<Item = f64> {
        let prior = self.at.norm_squared();
        self.of_subsets
            .iter()
            .map(move |own| prior - own.residual.norm_squared())
    }

    /// How much less a fit of the parameters alone would leave in a subset.
    pub(crate) fn promised(&self, subset: usize) -> f64 {
        self.of_subsets[subset].residual.norm_squared()
    }

    /// By subset: what the square of a regression column and its product with the residual lose.
    pub(crate) fn of_column(&self, column: usize) -> impl Iterator<Item = [f64; 2]> {
        self.of_subsets.iter().map(move |own| {
            let taken = &own.columns[column];
            [taken.norm_squared(), taken.dot(&own.residual)]
        })
    }

    /// What the product of two regression columns loses in a subset.
    pub(crate) fn between(&self, subset: usize, i: usize, j: usize) -> f64 {
        let columns = &self.of_subsets[subset].columns;
        columns[i].dot(&columns[j])
    }

    /// The derivatives, by variable and segment.
    pub(crate) fn columns_mut(&mut self) -> impl Iterator<Item = &mut Vec<Vec<f64>>> {
        self.slopes.iter_mut()
    }

    /// Δ with these coefficients of regression columns, and its covariance with theirs.
    pub(crate) fn after(
        &self,
        subset: usize,
        columns: &[usize],
        coefficients: &[f64],
        covariance: &DMatrix<f64>,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let own = &self.of_subsets[subset];
        let mut right = own.residual.clone();
        let mut mixed = DMatrix::zeros(right.len(), columns.len());
        for (index, (column, coefficient)) in columns.iter().zip(coefficients).enumerate() {
            right -= &own.columns[*column] * *coefficient;
            mixed.set_column(index, &own.columns[*column]);
        }
        // L⁻ᵀ s for every s.
        let lower = own.factor.l();
        let back = |of: DMatrix<f64>| lower.tr_solve_lower_triangular(&of).unwrap_or(of);
        let change = back(DMatrix::from_column_slice(right.len(), 1, right.as_slice()));
        let mixed = back(mixed);
        let covariance = own.factor.inverse() + &mixed * covariance * mixed.transpose();
        (change.column(0).into_owned(), covariance)
    }
}

/// Derivative of the readings by a variable, by record, channel and sample; zero if the structures beside the baseline are
/// not possible.
fn readings(study: &Study<'_>, variable: usize) -> Vec<Vec<Vec<f64>>> {
    let uncertain = &study.uncertain;
    let beside = |step: f64| {
        let mut z = uncertain.at.clone();
        z[variable] += step;
        let structure = uncertain.structure(study.baseline.case, &z)?;
        AlteredStructure::new(&structure, &study.baseline.effects).ok()
    };
    let ends = beside(-STEP).zip(beside(STEP));
    study
        .records
        .iter()
        .map(|record| match &ends {
            Some((below, above)) => response_to(study, record, [below, above], 2.0 * STEP),
            None => vec![vec![0.0; record.grid.count()]; record.channels.len()],
        })
        .collect()
}
