//! One deviation that turns and grows: c·μ^k in every channel, fitted to a whole window.
//!
//! Near the limit growth is slow (2 % per tooth), and a vibration is worth calling when it is hardly larger than the noise of one
//! passing. The window as a whole shows it long before: with complex amplitudes a of its own in each channel,
//!
//! ```text
//! v_k = Re(a·e^{(g + 2πiθ)·k}) + class means + a straight line common to all classes + noise,       k = 0 the newest passing
//! ```
//!
//! is fitted by least squares over a, g = ln|μ| and θ = arg μ/2π: variable projection for a and for what is constant or drifts, Gauss
//! and Newton's steps for g and θ, from the best of some guesses. For white noise this is the most likely deviation, and no estimator
//! is sharper.
//!
//! A vibration that noise drives looks like growth for a while. It wanders, though, and what wanders by chance in its slope
//! wanders in its curvature too: along the fit, amplitude and phase of the residual are taken apart into Legendre polynomials, and what
//! the degrees 2 to 5 have beyond white noise tells the variance that degree 1, the growth, has from wandering. For a
//! random walk that factor is 0.100/0.0914 (variances of its Legendre coefficients: 0.100 in degree 1, and
//! 0.0238, 0.0111, 0.0065, 0.0043 in degrees 2 to 5, twice, for amplitude and phase).

use super::Window;
use super::shape::strongest;
use crate::math::{exp, sqrt};
use crate::synchronous::{CHANNELS, MAX_CLASSES, ToothPassing};

mod column;
mod fit;
mod guess;
mod nuisance;

pub use guess::{ANGLES, Guess};

use fit::{Fit, turning};
use nuisance::Nuisance;

/// The shortest window that is looked at.
pub const LEAST_LENGTH: usize = 40;
/// Steps of Gauss and Newton at most.
const STEPS: usize = 2;
/// Degrees of the Legendre polynomials that tell of wandering, and the factor from their variance to that of the growth.
const WANDERING_DEGREES: core::ops::RangeInclusive<usize> = 2..=5;
const WANDERING: f32 = 1.1;
/// Growth of fewer standard deviations of white noise than this is not looked at more closely.
const LOOK_CLOSER: f32 = 4.0;

/// What came out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponential {
    /// ln|μ| per tooth period.
    pub rate: f32,
    /// arg μ in turns, within [`ANGLES`].
    pub angle_turns: f32,
    /// Growth in standard deviations, of noise and of wandering; negative where it dies.
    pub certainty: f32,
    /// Root mean square over the channels at the newest passing, in m/s².
    pub level: f32,
    /// Real and imaginary part of the amplitude in each channel at the newest passing.
    pub shape: [[f32; 2]; CHANNELS],
}

impl Exponential {
    /// Cycles per tooth period, by the shape within it.
    pub fn cycles(&self) -> Option<f32> {
        strongest(&self.shape, self.angle_turns)
    }
}

/// Legendre polynomials of degree 0 to 5 at a row, of square sum 1 over the rows (to a part of n²/length²).
fn legendre(row: usize, length: usize) -> [f32; 6] {
    let u = (2 * row + 1) as f32 / length as f32 - 1.0;
    let mut polynomials = [1.0, u, 0.0, 0.0, 0.0, 0.0];
    for n in 2..polynomials.len() {
        let m = n as f32;
        polynomials[n] = ((2.0 * m - 1.0) * u * polynomials[n - 1] - (m - 1.0) * polynomials[n - 2]) / m;
    }
    for (n, value) in polynomials.iter_mut().enumerate() {
        *value *= sqrt((2 * n + 1) as f32 / length as f32);
    }
    polynomials
}

/// Degree 1 of the growth: Σ p₁(k)·size·e^{g·k}.
fn growth(fit: &Fit, length: usize) -> f32 {
    let shrink = exp(-fit.guess.rate);
    let (mut sum, mut value) = (0.0, fit.size());
    for row in (0..length).rev() {
        sum += legendre(row, length)[1] * value;
        value *= shrink;
    }
    sum
}

/// What is constant and drifts, channel by channel, and the power of the rest.
struct Constant {
    means: [ToothPassing; MAX_CLASSES],
    slope: ToothPassing,
    power: f32,
}

/// Power of what a fit leaves along itself, the mean of amplitude and phase.
struct Along {
    /// Over all rows.
    power: f32,
    /// In the degrees [`WANDERING_DEGREES`].
    smooth: f32,
}

impl Window<'_> {
    /// Fits a deviation that turns and grows, from the best of the guesses.
    ///
    /// Returns `None` for windows shorter than [`LEAST_LENGTH`] or than four revolutions, and where all guesses are what comes back
    /// with each revolution.
    #[inline(never)]
    pub fn exponential(&self, guesses: impl IntoIterator<Item = Guess>) -> Option<Exponential> {
        let length = self.length();
        if length < LEAST_LENGTH.max(4 * self.classes()) {
            return None;
        }
        let nuisance = Nuisance::new(self);
        let fits = guesses
            .into_iter()
            .filter_map(|guess| Fit::new(self, &nuisance, guess));
        let mut fit = fits.reduce(|a, b| if b.power > a.power { b } else { a })?;
        for _ in 0..STEPS {
            let better = fit.improve(self, &nuisance);
            if fit.guess.is_near(better) {
                break;
            }
            fit = Fit::new(self, &nuisance, better)?;
        }
        let constant = self.constant(&nuisance);
        // In each channel class means, line and two amplitudes are fitted.
        let freedom = (length - self.classes() - 3) * CHANNELS;
        // Single precision sums carry 1e-6.
        let noise =
            ((constant.power - fit.power) / freedom as f32).max(1e-6 * constant.power / freedom as f32);
        let growth = growth(&fit, length);
        let mut certainty = growth / sqrt(noise);
        if certainty > LOOK_CLOSER {
            let along = self.residual_along(&nuisance, &constant, &fit);
            // What moves all channels at once, as a spindle angle that is off does, is not spread over them.
            let noise = noise.max(along.power / (length - self.classes() - 3) as f32);
            let degrees = WANDERING_DEGREES.count() as f32;
            let beyond = 2.0 * (along.smooth - degrees * noise).max(0.0);
            certainty = growth / sqrt(noise + WANDERING * beyond);
        }
        let mut shape = [[0.0; 2]; CHANNELS];
        for (slot, [cos, sin]) in shape.iter_mut().zip(fit.amplitudes) {
            // Re(a·e^{ix}) = Re a·cos x − Im a·sin x.
            *slot = [cos, -sin];
        }
        certainty.is_finite().then_some(Exponential {
            rate: fit.guess.rate,
            angle_turns: fit.guess.angle_turns,
            certainty,
            level: fit.size() / sqrt(CHANNELS as f32),
            shape,
        })
    }

    #[inline(never)]
    fn constant(&self, nuisance: &Nuisance) -> Constant {
        let mut constant = Constant {
            means: [[0.0; CHANNELS]; MAX_CLASSES],
            slope: [0.0; CHANNELS],
            power: 0.0,
        };
        let mut counts = [0.0; MAX_CLASSES];
        for row in 0..self.length() {
            let class = nuisance.class(row);
            let (Some(mean), Some(count)) = (constant.means.get_mut(class), counts.get_mut(class)) else {
                continue;
            };
            *count += 1.0;
            let line = nuisance.line[row] / nuisance.line_square;
            for ((mean, slope), value) in mean.iter_mut().zip(&mut constant.slope).zip(self.row(row)) {
                *mean += value;
                *slope += line * value;
                constant.power += value * value;
            }
        }
        for (mean, count) in constant.means.iter_mut().zip(counts) {
            for mean in mean.iter_mut().filter(|_| count > 0.0) {
                constant.power -= *mean * *mean / count;
                *mean /= count;
            }
        }
        let slope_square: f32 = constant.slope.iter().map(|s| s * s).sum();
        constant.power -= slope_square * nuisance.line_square;
        constant
    }

    /// What the fit leaves along itself: its amplitude and its phase.
    #[inline(never)]
    fn residual_along(&self, nuisance: &Nuisance, constant: &Constant, fit: &Fit) -> Along {
        let length = self.length();
        let raw = turning(fit.guess, length);
        let size = fit.size();
        let grow = exp(fit.guess.rate);
        // From the newest row back, the deviation is 1/value times as large as there.
        let mut value = 1.0 / size;
        let mut sums = [[0.0; 2]; 6];
        let mut power = 0.0;
        for row in (0..length).rev() {
            let mean = &constant.means[nuisance.class(row)];
            let line = nuisance.line[row];
            let (cos, sin) = (fit.basis[0][row], fit.basis[1][row]);
            let (raw_cos, raw_sin) = (raw[0][row], raw[1][row]);
            let (mut amplitude, mut phase) = (0.0, 0.0);
            for (channel, v) in self.row(row).iter().enumerate() {
                let [a, b] = fit.amplitudes[channel];
                let fitted = cos * a + sin * b;
                let residual = v - mean[channel] - line * constant.slope[channel] - fitted;
                amplitude += fitted * residual;
                phase += (raw_cos * b - raw_sin * a) * residual;
            }
            (amplitude, phase) = (amplitude * value, phase * value);
            power += amplitude * amplitude + phase * phase;
            for (sum, polynomial) in sums.iter_mut().zip(legendre(row, length)) {
                sum[0] += polynomial * amplitude;
                sum[1] += polynomial * phase;
            }
            value *= grow;
        }
        let degrees = sums.get(WANDERING_DEGREES).unwrap_or_default();
        let smooth: f32 = degrees.iter().flatten().map(|sum| sum * sum).sum();
        Along {
            power: 0.5 * power,
            smooth: 0.5 * smooth,
        }
    }
}
