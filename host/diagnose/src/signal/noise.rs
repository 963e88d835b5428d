//! Noise floors: the standard deviation of the noise of a channel, estimated from its residual.
//!
//! Sensor noise is assumed white over the band of the record. Any other part of a residual is assumed to lie above the
//! noise floor in some frequency bands only, so that the other bands show the floor.

use crate::criteria::{LEAST_RELATIVE_NOISE, LEAST_WHITE_SHARE};
use crate::signal::grid::SegmentTransform;
use quietcut_numerics::statistics::median;

/// Number of frequency bands of equal width, up to half the sample rate, in which a noise floor is estimated.
pub(crate) const BANDS: usize = 32;

/// Standard deviation of the white noise in `residual`; `size` is the root mean square of the channel.
///
/// The variance is first the lower quartile, over 32 frequency bands, of the mean of the periodogram in a band. It is
/// then repeatedly the mean over all bands within three standard deviations of it, which are nearly all bands if the
/// residual is noise alone. For fewer than 128 samples the standard deviation is the root mean square of the residual.
/// It is always at least `LEAST_RELATIVE_NOISE` times `size`.
pub(crate) fn white_floor(residual: &[f64], size: f64) -> f64 {
    white_floor_beside(residual, size, &[0.0; BANDS])
}

/// [`white_floor`] of a residual that also contains noise of another origin. `other` holds the power of that noise in
/// each of the [`BANDS`] from zero to half the sample rate, scaled so that the mean over the bands is the variance of
/// one sample.
pub(crate) fn white_floor_beside(residual: &[f64], size: f64, other: &[f64; BANDS]) -> f64 {
    floor(residual, size, mean, 1.0, other)
}

/// [`white_floor`] of a residual with spectral lines in every band, as in a cut. Each band uses the median of the
/// periodogram, which few lines hardly change.
pub(crate) fn floor_between_lines(residual: &[f64], size: f64) -> f64 {
    let of_band = |squares: &mut [f64]| median(squares).unwrap_or(0.0) / MEDIAN;
    floor(residual, size, of_band, MEDIAN_SPREAD, &[0.0; BANDS])
}

/// Median of the square of a unit-variance normal variable.
const MEDIAN: f64 = 0.454_936;
/// Standard deviation of the noise variance estimated from the median of squares, over that of the one estimated from
/// their mean.
const MEDIAN_SPREAD: f64 = 1.65;

fn mean(squares: &mut [f64]) -> f64 {
    squares.iter().sum::<f64>() / squares.len().max(1) as f64
}

fn floor(
    residual: &[f64],
    size: f64,
    of_band: fn(&mut [f64]) -> f64,
    scatter: f64,
    other: &[f64; BANDS],
) -> f64 {
    let least = (LEAST_RELATIVE_NOISE * size).max(f64::MIN_POSITIVE);
    let count = residual.len();
    if count < 4 * BANDS {
        return rms(residual).max(least);
    }
    // White part of a band's noise: all noise minus the known other noise, at least the share `LEAST_WHITE_SHARE`.
    let white = |all: f64, other: f64| (all - other).max(LEAST_WHITE_SHARE * all);
    let bands: Vec<(f64, f64)> = band_means(residual, of_band).into_iter().zip(*other).collect();
    let mut sorted: Vec<f64> = bands.iter().map(|(all, other)| white(*all, *other)).collect();
    sorted.sort_by(f64::total_cmp);
    let per_band = (count / (2 * BANDS)) as f64;
    // The Hann window correlates neighbouring bins: a third of them count as independent.
    let spread = 3.0 * scatter * (3.0 / per_band).sqrt();
    let mut level = sorted[BANDS / 4];
    for _ in 0..8 {
        let near: Vec<(f64, f64)> = bands
            .iter()
            .copied()
            .filter(|(all, other)| {
                let expected = level + other;
                *all <= expected * (1.0 + spread) && *all >= expected / (1.0 + spread)
            })
            .collect();
        if near.is_empty() {
            break;
        }
        // The standard deviation of a frequency band's noise variance is proportional to that variance. A band with
        // much noise of other origin therefore gets little weight.
        let weight = |other: f64| (level / (level + other)).powi(2);
        let whole: f64 = near.iter().map(|(_, other)| weight(*other)).sum();
        let mean = |of: fn(&(f64, f64)) -> f64| {
            near.iter().map(|band| weight(band.1) * of(band)).sum::<f64>() / whole
        };
        let next = white(mean(|band| band.0), mean(|band| band.1));
        if (next - level).abs() <= 1e-9 * level {
            break;
        }
        level = next;
    }
    level.sqrt().max(least)
}

/// Average of the periodogram of `residual` in each frequency band by the estimator `of_band` (mean or median): the
/// variance σ² of a sample for white noise.
fn band_means(residual: &[f64], of_band: fn(&mut [f64]) -> f64) -> Vec<f64> {
    let count = residual.len();
    let mean = residual.iter().sum::<f64>() / count as f64;
    let mut power = 0.0;
    let windowed: Vec<f64> = residual
        .iter()
        .enumerate()
        .map(|(n, x)| {
            let hann = (std::f64::consts::PI * (n as f64 + 0.5) / count as f64)
                .sin()
                .powi(2);
            power += hann * hann;
            hann * (x - mean)
        })
        .collect();
    let mut parts = Vec::with_capacity(count);
    let bins = count / 2;
    SegmentTransform::new(count).bins(&windowed, bins, &mut parts);
    let scale = count as f64 / power;
    (0..BANDS)
        .map(|band| {
            let from = (parts.len() * band / BANDS).max(3);
            let to = parts.len() * (band + 1) / BANDS;
            let mut squares: Vec<f64> = parts[from..to].iter().map(|x| x * x).collect();
            scale * of_band(&mut squares)
        })
        .collect()
}

/// Number of samples of each window over which [`floor_between_impacts`] computes the variance.
const WINDOW: usize = 256;

/// Standard deviation of the noise of a channel that is zero most of the time, such as the force of a hammer: from the
/// lower quartile of the variances of windows. The spectrum of impacts reaches to the end of the band and would hide a
/// noise floor. Infinite for a record of fewer than four windows.
pub(crate) fn floor_between_impacts(samples: &[f64]) -> f64 {
    let mut squares: Vec<f64> = samples
        .chunks_exact(WINDOW)
        .map(|window| {
            let mean = window.iter().sum::<f64>() / WINDOW as f64;
            window.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (WINDOW - 1) as f64
        })
        .collect();
    let quarter = squares.len() / 4;
    if quarter == 0 {
        return f64::INFINITY;
    }
    squares.select_nth_unstable_by(quarter, f64::total_cmp).1.sqrt()
}

/// Root mean square of the samples.
pub(crate) fn rms(samples: &[f64]) -> f64 {
    (samples.iter().map(|x| x * x).sum::<f64>() / samples.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn lines_in_every_band_do_not_raise_the_floor_between_them() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let residual: Vec<f64> = (0..6000)
            .map(|n| {
                let noise: f64 = StandardNormal.sample(&mut random);
                // Spectral lines at every 48.3rd bin, as in a cut of 24 revolutions with two teeth.
                let t = std::f64::consts::TAU * f64::from(n) / 6000.0;
                noise + (1..62).map(|k| (48.3 * f64::from(k) * t).sin()).sum::<f64>()
            })
            .collect();
        let size = rms(&residual);
        let floor = floor_between_lines(&residual, size);
        // A line and its leakage through the Hann window exceed the noise in 6 of 48.3 bins. The median of the power is
        // then at most the quantile 0.5/0.876 = 0.571 of the noise alone, −ln(1 − 0.571)/ln 2 = 1.22 times its median:
        // 10.5 % more in amplitude. Three standard deviations of the median of 3 000 powers, of which every second is
        // independent, are 5.5 %.
        assert!((0.945..1.16).contains(&floor), "{floor}");
        assert!(white_floor(&residual, size) > 1.5);
    }

    #[test]
    fn the_floor_of_a_sensor_is_found_beside_known_other_noise() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        // The differences of white noise with standard deviation 2 have the power 4·|1 − e^(−iω)|²: zero at ω = 0,
        // sixteen at half the sample rate.
        let mut last = 0.0;
        let residual: Vec<f64> = (0..6000)
            .map(|_| {
                let next = 2.0 * draw();
                let difference = next - last;
                last = next;
                draw() + difference
            })
            .collect();
        let power = |band: usize| {
            4.0 * (2.0 - 2.0 * (std::f64::consts::PI * (band as f64 + 0.5) / BANDS as f64).cos())
        };
        let size = rms(&residual);
        let floor = white_floor_beside(&residual, size, &std::array::from_fn(power));
        // Without other noise, three standard deviations are 6 %. With other noise of up to sixteen times the power,
        // the uncertainty is twice that.
        assert!((floor - 1.0).abs() < 0.12, "{floor}");
        assert!(white_floor(&residual, size) > 1.3);
    }

    #[test]
    fn the_floor_does_not_depend_on_tones() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for tone in [0.0, 50.0] {
            let signal: Vec<f64> = (0..6000)
                .map(|n| {
                    let noise: f64 = StandardNormal.sample(&mut random);
                    let t = n as f64;
                    noise + tone * ((0.31 * t).sin() + (0.2 * t + 1e-5 * t * t).sin())
                })
                .collect();
            let floor = white_floor(&signal, rms(&signal));
            // With 6000 samples, most bins being away from the tones, three standard deviations are 2 %.
            assert!((floor - 1.0).abs() < 0.04, "{tone}: {floor}");
        }
    }

    #[test]
    fn the_floor_of_a_hammer_is_that_between_its_impacts() {
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let force: Vec<f64> = (0..40_000)
            .map(|n| {
                let noise: f64 = StandardNormal.sample(&mut random);
                // Impacts: half a sine of 20 samples, every 5 s at 2 kHz.
                let impact = (std::f64::consts::PI * f64::from(n % 10_000) / 20.0).sin();
                noise + if n % 10_000 < 20 { 5000.0 * impact } else { 0.0 }
            })
            .collect();
        let floor = floor_between_impacts(&force);
        // The lower quartile of variances of 256 samples is 6 % below their mean; 156 windows determine it within 1 %.
        assert!((0.95..0.99).contains(&floor), "{floor}");
        assert!(white_floor(&force, rms(&force)) > 1.2);
    }
}
