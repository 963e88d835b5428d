//! The filter before a sampler: what is above half the sample rate would fold back into the band.

use std::f64::consts::{PI, TAU};

/// Half the length of the filter, in samples of the result.
const HALF: usize = 12;

/// Where the filter lets half through, as a part of the sample rate of the result: flat to 0.35, closed from 0.5.
const CORNER: f64 = 0.425;

/// Every `factor`-th sample of `samples` through a low pass of linear phase and gain 1, without delay: a sinc under a
/// Hann window. Beyond its ends the signal stays as it is there.
pub(super) fn decimated(samples: Vec<f64>, factor: usize) -> Vec<f64> {
    let Some(last) = samples.len().checked_sub(1).filter(|_| factor > 1) else {
        return samples;
    };
    let half = (HALF * factor) as isize;
    let weights: Vec<f64> = (-half..=half).map(|k| weight(k as f64 / factor as f64)).collect();
    let sum: f64 = weights.iter().sum();
    (0..=last)
        .step_by(factor)
        .map(|at| {
            let weighed = weights.iter().zip(-half..).map(|(weight, offset)| {
                let index = (at as isize + offset).clamp(0, last as isize) as usize;
                weight * samples[index]
            });
            weighed.sum::<f64>() / sum
        })
        .collect()
}

/// `u` samples of the result from the middle.
fn weight(u: f64) -> f64 {
    let angle = TAU * CORNER * u;
    let sinc = if u == 0.0 { 1.0 } else { angle.sin() / angle };
    sinc * 0.5 * (1.0 + (PI * u / HALF as f64).cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_band_passes_and_what_would_fold_back_does_not() {
        let factor = 8;
        let tone = |part: f64| -> Vec<f64> {
            let of = |k: usize| (TAU * part * k as f64 / factor as f64).cos();
            (0..8 * 400).map(of).collect()
        };
        let middle = HALF..400 - HALF;
        for part in [0.0, 0.02, 0.1, 0.3, 0.35] {
            let found = decimated(tone(part), factor);
            assert_eq!(found.len(), 400);
            for k in middle.clone() {
                let expected = (TAU * part * k as f64).cos();
                // Ripple of a Hann window.
                assert!((found[k] - expected).abs() < 8e-3);
            }
        }
        for part in [0.52, 0.7, 0.98, 1.5, 2.03] {
            let found = decimated(tone(part), factor);
            // 40 dB at the edge of the band, and far more beyond.
            assert!(middle.clone().all(|k| found[k].abs() < 1e-2), "{part}");
        }
    }
}
