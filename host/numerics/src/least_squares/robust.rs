//! Robust linear least squares: iteratively reweighted, so that outliers have little effect.

use nalgebra::DVector;

use super::{LeastSquaresError, LinearFit, LinearProblem};

/// Largest number of rounds of reweighting in a robust fit; ten are usual.
const ROUNDS_MAX: usize = 100;

/// Change of every parameter in one round of reweighting, in its standard deviation, below which a robust fit has
/// settled. A choice.
const SETTLED: f64 = 1e-6;

/// Ratio of the standard deviation of a normal distribution to its median absolute deviation, 1/Φ⁻¹(3/4).
const MEDIAN_TO_DEVIATION: f64 = 1.482_602_218_505_602;

/// Loss function ρ(u) of a residual divided by the robust standard deviation of all residuals; it acts through its
/// weight ψ(u)/u, ψ = dρ/du. Both functions have 95 % efficiency for normal noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// Huber's loss: linear beyond 1.345 robust standard deviations. It is convex, so that the sum of losses has one
    /// minimum.
    Huber,
    /// Tukey's biweight: constant beyond 4.685 robust standard deviations. The iteration starts from the solution with
    /// Huber's loss.
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

/// A robust fit, with the factor by which the loss function reduced the weight of each row.
#[derive(Clone, Debug, PartialEq)]
pub struct RobustFit {
    /// The linear fit with the weights of the last round of reweighting.
    pub fit: LinearFit,
    /// Factor, from 0 to 1, by which the loss function changed the weight of each row; 0 marks an outlier.
    pub kept: DVector<f64>,
    /// Robust standard deviation of the weighted residuals, in their unit.
    pub scale: f64,
    /// False if the weights of the rows still changed in the last round of reweighting.
    pub is_settled: bool,
}

impl LinearProblem<'_> {
    /// Parameters with the least sum of losses ρ(rᵢ √wᵢ / scale) over the rows, with residuals rᵢ and weights wᵢ. Each
    /// round takes the scale from the median absolute residual (Huber and Ronchetti, *Robust Statistics*, 2nd edition,
    /// 7.8).
    ///
    /// # Errors
    /// See [`LeastSquaresError`]. Also if fewer rows than parameters remain without the outliers.
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
                // More than half of the residuals are zero to rounding, so that no scale can be estimated.
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
