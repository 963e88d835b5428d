//! The free parameters of a prediction-error fit, and the steps of its search.

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::least_squares::{Idle, NormalEquations};

use crate::candidates::closed_loop::Extended;
use crate::fit::candidate_model::Choice;
use crate::fit::library::Library;
use crate::records::study::Study;
use crate::signal::dot::dot;
use quietcut_simulate::Effects;

/// Values of all parameters and initial states of a candidate model.
#[derive(Clone, Debug)]
pub(crate) struct ParameterPoint {
    /// The uncertain parameters of the baseline, in their standard deviations from the case.
    pub(crate) baseline: DVector<f64>,
    /// For each cause of the candidate model: its coefficients, followed by its nonlinear parameters.
    pub(crate) inner: Vec<Vec<f64>>,
    /// For each record: the initial state of the simulation; empty for a start from rest.
    pub(crate) starts: Vec<Vec<f64>>,
}

/// One parameter of a cause, or one component of an initial state, that is fitted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum FreeParameter {
    /// Number of an uncertain parameter of the baseline.
    Baseline(usize),
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

/// A candidate model with its free parameters, each with the step of its finite difference.
pub(crate) struct FitProblem<'a> {
    pub(crate) library: &'a Library,
    pub(crate) choices: &'a [Choice],
    pub(crate) slots: Vec<(FreeParameter, f64)>,
    /// Smallest step of a finite difference with respect to a parameter of a cause, relative to that parameter. Initial
    /// states have a limit of their own.
    pub(crate) least_step: f64,
    /// Smallest step of a finite difference with respect to an uncertain parameter of the baseline, in its standard deviations.
    pub(crate) least_baseline_step: f64,
}

/// Result of a search for a candidate model's parameters: their values, χ² there and the normal matrix.
pub(crate) struct SearchResult {
    pub(crate) point: ParameterPoint,
    pub(crate) left: f64,
    /// Normal matrix Jᵀ J of the free parameters from the last linearization, at the end of the search or one step
    /// before; rows and columns of parameters that [`at_bounds`] fixes are zero.
    pub(crate) normal: DMatrix<f64>,
}

impl FreeParameter {
    pub(crate) fn of(self, point: &mut ParameterPoint) -> &mut f64 {
        match self {
            Self::Baseline(index) => &mut point.baseline[index],
            Self::Inner { choice, index, .. } => &mut point.inner[choice][index],
            Self::Start { record, index } => &mut point.starts[record][index],
        }
    }

    /// True if this free parameter changes the simulated response of the record with index `record`: an initial state
    /// changes only its own record.
    pub(crate) fn affects(self, record: usize) -> bool {
        match self {
            Self::Baseline(_) | Self::Inner { .. } => true,
            Self::Start { record: own, .. } => own == record,
        }
    }
}

impl FitProblem<'_> {
    /// The free parameters of causes, without the initial states.
    pub(crate) fn inner(&self) -> impl Iterator<Item = FreeParameter> {
        let slots = self.slots.iter().map(|(slot, _)| *slot);
        slots.filter(|slot| matches!(slot, FreeParameter::Inner { .. }))
    }

    /// The extended case with the parameters of `point`; `None` if they are not physical, or not possible as effects.
    pub(crate) fn extended(&self, study: &Study<'_>, point: &ParameterPoint) -> Option<Extended> {
        let uncertain = &study.uncertain;
        let structure = if point.baseline == uncertain.at {
            None
        } else {
            Some(uncertain.structure(study.baseline.case, &point.baseline)?)
        };
        Some(Extended {
            effects: self.effects(study, point)?,
            structure,
        })
    }

    fn effects(&self, study: &Study<'_>, point: &ParameterPoint) -> Option<Effects> {
        let Self { library, choices, .. } = self;
        let mut tables = Vec::new();
        for (choice, inner) in choices.iter().zip(&point.inner) {
            let known = &library.candidates[choice.candidate];
            let (nonlinear_parameters, columns) = &known.variants[choice.variant];
            let (coefficients, moved) = inner.split_at(columns.len());
            debug_assert_eq!(moved.len(), nonlinear_parameters.len());
            let cause = library.cause(choice.candidate);
            let parameters = cause.parameters(study, &known.location, moved, coefficients)?;
            let parts = cause.located_effects(&known.location, &parameters);
            tables.extend(parts.into_iter().map(|part| (part.name, part.extension)));
        }
        Effects::of_extensions(tables.iter().map(|(name, table)| (*name, table))).ok()
    }
}

/// χ² of all records from their whitened residuals, and of the uncertain parameters of the baseline.
pub(crate) fn energy(residuals: &[Vec<f64>], point: &ParameterPoint) -> f64 {
    let of_records: f64 = residuals.iter().map(|residual| dot(residual, residual)).sum();
    of_records + point.baseline.norm_squared()
}

/// The parameter values after the step `step` of the free parameters from `point`, limited to the bounds of the
/// parameters.
pub(crate) fn stepped(
    problem: &FitProblem<'_>,
    point: &ParameterPoint,
    step: &DVector<f64>,
) -> ParameterPoint {
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
    next
}

/// Ridge added to the unit diagonal of the scaled normal equations of a prediction-error search.
pub(crate) const RIDGE: f64 = 1e-12;

/// Decrease of χ² by a whole Gauss–Newton step, predicted by the linearized model; 0 if its equations cannot be solved.
pub(crate) fn predicted(normal: &DMatrix<f64>, gradient: &DVector<f64>) -> f64 {
    NormalEquations::new(normal, 1e-9, Idle::Hold).map_or(0.0, |equations| equations.explained(gradient))
}

/// Fixes every parameter of a cause that lies at one of its bounds and whose gradient leads out of the bounds: its
/// entry in `gradient` and its row and column in `normal` become zero.
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

/// (Jᵀ J)⁻¹: covariance of the free parameters for unit-variance noise; zero for a fixed parameter. `None` if the
/// matrix cannot be inverted.
pub(crate) fn covariance(normal: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    Some(NormalEquations::new(normal, RIDGE, Idle::Hold)?.inverse())
}

/// The uncertain parameters of the baseline, in their standard deviations from the case, and their covariance; `None` without
/// such parameters, or if the normal matrix cannot be inverted.
pub(crate) fn of_baseline(
    slots: &[FreeParameter],
    found: &SearchResult,
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let places: Vec<usize> = (0..slots.len())
        .filter(|place| matches!(slots[*place], FreeParameter::Baseline(_)))
        .collect();
    if places.is_empty() {
        return None;
    }
    let own = covariance(&found.normal)?
        .select_rows(&places)
        .select_columns(&places);
    Some((found.point.baseline.clone(), own))
}

/// For each cause of the candidate model: covariance of its parameters for unit-variance noise, with the initial states
/// unknown; zero for a fixed parameter, and throughout if the normal matrix cannot be inverted.
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
