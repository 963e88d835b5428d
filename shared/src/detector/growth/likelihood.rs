//! The autoregression of a window, its roots, and the likelihood of growth.

use super::recursion::{LAGS, ORDER, PRODUCTS, Products, place};
use super::rows::GROUPS;
use crate::criteria::LEAST_ANGLE;
use crate::math::{atan2_turns, sqrt};
use crate::stroboscope::roots::{Complex, all};

pub(super) use crate::criteria::STABLE;
/// Part of the power that is added to the diagonal, so that single precision solves windows without noise.
const RIDGE: f32 = 1e-5;
/// Least number of channels in a harmonic, whose sensor noise no innovation is below.
const LEAST_CHANNELS: f32 = 3.0;

/// The least power of a harmonic: the sensor's noise, of mean square `noise` in one channel.
pub(super) fn floor(noise: f32) -> f32 {
    (LEAST_CHANNELS * noise).max(f32::MIN_POSITIVE)
}

/// A multiplier with its likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub(super) abs: f32,
    pub(super) angle_turns: f32,
    /// Logarithm of the likelihood ratio against |μ| = [`STABLE`], and against 1; 0 where |μ| is smaller.
    pub(super) against_stable: f32,
    pub(super) against_unity: f32,
}

/// The autoregression of a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Innovation variance of each harmonic, (m/s²)².
    pub(super) innovations: [f32; GROUPS],
    /// The multiplier whose growth is likeliest, else the largest.
    pub(super) candidate: Option<Candidate>,
}

/// An imaginary part of less than this part of a root is rounding.
const REAL: f32 = 1e-4;

/// 1, −a_1, … −a_4.
type Polynomial = [f32; LAGS];

/// Fits the autoregression to the products of a window of `weight` passings, with a weight for each harmonic. `floor` is the least innovation
/// variance.
pub(super) fn fit(centred: &Products, weight: f32, weights: &[f32; GROUPS], floor: f32) -> Option<Fit> {
    let mut sums = [0.0_f32; PRODUCTS];
    for (products, w) in centred.iter().zip(weights) {
        for (sum, product) in sums.iter_mut().zip(products) {
            *sum += w * product;
        }
    }
    let coefficients = solve(&sums)?;
    let polynomial: Polynomial = core::array::from_fn(|i| if i == 0 { 1.0 } else { -coefficients[i - 1] });
    let innovations =
        core::array::from_fn(|group| (square(&polynomial, &centred[group]) / weight).max(floor));
    let roots = all(&coefficients)?;
    // The harmonic that tells most stands for all: a structure that rings is in several, with the same noise.
    let evidence = |other: &Polynomial| {
        let more =
            |group: usize| square(other, &centred[group]) - square(&polynomial, &centred[group]).max(0.0);
        (0..GROUPS).fold(0.0_f32, |most, group| {
            most.max(0.5 * more(group) / innovations[group])
        })
    };
    let mut best: Option<Candidate> = None;
    for (index, root) in roots.iter().enumerate() {
        let Some((candidate, is_real)) = candidate(*root) else {
            continue;
        };
        let with = |radius: f32| {
            if candidate.abs > radius {
                evidence(&scaled(&roots, index, is_real, radius / candidate.abs))
            } else {
                0.0
            }
        };
        let candidate = Candidate {
            against_stable: with(STABLE),
            against_unity: with(1.0),
            ..candidate
        };
        let rank = |c: &Candidate| (c.against_stable, c.abs);
        if best.as_ref().is_none_or(|best| rank(&candidate) > rank(best)) {
            best = Some(candidate);
        }
    }
    Some(Fit {
        innovations,
        candidate: best,
    })
}

/// A root that may be a multiplier, and whether it is real; `None` for the second of a pair and for what is near the positive real axis.
fn candidate(root: Complex) -> Option<(Candidate, bool)> {
    let abs = sqrt(root.square());
    let is_real = root.im.abs() < REAL * abs;
    let angle_turns = if is_real && root.re < 0.0 {
        0.5
    } else {
        atan2_turns(root.im, root.re)
    };
    let candidate = Candidate {
        abs,
        angle_turns,
        against_stable: 0.0,
        against_unity: 0.0,
    };
    (angle_turns >= LEAST_ANGLE && abs > 0.0 && abs.is_finite()).then_some((candidate, is_real))
}

/// The polynomial with root `index`, and its conjugate unless it is real, scaled by a factor.
fn scaled(roots: &[Complex; ORDER], index: usize, is_real: bool, factor: f32) -> Polynomial {
    let root = roots[index];
    // The conjugate is the root nearest to it.
    let mut conjugate = index;
    let mut nearest = f32::INFINITY;
    for (other, r) in roots.iter().enumerate() {
        let away = r.minus(Complex::new(root.re, -root.im)).square();
        if other != index && !is_real && away < nearest {
            (conjugate, nearest) = (other, away);
        }
    }
    let mut polynomial = [Complex::default(); LAGS];
    polynomial[0] = Complex::new(1.0, 0.0);
    for (number, r) in roots.iter().enumerate() {
        let scale = if number == index || number == conjugate {
            factor
        } else {
            1.0
        };
        let r = Complex::new(scale * r.re, scale * r.im);
        for k in (1..=number + 1).rev() {
            polynomial[k] = polynomial[k].minus(r.times(polynomial[k - 1]));
        }
    }
    polynomial.map(|c| c.re)
}

/// Sum of squares of the prediction error of a polynomial.
fn square(polynomial: &Polynomial, products: &[f32; PRODUCTS]) -> f32 {
    let mut sum = 0.0;
    for j in 0..LAGS {
        for i in 0..=j {
            let factor = if i == j { 1.0 } else { 2.0 };
            sum += factor * polynomial[i] * polynomial[j] * products[place(i, j)];
        }
    }
    sum
}

/// The coefficients by Cholesky's factors of the normal matrix.
fn solve(sums: &[f32; PRODUCTS]) -> Option<[f32; ORDER]> {
    let mut a = [[0.0_f32; ORDER]; ORDER];
    let mut x: [f32; ORDER] = core::array::from_fn(|i| sums[place(0, i + 1)]);
    let trace: f32 = (1..LAGS).map(|i| sums[place(i, i)]).sum();
    for (i, line) in a.iter_mut().enumerate() {
        for (j, slot) in line.iter_mut().take(i + 1).enumerate() {
            *slot = sums[place(j + 1, i + 1)];
        }
        line[i] += RIDGE * trace;
    }
    for i in 0..ORDER {
        for j in 0..=i {
            let sum = a[i][j] - (0..j).map(|k| a[i][k] * a[j][k]).sum::<f32>();
            if i == j {
                if sum.is_nan() || sum <= 0.0 {
                    return None;
                }
                a[i][i] = sqrt(sum);
            } else {
                a[i][j] = sum / a[j][j];
            }
        }
    }
    for i in 0..ORDER {
        let sum: f32 = (0..i).map(|k| a[i][k] * x[k]).sum();
        x[i] = (x[i] - sum) / a[i][i];
    }
    for i in (0..ORDER).rev() {
        let sum: f32 = (i + 1..ORDER).map(|k| a[k][i] * x[k]).sum();
        x[i] = (x[i] - sum) / a[i][i];
    }
    x.iter().all(|x| x.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::super::recursion::{Recursion, Rows};
    use super::super::rows::row;
    use super::*;
    use crate::math::{cos_turns, exp, ln};
    use crate::synchronous::{CHANNELS, ToothPassing};

    /// The likeliest multiplier of a vibration with this one after some passings, with white noise.
    fn found(abs: f32, angle: f32, passings: usize, memory: f32) -> Candidate {
        let (mut rows, mut recursion) = (Rows::new(), Recursion::new(memory));
        let mut random = 1_u32;
        for k in 0..passings {
            let passing: ToothPassing = core::array::from_fn(|n| {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = (random >> 8) as f32 / 16_777_216.0 - 0.5;
                let slots = angle * (k as f32 + (n / 3) as f32 / 8.0);
                exp(ln(abs) * k as f32) * cos_turns(slots) + 0.01 * noise
            });
            if rows.push(&row(&passing)) {
                recursion.push(&rows);
            }
        }
        let fit = fit(&recursion.centred(), recursion.weight, &[1.0; GROUPS], 1e-6);
        assert_eq!(CHANNELS, 24);
        fit.unwrap().candidate.unwrap()
    }

    #[test]
    fn growth_is_likely_with_its_multiplier_and_decay_is_not() {
        for (abs, angle) in [(1.02, 0.31), (1.1, 0.43), (1.3, 0.2), (1.1, 0.5)] {
            let c = found(abs, angle, 40, 8.0);
            assert!(
                (c.abs / abs - 1.0).abs() < 0.01 && (c.angle_turns - angle).abs() < 0.005,
                "{c:?}"
            );
            assert!(c.against_stable > 10.0 && c.against_unity > 1.0, "{c:?}");
        }
        let c = found(0.93, 0.31, 40, 64.0);
        assert!(c.abs < 0.95 && c.against_stable == 0.0, "{c:?}");
    }
}
