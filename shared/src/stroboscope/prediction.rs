//! Linear prediction over strides of tooth periods, with coefficients common to all channels.
//!
//! With d_k the deviation from the forced orbit, d_k = Σ_r c_r·μ_r^k over P multipliers satisfies
//!
//! ```text
//! y_k = a_1·y_{k−s} + … + a_P·y_{k−Ps} + o_{k mod N},      z^P = a_1·z^{P−1} + … + a_P  has the roots μ_r^s
//! ```
//!
//! in every channel (slot and axis), with an offset o of its own for each channel and class. Least squares over all of it: the offsets
//! go first, by taking from each column of the regression the mean of its class (which is the joint estimate, by Frisch, Waugh and
//! Lovell), then the P×P normal equations. White noise of known power in the passings biases them towards 0; its share is taken off
//! the diagonal.
//!
//! A stride s > 1 moves the roots apart from each other, from the offsets and from the unit circle by a factor of s, while the noise
//! stays: |μ| becomes that much sharper. It needs (P·s) passings of the window.
//!
//! The deviation that is stated comes from the residuals themselves (White's covariance with one cluster per row): noise that drives the
//! cut, which is alike in all channels, is counted once.

use super::Window;
use super::roots::{Complex, largest};
use crate::math::{atan2_turns, exp, ln, sqrt};
use crate::stroboscope::CAPACITY;
use crate::synchronous::{CHANNELS, ToothPassing};

/// The highest order.
pub const MAX_ORDER: usize = 4;
/// Products of the columns y, x_1 … x_P.
const MAX_PRODUCTS: usize = (MAX_ORDER + 1) * (MAX_ORDER + 2) / 2;

/// What to fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Passings to look at, at most [`CAPACITY`].
    pub window: usize,
    /// Number of multipliers, 2 to [`MAX_ORDER`].
    pub order: usize,
    /// Tooth periods per step.
    pub stride: usize,
}

/// What came out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// |μ| of the largest multiplier over one tooth period.
    pub multiplier_abs: f32,
    /// Standard deviation of it.
    pub deviation: f32,
    /// Angle of μ^stride in turns, 0 to ½.
    pub angle_turns: f32,
    /// The stride.
    pub stride: usize,
    /// Root mean square of what was to be predicted, offsets taken off, in m/s².
    pub level: f32,
    /// Root mean square of what the prediction left, in m/s².
    pub innovation: f32,
}

impl Window<'_> {
    /// Fits `plan` to the end of the window. `noise` is the mean square of white noise in one channel, in (m/s²)²: at most what
    /// is known to be there.
    ///
    /// Returns `None` where the window is too short for the plan, or the noise explains all there is.
    pub fn predict(&self, plan: Plan, noise: f32) -> Option<Prediction> {
        match plan.order {
            2 => self.fit::<2>(plan, noise),
            3 => self.fit::<3>(plan, noise),
            MAX_ORDER => self.fit::<MAX_ORDER>(plan, noise),
            _ => None,
        }
    }

    #[inline(never)]
    fn fit<const P: usize>(&self, plan: Plan, noise: f32) -> Option<Prediction> {
        let skipped = P.checked_mul(plan.stride)?;
        let first = self.length().checked_sub(plan.window)? + skipped;
        let rows = self.length().checked_sub(first)?;
        let classes = self.classes().min(rows);
        // For each channel P coefficients are shared, but each class costs one row.
        if plan.stride == 0 || rows < classes + P.max(3) {
            return None;
        }
        let products = self.products::<P>(first, plan.stride)?;
        let (mut normal, mut right, mut square) = ([[0.0_f64; P]; P], [0.0_f64; P], 0.0_f64);
        for row in products.iter().take(rows) {
            for i in 0..P {
                right[i] += f64::from(row[product(0, i + 1)]);
                for j in 0..=i {
                    normal[i][j] += f64::from(row[product(j + 1, i + 1)]);
                }
            }
            square += f64::from(row[0]);
        }
        let freedom = ((rows - classes) * CHANNELS) as f64;
        for (i, line) in normal.iter_mut().enumerate() {
            // At least a quarter of the power stays: where noise is most of it, nothing is known.
            let share = f64::from(noise) * freedom;
            if line[i] < 1.333 * share {
                return None;
            }
            line[i] -= share;
        }
        let factor = factor(normal)?;
        let solved = solve(&factor, right);
        let coefficients: [f32; P] = solved.map(|a| a as f32);
        let root = largest(&coefficients)?;
        let weights = solve(&factor, sensitivity(&coefficients, root)?.map(f64::from)).map(|w| w as f32);
        let (mut variance, mut left) = (0.0, 0.0);
        for row in products.iter().take(rows) {
            let (score, residual) = score(row, &coefficients, &weights);
            variance += score * score;
            left += residual;
        }
        // Each coefficient and offset that is fitted makes the residuals smaller than they are.
        let inflation = rows as f32 / (rows - classes) as f32;
        let (abs, stride) = (sqrt(root.square()), plan.stride as f32);
        let multiplier_abs = exp(ln(abs) / stride);
        let deviation = sqrt(variance) * inflation / (abs * stride) * multiplier_abs;
        let mean = |sum: f32| sqrt(sum.max(0.0) / freedom as f32);
        let prediction = Prediction {
            multiplier_abs,
            deviation,
            angle_turns: atan2_turns(root.im, root.re),
            stride: plan.stride,
            level: mean(square as f32),
            innovation: mean(left),
        };
        (deviation.is_finite() && multiplier_abs.is_finite()).then_some(prediction)
    }

    /// For each row the products of its columns y, x_1 … x_P, class means taken off, summed over the channels.
    fn products<const P: usize>(
        &self,
        first: usize,
        stride: usize,
    ) -> Option<[[f32; MAX_PRODUCTS]; CAPACITY]> {
        let rows = self.length() - first;
        let mut products = [[0.0; MAX_PRODUCTS]; CAPACITY];
        let mut columns = [[0.0; CHANNELS]; MAX_ORDER + 1];
        for start in 0..self.classes().min(rows) {
            // Rows of one class lie `classes` apart.
            let means = self.column_means::<P>(first, stride, start);
            for row in (start..rows).step_by(self.classes()) {
                for (lag, (column, mean)) in columns.iter_mut().zip(&means).take(P + 1).enumerate() {
                    let passing = self.row(first + row - lag * stride);
                    for ((slot, value), mean) in column.iter_mut().zip(passing).zip(mean) {
                        *slot = value - mean;
                    }
                }
                let slots = products.get_mut(row)?;
                for i in 0..=P {
                    for j in 0..=i {
                        slots[product(j, i)] = dot(&columns[j], &columns[i]);
                    }
                }
            }
        }
        Some(products)
    }

    fn column_means<const P: usize>(
        &self,
        first: usize,
        stride: usize,
        start: usize,
    ) -> [ToothPassing; MAX_ORDER + 1] {
        let mut means = [[0.0; CHANNELS]; MAX_ORDER + 1];
        let rows = self.length() - first;
        let count = (rows - start).div_ceil(self.classes()) as f32;
        for row in (start..rows).step_by(self.classes()) {
            for (lag, mean) in means.iter_mut().take(P + 1).enumerate() {
                for (mean, value) in mean.iter_mut().zip(self.row(first + row - lag * stride)) {
                    *mean += value / count;
                }
            }
        }
        means
    }
}

/// Place of the product of columns i ≤ j.
const fn product(i: usize, j: usize) -> usize {
    j * (j + 1) / 2 + i
}

fn dot(a: &ToothPassing, b: &ToothPassing) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// For one row: Σ_i w_i·(x_i·e) and e·e, e the residual.
fn score<const P: usize>(
    row: &[f32; MAX_PRODUCTS],
    coefficients: &[f32; P],
    weights: &[f32; P],
) -> (f32, f32) {
    let mut score = 0.0;
    let mut residual = row[0];
    for (i, weight) in weights.iter().enumerate() {
        let mut with_residual = row[product(0, i + 1)];
        for (j, coefficient) in coefficients.iter().enumerate() {
            with_residual -= coefficient * row[product(i.min(j) + 1, i.max(j) + 1)];
        }
        score += weight * with_residual;
        // e·e = y·y − Σ a_i (x_i·y) − Σ a_i (x_i·e)
        residual -= coefficients[i] * (row[product(0, i + 1)] + with_residual);
    }
    (score, residual)
}

/// ∂|z|/∂a_i of a root z of z^P − a_1·z^(P−1) − … − a_P: Re(z̄·z^(P−i)/p′(z))/|z|.
fn sensitivity<const P: usize>(coefficients: &[f32; P], root: Complex) -> Option<[f32; P]> {
    let mut derivative = Complex::new(P as f32, 0.0);
    for (k, &a) in coefficients.iter().enumerate().take(P - 1) {
        derivative = derivative
            .times(root)
            .minus(Complex::new((P - 1 - k) as f32 * a, 0.0));
    }
    let abs = sqrt(root.square());
    let conjugate = Complex::new(root.re / abs, -root.im / abs);
    let mut sensitivity = [0.0; P];
    let mut power = Complex::new(1.0, 0.0);
    for slot in sensitivity.iter_mut().rev() {
        *slot = conjugate.times(power).over(derivative).re;
        power = power.times(root);
    }
    sensitivity.iter().all(|s| s.is_finite()).then_some(sensitivity)
}

/// L and D of A = L·D·Lᵀ (L with ones on its diagonal, where D stands) of a symmetric matrix whose lower half is given; `None` where it is not
/// positive definite.
fn factor<const P: usize>(mut a: [[f64; P]; P]) -> Option<[[f64; P]; P]> {
    for i in 0..P {
        for j in 0..=i {
            let sum = a[i][j] - (0..j).map(|k| a[i][k] * a[j][k] * a[k][k]).sum::<f64>();
            if i == j {
                // Directions that rounding alone fills are none: single precision sums carry 1e-6.
                if sum <= 1e-6 * a[i][i] {
                    return None;
                }
                a[i][i] = sum;
            } else {
                a[i][j] = sum / a[j][j];
            }
        }
    }
    Some(a)
}

/// Solves A·x = right with the factors of A.
fn solve<const P: usize>(factor: &[[f64; P]; P], mut right: [f64; P]) -> [f64; P] {
    for i in 0..P {
        right[i] -= (0..i).map(|k| factor[i][k] * right[k]).sum::<f64>();
    }
    for i in (0..P).rev() {
        let sum: f64 = (i + 1..P).map(|k| factor[k][i] * right[k]).sum();
        right[i] = right[i] / factor[i][i] - sum;
    }
    right
}
