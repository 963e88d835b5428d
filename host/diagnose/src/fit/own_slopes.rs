//! Cuts: the last steps of a fit, with the slopes of the extended case itself.
//!
//! The chord method (`relinearization`) keeps the slopes of the baseline. Where a cause moves the machine far from it, as a mass that
//! shifts a resonance across a harmonic of the teeth, these are of another machine: steps are too short or too long, and intervals
//! are those of the other machine. Here slopes are differences of readings with the extended case, so that
//! θ ← θ + λ (JᵀJ)⁻¹Jᵀ r(θ), J = −∂r/∂θ at θ, are Gauss and Newton's steps proper; λ becomes smaller until one gains.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::fit::candidate_model::ExtendedPrediction;
use crate::fit::candidate_model::{CandidateModel, Simulated};
use crate::fit::library::Library;
use crate::fit::regression::{Regression, Subset};
use crate::fit::relinearization::Relinearization;

/// Steps at most.
const ROUNDS: usize = 5;
/// Shares of a step that are tried.
const SHARES: [f64; 2] = [1.0, 0.3];
/// A step that promises less than this of χ² is not taken.
const SETTLED: f64 = 0.5;
/// By what a difference moves the readings, as a share of the root of what is left; and no less than this, in units of the noise.
const MOVED: f64 = 0.03;
const LEAST_MOVED: f64 = 1.0;

/// Slopes at some parameters, those of coefficients before those of shapes.
struct Slopes {
    /// (JᵀJ)⁻¹.
    covariance: DMatrix<f64>,
    /// The step to where least is left, to first order.
    change: Vec<f64>,
    /// What it takes of χ².
    taken: f64,
}

impl Relinearization<'_> {
    /// The explanation where its own slopes end, with its covariance by these; `None` where it cannot be read.
    pub(crate) fn by_own_slopes(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        explanation: &CandidateModel,
    ) -> Option<CandidateModel> {
        let shapes = library.slopes_of(self.study, regression, explanation);
        let mut at = explanation.clone();
        let mut known = explanation.simulated.as_ref()?.reading.clone()?;
        let mut now = self.again(library, &at, &known)?;
        at.fit.left = left_of(regression, &now);
        let mut slopes = self.own_slopes(library, regression, &at, &shapes, (&known, &now))?;
        for _ in 0..ROUNDS {
            if slopes.taken < SETTLED {
                break;
            }
            let next = SHARES.into_iter().find_map(|share| {
                let change: Vec<f64> = slopes.change.iter().map(|change| share * change).collect();
                let mut next = self.moved(library, regression, &at, &shapes, &change)?;
                let reading = self.again(library, &next, &now)?;
                next.fit.left = left_of(regression, &reading);
                (next.fit.left < at.fit.left).then_some((next, reading))
            });
            let Some((next, reading)) = next else { break };
            at = next;
            known = std::mem::replace(&mut now, reading);
            slopes = self.own_slopes(library, regression, &at, &shapes, (&known, &now))?;
        }
        at.simulated = Some(Simulated {
            covariance: by_choice(library, &at, &shapes, &slopes.covariance),
            starts: Vec::new(),
            baseline: None,
            steps: Vec::new(),
            reading: Some(now),
        });
        Some(at)
    }

    /// The recordings with the extended case along the motion that was predicted before.
    fn again(
        &self,
        library: &Library,
        at: &CandidateModel,
        known: &ExtendedPrediction,
    ) -> Option<Arc<ExtendedPrediction>> {
        let extensions = library.extensions(self.study, at)?;
        self.read(&extensions, Some(&known.predicted)).map(Arc::new)
    }

    /// The slopes at a reading; `known` is the one before, from whose motion those beside it are read too.
    fn own_slopes(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        at: &CandidateModel,
        shapes: &[Vec<usize>],
        (known, now): (&ExtendedPrediction, &ExtendedPrediction),
    ) -> Option<Slopes> {
        let mut of_baseline = library.columns_of(at);
        of_baseline.extend(shapes.iter().flatten());
        let left = whitened(regression, &now.residuals);
        let moved = (MOVED * left.norm()).max(LEAST_MOVED);
        let mut jacobian = DMatrix::zeros(left.len(), of_baseline.len());
        for parameter in 0..of_baseline.len() {
            let step = moved / regression.length(Subset::Whole, of_baseline[parameter]);
            // Where a step leaves what is physical, the other way is taken.
            let (beside, step) = [step, -step].into_iter().find_map(|step| {
                let mut change = vec![0.0; of_baseline.len()];
                change[parameter] = step;
                let beside = self.moved(library, regression, at, shapes, &change)?;
                Some((self.again(library, &beside, known)?, step))
            })?;
            let slope = (&left - whitened(regression, &beside.residuals)) / step;
            jacobian.set_column(parameter, &slope);
        }
        solved(&jacobian, &left)
    }
}

/// The step and its covariance; `None` where columns are one and the same, or nothing. Columns are of one length while they are
/// solved for: parameters are in many units.
fn solved(jacobian: &DMatrix<f64>, left: &DVector<f64>) -> Option<Slopes> {
    let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    if lengths
        .iter()
        .any(|length| !(*length > 0.0 && length.is_finite()))
    {
        return None;
    }
    let mut even = jacobian.clone();
    for (mut column, length) in even.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    let right = even.tr_mul(left);
    let factor = even.tr_mul(&even).cholesky()?;
    let step = factor.solve(&right);
    let inverse = factor.inverse();
    let size = lengths.len();
    Some(Slopes {
        covariance: DMatrix::from_fn(size, size, |i, j| inverse[(i, j)] / (lengths[i] * lengths[j])),
        taken: step.dot(&right),
        change: step
            .iter()
            .zip(&lengths)
            .map(|(step, length)| step / length)
            .collect(),
    })
}

fn whitened(regression: &Regression, residuals: &[Vec<Vec<f64>>]) -> DVector<f64> {
    let parts = regression.whitened(Subset::Whole, residuals);
    DVector::from_vec(parts.into_iter().flat_map(|(_, part)| part).collect())
}

fn left_of(regression: &Regression, reading: &ExtendedPrediction) -> f64 {
    whitened(regression, &reading.residuals).norm_squared()
}

/// By choice: coefficients and behind them the shape, out of the covariance of all coefficients and behind them all shapes.
fn by_choice(
    library: &Library,
    at: &CandidateModel,
    shapes: &[Vec<usize>],
    all: &DMatrix<f64>,
) -> Vec<DMatrix<f64>> {
    let (mut coefficient, mut shape) = (0, at.fit.coefficients.len());
    (0..at.choices.len())
        .map(|position| {
            let (own, of_shape) = (library.coefficients(at, position).len(), shapes[position].len());
            let rows: Vec<usize> = (coefficient..coefficient + own)
                .chain(shape..shape + of_shape)
                .collect();
            coefficient += own;
            shape += of_shape;
            DMatrix::from_fn(rows.len(), rows.len(), |i, j| all[(rows[i], rows[j])])
        })
        .collect()
}
