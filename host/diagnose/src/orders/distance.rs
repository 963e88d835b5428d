//! Squared distance of amplitudes from a prediction, in standard deviations of their errors, and its distribution.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::statistics::{chi_squared_quantile, f_quantile};

use crate::orders::common::Common;

/// Covariance of the error of the amplitudes of one order, estimated with ν degrees of freedom.
#[derive(Clone, Debug)]
pub(crate) struct OrderCovariance {
    /// E e eᴴ of the error e of the amplitudes of all channels; e is circular, E e eᵀ = 0, but for order 0, where it is
    /// real.
    pub matrix: DMatrix<Complex64>,
    /// Degrees of freedom ν of the estimate: number of independent complex values (order 0: real values).
    pub freedoms: f64,
    /// Bins of the spectrum of the residual from which it is estimated.
    pub bins: Range<usize>,
}

impl OrderCovariance {
    /// Share of the bins that two estimates have in common.
    fn overlap(&self, other: &Self) -> f64 {
        let from = self.bins.start.max(other.bins.start);
        let to = self.bins.end.min(other.bins.end);
        let longest = self.bins.len().max(other.bins.len()).max(1);
        to.saturating_sub(from) as f64 / longest as f64
    }
}

/// A squared distance, with the mean and the variance that it has if the prediction is true.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SquaredDistance {
    pub value: f64,
    pub mean: f64,
    pub variance: f64,
}

impl SquaredDistance {
    /// The number below which the distance stays with the probability `share`, as that of a gamma distribution with the
    /// same mean and variance.
    pub(crate) fn quantile(&self, share: f64) -> f64 {
        let freedoms = 2.0 * self.mean * self.mean / self.variance;
        self.mean / freedoms * chi_squared_quantile(share, freedoms)
    }
}

/// Hotelling's T² of one order: T²·n₂/(n₁ ν) has the F distribution with n₁ and n₂ degrees of freedom, where
///
/// - T² = 2 eᴴ Σ̂⁻¹ e, n₁ = 2C, n₂ = 2(ν − C + 1), ν counted twice, for complex amplitudes;
/// - T² = eᵀ Σ̂⁻¹ e, n₁ = C, n₂ = ν − C + 1 for order 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hotelling {
    freedoms: [f64; 2],
    /// T²/F.
    scale: f64,
}

impl Hotelling {
    pub(crate) fn new(order: usize, channels: usize, freedoms: f64) -> Self {
        let real = if order == 0 { 1.0 } else { 2.0 };
        let channels = channels as f64;
        let last = freedoms - channels + 1.0;
        Self {
            freedoms: [real * channels, real * last],
            scale: real * channels * freedoms / last,
        }
    }

    /// The number below which T² stays with the probability `share`.
    pub(crate) fn quantile(&self, share: f64) -> f64 {
        self.scale * f_quantile(share, self.freedoms)
    }

    fn mean(&self) -> f64 {
        self.scale * self.freedoms[1] / (self.freedoms[1] - 2.0)
    }

    /// Variance of T² that its covariance estimate causes, for large ν: T² has the mean 2 tr Σ̂⁻¹Σ for a given Σ̂, and
    /// tr Σ̂ Σ⁻¹ the variance C/ν; an error of Σ̂ acts with the square of ν/(ν − C).
    fn variance_of_estimate(&self, freedoms: f64) -> f64 {
        let channels = 0.5 * self.freedoms[0];
        4.0 * channels / freedoms * (freedoms / (freedoms - channels)).powi(4)
    }

    fn variance(&self) -> f64 {
        let [a, b] = self.freedoms;
        self.scale * self.scale * 2.0 * b * b * (a + b - 2.0) / (a * (b - 2.0) * (b - 2.0) * (b - 4.0))
    }
}

/// T² of one order for the differences of the amplitudes of all channels; infinite if the covariance is singular.
pub(crate) fn of_order(order: usize, covariance: &OrderCovariance, difference: &DVector<Complex64>) -> f64 {
    let real = if order == 0 { 1.0 } else { 2.0 };
    solved(covariance, difference).map_or(f64::INFINITY, |solved| real * difference.dotc(&solved).re)
}

fn solved(covariance: &OrderCovariance, difference: &DVector<Complex64>) -> Option<DVector<Complex64>> {
    Some(Cholesky::new(covariance.matrix.clone())?.solve(difference))
}

/// Squared distance over several orders, none of them 0: Σ T² with the covariance of each order times the inflation of
/// the common part, less what the common part V Vᵀ explains, gᵀ (I + M)⁻¹ g with g = ⟨v, e⟩ and M = ⟨v, v⟩ in the metric
/// of the covariance (Woodbury).
pub(crate) fn of_orders(
    orders: &[usize],
    covariances: &[OrderCovariance],
    common: &Common,
    difference: &DMatrix<Complex64>,
) -> SquaredDistance {
    let channels = difference.ncols();
    let count = common.directions.len();
    let inflation = common.inflation();
    let mut distance = SquaredDistance {
        value: 0.0,
        mean: 0.0,
        variance: 0.0,
    };
    let mut products = DVector::<f64>::zeros(count);
    let mut squares = DMatrix::<f64>::identity(count, count);
    for &order in orders {
        let covariance = &covariances[order];
        let e = difference.row(order).transpose();
        distance.value += of_order(order, covariance, &e) / inflation;
        let hotelling = Hotelling::new(order, channels, covariance.freedoms);
        distance.mean += hotelling.mean();
        distance.variance += hotelling.variance();
        // Estimates from the same bins err alike.
        distance.variance += orders
            .iter()
            .filter(|other| **other != order)
            .map(|other| covariance.overlap(&covariances[*other]))
            .sum::<f64>()
            * hotelling.variance_of_estimate(covariance.freedoms);
        for (i, direction) in common.directions.iter().enumerate() {
            let v = direction.row(order).transpose();
            let Some(solved) = solved(covariance, &v) else {
                continue;
            };
            products[i] += 2.0 * solved.dotc(&e).re / inflation;
            for (j, other) in common.directions.iter().enumerate() {
                squares[(i, j)] += 2.0 * solved.dotc(&other.row(order).transpose()).re / inflation;
            }
        }
    }
    if count > 0 {
        if let Some(decomposed) = Cholesky::new(squares) {
            distance.value -= products.dot(&decomposed.solve(&products));
        }
        // The part that the estimated directions miss varies as the square of one normal variable per direction.
        let missed = distance.mean * (inflation - 1.0) / inflation;
        distance.variance += 2.0 * missed * missed / count as f64;
    }
    distance
}
