//! Robust linear least squares: iteratively reweighted.

use nalgebra::DVector;

use super::{LeastSquaresError, LinearFit, LinearProblem};

/// Rounds of reweighting; ten are usual.
const ROUNDS_MAX: usize = 100;

/// Change of the parameters, in standard deviations, below which the weights have settled.
const SETTLED: f64 = 1e-6;

/// The median absolute deviation of a normal distribution is 1/1.4826 of its standard deviation.
const MEDIAN_TO_DEVIATION: f64 = 1.482_602_218_505_602;

/// The loss ρ of a residual over its scale, by its weight ψ(u)/u. Both have 95 % efficiency with normal noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// Huber's: linear beyond 1.345 scales. Convex, with one minimum.
    Huber,
    /// Tukey's biweight: constant beyond 4.685 scales; it starts from the solution of Huber's.
    Tukey,
}

impl Loss {
    fn weight(self, u: f64) -> f64 {
        match self {
            Self::Huber => (1.345 / u.abs()).min(1.0),
            Self::Tukey => (1.0 - (u / 4.685).powi(2)).max(0.0).powi(2),
        }
    }
}

/// A robust fit with the weight that each row kept.
#[derive(Clone, Debug, PartialEq)]
pub struct RobustFit {
    /// The fit with the last weights.
    pub fit: LinearFit,
    /// The share, 0 … 1, of the weight of each row that is kept; 0 is an outlier.
    pub kept: DVector<f64>,
    /// The robust scale of the weighted residuals, in their unit.
    pub scale: f64,
    /// False where the weights still moved at the last round.
    pub is_settled: bool,
}

impl LinearProblem<'_> {
    /// The least sum of ρ(rᵢ √wᵢ / scale), the scale from the median absolute residual of each round (Huber and Ronchetti,
    /// *Robust Statistics*, 2nd edition, 7.8).
    ///
    /// # Errors
    /// See [`LeastSquaresError`]; also where outliers leave fewer rows than parameters.
    pub fn solve_robust(&self, loss: Loss) -> Result<RobustFit, LeastSquaresError> {
        let (first, rounds) = match loss {
            Loss::Huber => (self.solve()?, ROUNDS_MAX),
            Loss::Tukey => (self.solve_robust(Loss::Huber)?.fit, ROUNDS_MAX),
        };
        let rows = self.right.len();
        let given = self
            .weights
            .cloned()
            .unwrap_or_else(|| DVector::repeat(rows, 1.0));
        let mut robust = RobustFit {
            fit: first,
            kept: DVector::repeat(rows, 1.0),
            scale: 0.0,
            is_settled: false,
        };
        for _ in 0..rounds {
            let residual = self.matrix * &robust.fit.parameters - self.right;
            let residual = residual.zip_map(&given, |r, weight| r * weight.sqrt());
            robust.scale = MEDIAN_TO_DEVIATION * median(residual.iter().map(|r| r.abs()).collect());
            if robust.scale <= f64::EPSILON * self.right.amax() {
                // More than half of the rows are met exactly.
                robust.is_settled = true;
                break;
            }
            robust.kept = residual.map(|r| loss.weight(r / robust.scale));
            let weights = given.component_mul(&robust.kept);
            let next = self.with_weights(&weights).solve()?;
            let moved = &next.parameters - &robust.fit.parameters;
            let length = moved
                .iter()
                .zip(next.covariance.diagonal().iter())
                .map(|(step, variance)| step.abs() / (robust.scale * variance.sqrt()))
                .fold(0.0, f64::max);
            robust.fit = next;
            if length < SETTLED {
                robust.is_settled = true;
                break;
            }
        }
        Ok(robust)
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    crate::statistics::sample_quantile(&values, 0.5).unwrap_or(0.0)
}
