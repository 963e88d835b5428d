//! Errors of the orders of a recorded cut and of their trend: independent from order to order, and common to all.

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;

use crate::orders::distance::OrderCovariance;
use crate::orders::reduction::Orders;
use crate::orders::trend::Trend;
use quietcut_numerics::eigenvalues::of_symmetric;

/// Standard deviation of the sensitivity of a channel at one order against that at others. Data sheets promise 1 to 5 %
/// over the whole range of a sensor.
const FLATNESS: f64 = 1e-3;
/// Least square of a common direction in standard deviations, over that of the largest, that is not rounding.
const ROUNDING: f64 = 1e-14;

/// The distribution of the errors of the amplitudes and their trend.
///
/// Independent errors of each order are whitened, v = W e. In these values the directions in which all orders err
/// together, one standard deviation each, are the columns of a matrix V = U S Zᵀ, and the covariance is
///
/// ```text
/// I + V Vᵀ = I + U S² Uᵀ,    (I + V Vᵀ)^(−1/2) = I − U (1 − (1 + S²)^(−1/2)) Uᵀ.
/// ```
pub(crate) struct AmplitudeErrors {
    /// By order from 1: the matrix W with WᴴW = 2 Σ⁻¹, Σ the covariance of the amplitudes of all channels, so that real
    /// and imaginary parts of W e have unit variance.
    whiteners: Vec<DMatrix<Complex64>>,
    /// The same of the trend; empty without it.
    trend_whiteners: Vec<DMatrix<Complex64>>,
    /// Directions of the amplitudes of the record.
    directions: Vec<DMatrix<Complex64>>,
    /// U.
    principal: DMatrix<f64>,
    /// Uᵀ, stored because nalgebra multiplies only stored matrices in cache blocks.
    principal_transposed: DMatrix<f64>,
    /// S².
    squares: DVector<f64>,
    /// Z, of the directions of the amplitudes.
    turned: DMatrix<f64>,
    channels: usize,
}

impl AmplitudeErrors {
    /// `coefficients` are Fourier coefficients of the channels in a prediction; `directions` and `trend_directions` one
    /// standard deviation each of what is common to the orders, and of the trend. `None` if a noise is not a number.
    pub(super) fn new(
        orders: &Orders,
        coefficients: &DMatrix<Complex64>,
        directions: Vec<DMatrix<Complex64>>,
        trend_directions: &[DMatrix<Complex64>],
    ) -> Option<Self> {
        let trend_whiteners = match &orders.trend {
            Some(trend) => trend_whiteners(orders, trend, coefficients)?,
            None => Vec::new(),
        };
        let mut errors = Self {
            whiteners: whiteners(orders)?,
            trend_whiteners,
            directions,
            principal: DMatrix::zeros(0, 0),
            principal_transposed: DMatrix::zeros(0, 0),
            squares: DVector::zeros(0),
            turned: DMatrix::zeros(0, 0),
            channels: orders.channels.len(),
        };
        let of_mean = errors.directions.iter();
        let mut columns: Vec<DVector<f64>> = of_mean
            .map(|direction| DVector::from_vec(errors.independent(direction, None)))
            .collect();
        let none = &orders.amplitudes * Complex64::ZERO;
        let of_trend = trend_directions.iter();
        columns
            .extend(of_trend.map(|direction| DVector::from_vec(errors.independent(&none, Some(direction)))));
        let count = errors.directions.len();
        let common = DMatrix::from_columns(&columns);
        let found = of_symmetric(common.transpose() * &common).ok()?;
        let largest = found.eigenvalues.amax();
        let kept: Vec<usize> = (0..columns.len())
            .filter(|index| found.eigenvalues[*index] > ROUNDING * largest)
            .collect();
        let turned = found.eigenvectors.select_columns(&kept);
        errors.squares =
            DVector::from_iterator(kept.len(), kept.iter().map(|index| found.eigenvalues[*index]));
        errors.principal = common * &turned;
        for (mut column, square) in errors.principal.column_iter_mut().zip(&errors.squares) {
            column /= square.sqrt();
        }
        errors.principal_transposed = errors.principal.transpose();
        errors.turned = turned.rows(0, count).into_owned();
        Some(errors)
    }

    /// Number of compared values: real and imaginary parts of the amplitudes of all orders but 0, whose offset is free,
    /// and of their trend.
    pub(crate) fn count(&self) -> usize {
        2 * (self.whiteners.len() + self.trend_whiteners.len()) * self.channels
    }

    /// Amplitudes and their trend as values whose errors are independent with unit variance. Without a trend of its own
    /// the record has no values of it.
    pub(crate) fn whitened(
        &self,
        amplitudes: &DMatrix<Complex64>,
        trend: Option<&DMatrix<Complex64>>,
    ) -> Vec<f64> {
        let mut values = DMatrix::from_vec(self.count(), 1, self.independent(amplitudes, trend));
        self.decorrelate(&mut values);
        values.data.into()
    }

    /// Multiplies columns of independent values by (I + V Vᵀ)^(−1/2).
    pub(super) fn decorrelate(&self, columns: &mut DMatrix<f64>) {
        let mut along = &self.principal_transposed * &*columns;
        for (mut along, square) in along.row_iter_mut().zip(&self.squares) {
            along *= 1.0 - (1.0 + square).sqrt().recip();
        }
        columns.gemm(-1.0, &self.principal, &along, 1.0);
    }

    /// An error of the amplitudes and their trend without what most probably is common to the orders.
    pub(crate) fn own(
        &self,
        error: &DMatrix<Complex64>,
        trend: Option<&DMatrix<Complex64>>,
    ) -> DMatrix<Complex64> {
        let values = DVector::from_vec(self.independent(error, trend));
        let mut along = &self.principal_transposed * &values;
        for (along, square) in along.iter_mut().zip(&self.squares) {
            *along *= square.sqrt() / (1.0 + square);
        }
        let sizes = &self.turned * along;
        let mut own = error.clone();
        for (direction, size) in self.directions.iter().zip(&sizes) {
            own -= direction * Complex64::from(*size);
        }
        own
    }

    /// Squares of an error of the amplitudes, in variances of the independent errors: by order (row 0 is zero) and channel.
    pub(crate) fn squared_deviations(&self, error: &DMatrix<Complex64>) -> DMatrix<f64> {
        let mut squares = DMatrix::zeros(error.nrows(), error.ncols());
        for (index, whitener) in self.whiteners.iter().enumerate() {
            // W is triangular with positive diagonal, so that its inverse exists: Σ = 2 W⁻¹W⁻ᴴ.
            let Some(inverse) = whitener.clone().try_inverse() else {
                continue;
            };
            for channel in 0..error.ncols() {
                let variance = 2.0 * inverse.row(channel).norm_squared();
                squares[(index + 1, channel)] = error[(index + 1, channel)].norm_sqr() / variance;
            }
        }
        squares
    }

    /// Values whose errors are independent with unit variance but for what is common.
    pub(super) fn independent(
        &self,
        amplitudes: &DMatrix<Complex64>,
        trend: Option<&DMatrix<Complex64>>,
    ) -> Vec<f64> {
        let mut values = of_orders(&self.whiteners, amplitudes);
        match trend {
            Some(trend) => values.extend(of_orders(&self.trend_whiteners, trend)),
            None => values.resize(self.count(), 0.0),
        }
        values
    }
}

/// Amplitudes of all orders but 0 in standard deviations of their errors.
fn of_orders(whiteners: &[DMatrix<Complex64>], amplitudes: &DMatrix<Complex64>) -> Vec<f64> {
    let mut values = Vec::with_capacity(2 * whiteners.len() * amplitudes.ncols());
    for (index, whitener) in whiteners.iter().enumerate() {
        let white = whitener * amplitudes.row(index + 1).transpose();
        values.extend(white.iter().flat_map(|value| [value.re, value.im]));
    }
    values
}

fn whiteners(orders: &Orders) -> Option<Vec<DMatrix<Complex64>>> {
    let inflation = orders.common.inflation();
    let further = |order: usize, channel: usize| FLATNESS * orders.amplitudes[(order, channel)].norm();
    inverse_factors(orders, inflation, further)
}

/// Whiteners of the trend: besides the noise, the orders of a prediction above those of the record fold onto them, with
/// phases that may change over the record.
fn trend_whiteners(
    orders: &Orders,
    trend: &Trend,
    coefficients: &DMatrix<Complex64>,
) -> Option<Vec<DMatrix<Complex64>>> {
    let highest = orders.amplitudes.nrows() - 1;
    let folded = |order: usize, channel: usize| {
        let of_alias = |alias: usize| {
            let parts = trend.folding[alias - order].hypot(trend.folding[alias + order]);
            (parts * coefficients[(alias, channel)].norm()).powi(2)
        };
        let power: f64 = (highest + 1..coefficients.nrows()).map(of_alias).sum();
        power.sqrt()
    };
    inverse_factors(orders, trend.variance * trend.common.inflation(), folded)
}

/// The inverse factors of the covariances between the lines, times `factor`, with further errors of each order and
/// channel.
fn inverse_factors(
    orders: &Orders,
    factor: f64,
    further: impl Fn(usize, usize) -> f64,
) -> Option<Vec<DMatrix<Complex64>>> {
    let channels = orders.channels.len();
    let of_order = |(index, covariance): (usize, &OrderCovariance)| {
        // The mean of T² exceeds the number of values, since the covariance is estimated (Hotelling).
        let freedoms = covariance.freedoms;
        let scale = factor * freedoms / (freedoms - channels as f64).max(1.0);
        let mut matrix = &covariance.matrix * Complex64::from(scale);
        for channel in 0..channels {
            matrix[(channel, channel)] += further(index + 1, channel).powi(2);
        }
        let lower = Cholesky::new(matrix * Complex64::from(0.5))?.l();
        lower.try_inverse()
    };
    orders.covariances[1..].iter().enumerate().map(of_order).collect()
}
