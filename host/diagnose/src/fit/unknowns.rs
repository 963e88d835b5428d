//! What an output-error fit may move, and the steps that it takes.

use nalgebra::{DMatrix, DVector};

use crate::fit::candidate_model::Choice;
use crate::fit::library::Library;
use crate::records::study::Study;
use crate::signal::dot::dot;
use quietcut_simulate::Effects;

/// Parameters and initial states.
#[derive(Clone, Debug)]
pub(crate) struct ParameterPoint {
    /// By choice: coefficients and, behind them, the shape.
    pub(crate) inner: Vec<Vec<f64>>,
    /// By record: states at its start; empty where it starts from rest.
    pub(crate) starts: Vec<Vec<f64>>,
}

/// One number of a point that may move.
#[derive(Clone, Copy, Debug)]
pub(crate) enum FreeParameter {
    Inner {
        choice: usize,
        index: usize,
        bounds: [f64; 2],
    },
    Start {
        record: usize,
        index: usize,
    },
}

/// What is fitted: causes, and which numbers may move, each with the step of its difference.
pub(crate) struct FitProblem<'a> {
    pub(crate) library: &'a Library,
    pub(crate) choices: &'a [Choice],
    pub(crate) slots: Vec<(FreeParameter, f64)>,
    /// Least step of a difference, as a share of its parameter.
    pub(crate) least_step: f64,
}

/// Where a search ended.
pub(crate) struct SearchResult {
    pub(crate) point: ParameterPoint,
    pub(crate) left: f64,
    /// Jᵀ J of the slots.
    pub(crate) normal: DMatrix<f64>,
}

impl FreeParameter {
    pub(crate) fn of(self, point: &mut ParameterPoint) -> &mut f64 {
        match self {
            Self::Inner { choice, index, .. } => &mut point.inner[choice][index],
            Self::Start { record, index } => &mut point.starts[record][index],
        }
    }

    /// False where a record does not feel it.
    pub(crate) fn is_felt_by(self, record: usize) -> bool {
        match self {
            Self::Inner { .. } => true,
            Self::Start { record: own, .. } => own == record,
        }
    }
}

impl FitProblem<'_> {
    /// What may move besides the states at the start.
    pub(crate) fn inner(&self) -> impl Iterator<Item = FreeParameter> {
        let slots = self.slots.iter().map(|(slot, _)| *slot);
        slots.filter(|slot| matches!(slot, FreeParameter::Inner { .. }))
    }

    /// The effects at a point; `None` where it is not physical.
    pub(crate) fn effects(&self, study: &Study<'_>, point: &ParameterPoint) -> Option<Effects> {
        let Self { library, choices, .. } = self;
        let mut tables = Vec::new();
        for (choice, inner) in choices.iter().zip(&point.inner) {
            let known = &library.candidates[choice.candidate];
            let (nonlinear_parameters, columns) = &known.variants[choice.variant];
            let (coefficients, moved) = inner.split_at(columns.len());
            debug_assert_eq!(moved.len(), nonlinear_parameters.len());
            let cause = library.cause(choice.candidate);
            let parameters = cause.parameters(study, &known.location, moved, coefficients)?;
            let parts = cause.parts(&known.location, &parameters);
            tables.extend(parts.into_iter().map(|part| (part.name, part.extension)));
        }
        Effects::of_extensions(tables.iter().map(|(name, table)| (*name, table))).ok()
    }
}

/// Σ r² over all records.
pub(crate) fn energy(residuals: &[Vec<f64>]) -> f64 {
    residuals.iter().map(|residual| dot(residual, residual)).sum()
}

/// (Jᵀ J + trust·diag) step = Jᵀ r, taken within the bounds; `None` where that has no solution.
pub(crate) fn stepped(
    problem: &FitProblem<'_>,
    point: &ParameterPoint,
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    trust: f64,
) -> Option<ParameterPoint> {
    let step = scaled(normal, 1e-12 + trust)?.solve(&gradient.component_mul(&roots(normal)));
    let step = step.component_mul(&roots(normal));
    let mut next = point.clone();
    for ((slot, _), step) in problem.slots.iter().zip(step.iter()) {
        let value = slot.of(&mut next);
        *value += step;
        if let FreeParameter::Inner {
            bounds: [low, high], ..
        } = slot
        {
            *value = value.clamp(*low, *high);
        }
    }
    Some(next)
}

/// What a whole step takes of χ², to first order.
pub(crate) fn predicted(normal: &DMatrix<f64>, gradient: &DVector<f64>) -> f64 {
    let right = gradient.component_mul(&roots(normal));
    scaled(normal, 1e-9).map_or(0.0, |factor| right.dot(&factor.solve(&right)))
}

/// What stands at a bound and is pushed beyond it stays there.
pub(crate) fn at_bounds(
    problem: &FitProblem<'_>,
    point: &ParameterPoint,
    normal: &mut DMatrix<f64>,
    gradient: &mut DVector<f64>,
) {
    for (index, (slot, _)) in problem.slots.iter().enumerate() {
        let FreeParameter::Inner {
            bounds: [low, high], ..
        } = slot
        else {
            continue;
        };
        let value = *slot.of(&mut point.clone());
        if (value <= *low && gradient[index] < 0.0) || (value >= *high && gradient[index] > 0.0) {
            gradient[index] = 0.0;
            normal.row_mut(index).fill(0.0);
            normal.column_mut(index).fill(0.0);
        }
    }
}

/// One over the roots of the diagonal; zero where nothing is felt.
fn roots(normal: &DMatrix<f64>) -> DVector<f64> {
    normal.diagonal().map(|entry| {
        if entry > 0.0 && entry.is_finite() {
            entry.sqrt().recip()
        } else {
            0.0
        }
    })
}

/// The matrix with a diagonal of one and `ridge` on it, factored.
fn scaled(normal: &DMatrix<f64>, ridge: f64) -> Option<nalgebra::Cholesky<f64, nalgebra::Dyn>> {
    let roots = roots(normal);
    let mut scaled = DMatrix::from_fn(normal.nrows(), normal.ncols(), |i, j| {
        normal[(i, j)] * roots[i] * roots[j]
    });
    for i in 0..scaled.nrows() {
        scaled[(i, i)] = 1.0 + ridge;
    }
    scaled.cholesky()
}

/// The inverse of Jᵀ J: the covariance of the slots for noise of deviation 1; zero for what does not move.
pub(crate) fn covariance(normal: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let roots = roots(normal);
    let inverse = scaled(normal, 1e-12)?.inverse();
    Some(DMatrix::from_fn(normal.nrows(), normal.ncols(), |i, j| {
        inverse[(i, j)] * roots[i] * roots[j]
    }))
}

/// Covariance for noise of deviation 1 of the numbers of each choice, initial states being unknown; zero for what did not move.
pub(crate) fn by_choice(slots: &[FreeParameter], found: &SearchResult) -> Vec<DMatrix<f64>> {
    let mut all: Vec<DMatrix<f64>> = found
        .point
        .inner
        .iter()
        .map(|inner| DMatrix::zeros(inner.len(), inner.len()))
        .collect();
    let Some(covariance) = covariance(&found.normal) else {
        return all;
    };
    for (i, first) in slots.iter().enumerate() {
        for (j, second) in slots.iter().enumerate() {
            if let (
                FreeParameter::Inner { choice, index, .. },
                FreeParameter::Inner {
                    choice: other,
                    index: second,
                    ..
                },
            ) = (first, second)
                && choice == other
            {
                all[*choice][(*index, *second)] = covariance[(i, j)];
            }
        }
    }
    all
}
