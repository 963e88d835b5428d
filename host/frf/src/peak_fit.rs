//! Peaks of a receptance by a local fit of one pole, with the covariance of its parameters.

use std::f64::consts::TAU;

use nalgebra::{Matrix4, Vector4};
use num_complex::Complex64;
use quietcut_numerics::statistics::student_ninety_percent;

use super::criteria::{FITTED_LINES_MIN, FITTED_PART, LEAST_COMPARED_PEAK, PEAK_ABOVE_NOISE};
use super::table::{Frf, FrfTable};

/// A peak of a receptance, with standard deviations from the residual of its fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedPeak {
    /// Natural frequency |p|/2π, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz.
    pub frequency_std_hz: f64,
    /// Damping ratio −Re p/|p|.
    pub damping_ratio: f64,
    /// Standard deviation of the damping ratio.
    pub damping_ratio_std: f64,
    /// |H| of the fit at the frequency Im p/2π, m/N.
    pub receptance: f64,
    /// Standard deviation of |H|, m/N.
    pub receptance_std: f64,
    /// Degrees of freedom of the standard deviations.
    pub freedoms: usize,
}

impl FittedPeak {
    /// Half the width of a 90 % interval, in standard deviations.
    pub fn ninety_percent(&self) -> f64 {
        student_ninety_percent(self.freedoms)
    }
}

/// Peaks of one receptance of a table, in the order of its lines, each with a fit: the maxima of |H| above
/// `LEAST_COMPARED_PEAK` of the largest, from which |H| falls to below half the power on both sides before it rises
/// above the maximum.
///
/// Around a peak, H(s) = (c₀ + c₁ s + c₂ s²)/(s − p) with complex constants: one pole, and the other modes as a
/// straight line. It is fitted by Sanathanan–Koerner iteration, then by Gauss–Newton steps, to the lines around the
/// peak with at least `FITTED_PART` of it, widened to `FITTED_LINES_MIN` lines. The covariance of the complex
/// parameters is σ²(JᴴJ)⁻¹, with σ² multiplied by 1 + 2(ρ₁ + ρ₂) if this is above 1, where ρ_j is the autocorrelation
/// of the residual at a lag of j lines: a Hann window correlates neighbouring lines.
///
/// Peaks are left out if there are fewer than `FITTED_LINES_MIN` lines around them, the equations are singular, the
/// pole is farther from the peak than half the width of the fitted band, or the damping ratio or the size is not above
/// `PEAK_ABOVE_NOISE` standard deviations.
pub fn fitted_peaks(table: &FrfTable, entry: &Frf) -> Vec<FittedPeak> {
    let size: Vec<f64> = entry.receptance.iter().map(|h| h.norm()).collect();
    let largest = size.iter().copied().fold(0.0, f64::max);
    let mut peaks = Vec::new();
    let mut from = 0;
    // Each search begins at the first line after the previous peak that is below half the power of that peak.
    while let Some(peak) = next_peak(&size, from, LEAST_COMPARED_PEAK * largest) {
        let above = |line: &usize| size[*line] >= FITTED_PART * size[peak];
        let first = (0..peak).rev().take_while(above).last().unwrap_or(peak);
        let last = (peak..size.len()).take_while(above).last().unwrap_or(peak);
        let lines = widened(first..last + 1, size.len());
        if let Some(found) = fit(
            &table.frequency_hz()[lines.clone()],
            &entry.receptance[lines.clone()],
            table.frequency_hz()[peak],
        ) {
            peaks.push(found);
        }
        from = (peak + 1..size.len())
            .find(|&line| size[line] < size[peak] * std::f64::consts::FRAC_1_SQRT_2)
            .unwrap_or(size.len());
    }
    peaks
}

/// Index of the first maximum from the line `from` on that is above `least` and from which |H| falls on both sides
/// below half the power before it rises above the maximum; `None` if there is none.
fn next_peak(size: &[f64], from: usize, least: f64) -> Option<usize> {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    (from.max(1)..size.len().saturating_sub(1)).find(|&line| {
        let is_maximum = size[line] > size[line - 1] && size[line] >= size[line + 1] && size[line] > least;
        let below = |other: &usize| size[*other] < half * size[line];
        let higher = |other: &usize| size[*other] > size[line];
        let stands_out = |mut lines: Box<dyn Iterator<Item = usize>>| {
            lines
                .find(|other| below(other) || higher(other))
                .is_some_and(|other| below(&other))
        };
        is_maximum && stands_out(Box::new((0..line).rev())) && stands_out(Box::new(line + 1..size.len()))
    })
}

/// The range widened equally on both sides until it has `FITTED_LINES_MIN` lines or one more; the part beyond the
/// `count` lines of the table is cut off.
fn widened(lines: std::ops::Range<usize>, count: usize) -> std::ops::Range<usize> {
    let lacking = FITTED_LINES_MIN.saturating_sub(lines.len()).div_ceil(2);
    lines.start.saturating_sub(lacking)..(lines.end + lacking).min(count)
}

/// Number of complex parameters of the fit.
const PARAMETERS: usize = 4;

/// Number of Sanathanan–Koerner iterations, and of Gauss–Newton steps. A choice: both usually converge within a few.
const ITERATIONS: usize = 12;

/// Fit of one pole and a quadratic numerator to the receptances `h`; `None` for a peak that [`fitted_peaks`] leaves
/// out.
fn fit(frequency_hz: &[f64], h: &[Complex64], peak_hz: f64) -> Option<FittedPeak> {
    if h.len() < FITTED_LINES_MIN {
        return None;
    }
    // s = i(ω − ω₀)/Δ, with ω₀ at the peak and half the width Δ of the fitted band.
    let span_hz = 0.5 * (frequency_hz.last()? - frequency_hz.first()?);
    let scale = h.iter().map(|h| h.norm()).fold(0.0, f64::max);
    let s: Vec<Complex64> = frequency_hz
        .iter()
        .map(|hertz| Complex64::new(0.0, (hertz - peak_hz) / span_hz))
        .collect();
    let h: Vec<Complex64> = h.iter().map(|h| h / scale).collect();
    // Sanathanan–Koerner: H s = p H + c₀ + c₁ s + c₂ s², weighted with 1/(s − p) of the pole p of the previous
    // iteration.
    let mut found = Vector4::new(
        Complex64::new(-0.5, 0.0),
        Complex64::ZERO,
        Complex64::ZERO,
        Complex64::ZERO,
    );
    for _ in 0..ITERATIONS {
        let weight = |s: Complex64| (s - found[0]).inv();
        let rows = s.iter().zip(&h).map(|(&s, &h)| {
            let row = Vector4::new(h, Complex64::ONE, s, s * s) * weight(s);
            (row, h * s * weight(s))
        });
        found = solved(rows)?.0;
    }
    let model = |found: &Vector4<Complex64>, s: Complex64| {
        (found[1] + found[2] * s + found[3] * s * s) / (s - found[0])
    };
    let derivatives = |found: &Vector4<Complex64>, s: Complex64| {
        let inverse = (s - found[0]).inv();
        Vector4::new(model(found, s) * inverse, inverse, s * inverse, s * s * inverse)
    };
    let mut inverse = Matrix4::zeros();
    for _ in 0..ITERATIONS {
        let rows = s
            .iter()
            .zip(&h)
            .map(|(&s, &h)| (derivatives(&found, s), h - model(&found, s)));
        let (step, normal) = solved(rows)?;
        found += step;
        inverse = normal;
    }
    let residual: Vec<Complex64> = s.iter().zip(&h).map(|(&s, &h)| h - model(&found, s)).collect();
    let energy: f64 = residual.iter().map(|r| r.norm_sqr()).sum();
    let variance = energy / (h.len() - PARAMETERS) as f64 * correlation(&residual, energy);
    let delta = TAU * span_hz;
    let pole = Complex64::new(0.0, TAU * peak_hz) + found[0] * delta;
    // The real and the imaginary part of a complex parameter each have half of its variance.
    let pole_std = (0.5 * variance * inverse[(0, 0)].re).sqrt() * delta;
    let at_peak = Complex64::new(0.0, found[0].im);
    let gradient = derivatives(&found, at_peak);
    let receptance_variance = variance * (gradient.transpose() * inverse * gradient.conjugate())[(0, 0)].re;
    let damping_ratio = -pole.re / pole.norm();
    let receptance = model(&found, at_peak).norm();
    let receptance_std = (0.5 * receptance_variance).sqrt();
    let is_resonance = found[0].im.abs() <= 1.0
        && damping_ratio > PEAK_ABOVE_NOISE * pole_std / pole.norm()
        && receptance > PEAK_ABOVE_NOISE * receptance_std;
    is_resonance.then(|| FittedPeak {
        frequency_hz: pole.norm() / TAU,
        frequency_std_hz: pole_std / TAU,
        damping_ratio,
        damping_ratio_std: pole_std / pole.norm(),
        receptance: scale * receptance,
        receptance_std: scale * receptance_std,
        freedoms: 2 * (h.len() - PARAMETERS),
    })
}

/// Least-squares solution of rows (a, b) with aᵀx = b, and the inverse of the normal matrix Σ a* aᵀ; `None` if that
/// matrix is singular or the solution is not finite.
fn solved(
    rows: impl Iterator<Item = (Vector4<Complex64>, Complex64)>,
) -> Option<(Vector4<Complex64>, Matrix4<Complex64>)> {
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for (row, value) in rows {
        let conjugate = row.conjugate();
        normal += conjugate * row.transpose();
        right += conjugate * value;
    }
    let inverse = normal.try_inverse()?;
    let solution = inverse * right;
    solution
        .iter()
        .all(|x| x.is_finite())
        .then_some((solution, inverse))
}

/// Factor by which the correlation of the residual increases the variance of a smooth fit: 1 + 2(ρ₁ + ρ₂) with the
/// autocorrelation ρ_j of the residual at the lag j, but at least 1. `energy` is the sum of the squared residuals.
fn correlation(residual: &[Complex64], energy: f64) -> f64 {
    let lag = |lag: usize| -> f64 {
        let pairs = residual.iter().zip(residual.get(lag..).unwrap_or_default());
        pairs.map(|(a, b)| (a * b.conj()).re).sum::<f64>() / energy
    };
    if energy > 0.0 {
        (1.0 + 2.0 * (lag(1) + lag(2))).max(1.0)
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use quietcut_model::structure::Direction;
    use quietcut_testkit::rates::assert_share;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const MODES: [(f64, f64, f64); 2] = [(812.0, 0.025, 0.4), (1530.0, 0.015, 0.6)];

    /// Sum of real modes: frequency, Hz, damping ratio, modal mass, kg.
    fn receptance(modes: &[(f64, f64, f64)], hertz: f64) -> Complex64 {
        let omega = TAU * hertz;
        modes
            .iter()
            .map(|(own, damping, mass)| {
                let own = TAU * own;
                (mass * Complex64::new(own * own - omega * omega, 2.0 * damping * own * omega)).inv()
            })
            .sum()
    }

    fn table(noise: f64, seed: u64) -> FrfTable {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let frequency_hz: Vec<f64> = (300..1000).map(|line| 2.0 * f64::from(line)).collect();
        let receptance = frequency_hz
            .iter()
            .map(|&hertz| {
                let [re, im]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
                receptance(&MODES, hertz) + noise * Complex64::new(re, im)
            })
            .collect();
        let entry = Frf {
            response: Direction::X,
            force: Direction::X,
            receptance,
            coherence: None,
            folding: None,
        };
        FrfTable::new(Path::new("fit"), frequency_hz, vec![entry]).unwrap()
    }

    #[test]
    fn peaks_of_two_modes_are_fitted() {
        let table = table(0.0, 0);
        let peaks = fitted_peaks(&table, &table.entries()[0]);
        assert_eq!(peaks.len(), 2, "{peaks:?}");
        for (found, (hertz, damping, _)) in peaks.iter().zip(MODES) {
            // The conjugate pole and the other mode are a straight line only nearly, over four bandwidths of 40 Hz.
            assert!((found.frequency_hz / hertz - 1.0).abs() < 1e-4, "{found:?}");
            assert!((found.damping_ratio / damping - 1.0).abs() < 5e-3, "{found:?}");
            let truth = receptance(&MODES, hertz * (1.0 - damping * damping).sqrt()).norm();
            assert!((found.receptance / truth - 1.0).abs() < 1e-3, "{found:?} {truth}");
        }
    }

    #[test]
    fn intervals_of_peaks_hold_the_truth() {
        let noise = 0.03 * receptance(&MODES, 812.0).norm();
        let (mut held, mut others) = ([0; 3], 0);
        let count = 400;
        for seed in 0..count {
            let table = table(noise, 1000 + seed);
            let peaks = fitted_peaks(&table, &table.entries()[0]);
            others += peaks
                .iter()
                .filter(|peak| {
                    MODES
                        .iter()
                        .all(|mode| (peak.frequency_hz / mode.0).ln().abs() > 0.02)
                })
                .count();
            let Some(found) = peaks.iter().find(|peak| (peak.frequency_hz - 812.0).abs() < 16.0) else {
                continue;
            };
            let (hertz, damping, _) = MODES[0];
            let truth = receptance(&MODES, hertz * (1.0 - damping * damping).sqrt()).norm();
            let most = found.ninety_percent();
            held[0] += usize::from((found.frequency_hz - hertz).abs() < most * found.frequency_std_hz);
            held[1] += usize::from((found.damping_ratio - damping).abs() < most * found.damping_ratio_std);
            held[2] += usize::from((found.receptance - truth).abs() < most * found.receptance_std);
        }
        println!(
            "seeds 1000 to {}: {held:?}, {others} peaks of noise",
            1000 + count
        );
        // Noise of 3 % of the peak exceeds a tenth of it at some lines of each table; hardly any is taken for a peak.
        assert!(others < 20, "{others}");
        for (what, held) in ["frequency", "damping", "receptance"].into_iter().zip(held) {
            assert_share(what, 0.9, held, count as usize);
        }
    }
}
