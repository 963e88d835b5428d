//! The growth of an alternating part, where runout alternates too.
//!
//! For an even number of teeth an offset that alternates (runout, for two teeth) lies next to the multiplier −1 of a flip, and linear prediction
//! over a short window cannot keep them apart. One direction in the space of channels is enough, though: the pattern p by
//! which even and odd passings differ. With v_k the passings,
//!
//! ```text
//! g_k = (−1)^k·(p·v_k) = A·|μ|^k + b_{k mod N} + noise
//! ```
//!
//! A flip that is being lost is convex (|μ| > 1), the way to the steady state of runout, b/(1 − |μ|), is concave (|μ| < 1), and a straight line
//! lies between them. The residual power is a function of |μ| alone once A and b are fitted; its minimum is the estimate, and the
//! range within z² noise powers of the minimum the interval of confidence.

use super::Window;
use crate::math::{exp, sqrt};
use crate::stroboscope::CAPACITY;
use crate::synchronous::{CHANNELS, MAX_CLASSES};

/// ln|μ| is tried at whole multiples of this,
const STEP: f32 = 0.005;
/// up to so many on both sides of 0. Faster growth than e^0.2 per tooth is seen by the linear prediction.
const STEPS: i32 = 40;

/// What is known of an alternating part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alternation {
    /// |μ| that fits best.
    pub multiplier_abs: f32,
    /// The least |μ| that is compatible with the passings.
    pub least: f32,
    /// The largest |μ| that is.
    pub most: f32,
    /// Root mean square over rows and channels of the change of the alternating part within the window, in m/s².
    pub change: f32,
    /// Correlation of one residual with the next: near 1 where something else than the model moves.
    pub correlation: f32,
}

impl Window<'_> {
    /// Fits an exponential to the alternating part of the whole window.
    ///
    /// `noise` is the mean square of white noise in one channel, `deviations` the z of the interval. Returns `None` for odd numbers of teeth, short windows
    /// and where nothing alternates.
    #[inline(never)]
    pub fn alternation(&self, noise: f32, deviations: f32) -> Option<Alternation> {
        let (length, classes) = (self.length(), self.classes());
        if classes % 2 == 1 || length < classes + 6 {
            return None;
        }
        let mut series = [0.0; CAPACITY];
        self.project(series.get_mut(..length)?)?;
        self.take_off_class_means(series.get_mut(..length)?);
        let series = series.get(..length)?;
        let power: f32 = series.iter().map(|g| g * g).sum();
        let mut best = (0, f32::INFINITY);
        let mut powers = [0.0; (2 * STEPS + 1) as usize];
        for (step, slot) in (-STEPS..=STEPS).zip(&mut powers) {
            *slot = power - self.explained(series, step as f32 * STEP);
            if *slot < best.1 {
                best = (step, *slot);
            }
        }
        let freedom = (length - classes - 2) as f32;
        let noise = noise.max(best.1 / freedom);
        let bound = best.1 + deviations * deviations * noise;
        let mut compatible = (-STEPS..=STEPS).zip(powers).filter(|&(_, power)| power <= bound);
        let least = compatible.next().map_or(best.0, |(step, _)| step);
        let most = compatible.last().map_or(best.0.max(least), |(step, _)| step);
        let abs = |step: i32| exp(step as f32 * STEP);
        Some(Alternation {
            multiplier_abs: abs(best.0),
            // A range that ends at the end of what was tried has no end.
            least: if least == -STEPS { 0.0 } else { abs(least) },
            most: if most == STEPS { f32::INFINITY } else { abs(most) },
            change: sqrt(((power - best.1) / (length * CHANNELS) as f32).max(0.0)),
            correlation: self.correlation(series, best.0 as f32 * STEP),
        })
    }

    /// g_k for every row.
    fn project(&self, series: &mut [f32]) -> Option<()> {
        let mut pattern = [0.0; CHANNELS];
        for row in 0..self.length() {
            let sign = sign(self.class(row));
            for (pattern, value) in pattern.iter_mut().zip(self.row(row)) {
                *pattern += sign * value;
            }
        }
        let norm = sqrt(pattern.iter().map(|p| p * p).sum());
        if !(norm > 0.0 && norm.is_finite()) {
            return None;
        }
        for (row, slot) in series.iter_mut().enumerate() {
            let product: f32 = pattern.iter().zip(self.row(row)).map(|(p, v)| p * v).sum();
            *slot = sign(self.class(row)) * product / norm;
        }
        Some(())
    }

    fn take_off_class_means(&self, series: &mut [f32]) {
        let (mut sums, mut counts) = ([0.0; MAX_CLASSES], [0.0; MAX_CLASSES]);
        for (row, value) in series.iter().enumerate() {
            let class = self.class(row);
            sums[class] += value;
            counts[class] += 1.0;
        }
        for (row, value) in series.iter_mut().enumerate() {
            let class = self.class(row);
            *value -= sums[class] / counts[class];
        }
    }

    /// e^(rate·k) for every row, 1 at the end that is largest, class means taken off; for rate 0 its limit, a straight line.
    fn curve(&self, length: usize, rate: f32) -> [f32; CAPACITY] {
        let mut curve = [0.0; CAPACITY];
        let curve_part = curve.get_mut(..length).unwrap_or_default();
        let factor = exp(if rate > 0.0 { -rate } else { rate });
        let mut value = 1.0;
        for index in 0..length {
            let row = if rate > 0.0 { length - 1 - index } else { index };
            if let Some(slot) = curve_part.get_mut(row) {
                *slot = if rate == 0.0 { row as f32 } else { value };
            }
            value *= factor;
        }
        self.take_off_class_means(curve_part);
        curve
    }

    /// Power of the series that the exponential explains.
    fn explained(&self, series: &[f32], rate: f32) -> f32 {
        let curve = self.curve(series.len(), rate);
        let (mut with, mut own) = (0.0, 0.0);
        for (value, curve) in series.iter().zip(&curve) {
            with += value * curve;
            own += curve * curve;
        }
        if own > 0.0 { with * with / own } else { 0.0 }
    }

    /// Correlation of neighbouring residuals of the fit with this rate.
    fn correlation(&self, series: &[f32], rate: f32) -> f32 {
        let curve = self.curve(series.len(), rate);
        let (mut with, mut own) = (0.0, 0.0);
        for (value, curve) in series.iter().zip(&curve) {
            with += value * curve;
            own += curve * curve;
        }
        let amplitude = if own > 0.0 { with / own } else { 0.0 };
        let (mut before, mut product, mut square) = (0.0, 0.0, 0.0);
        for (value, curve) in series.iter().zip(&curve) {
            let residual = value - amplitude * curve;
            product += residual * before;
            square += residual * residual;
            before = residual;
        }
        if square > 0.0 { product / square } else { 0.0 }
    }
}

fn sign(class: usize) -> f32 {
    if class.is_multiple_of(2) { 1.0 } else { -1.0 }
}
