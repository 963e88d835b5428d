//! Anti-aliasing filter and decimation: attenuates components above half the output sampling rate, which would alias
//! into the band below it.

use std::f64::consts::{PI, TAU};

/// Half the length of the anti-aliasing filter, in output samples. With this length the Hann-windowed sinc attenuates
/// by more than 40 dB from half the output sampling rate on; the test of this file checks that from 0.52 of that rate
/// on.
const HALF: usize = 12;

/// The −6 dB frequency of the anti-aliasing filter as a fraction of the output sampling rate: the middle of the
/// transition band from 0.35 to 0.5.
const CORNER: f64 = 0.425;

/// Every `factor`-th sample of `samples`, from the first on, after a linear-phase low pass without delay and with unit
/// gain at 0 Hz (Hann-windowed sinc). The signal is extended by its first and last values. A `factor` of 0 or 1 leaves
/// `samples` unchanged.
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

/// Weight, before normalization, of the anti-aliasing filter for an input sample at a distance of `u` output samples
/// from the filter's centre.
fn weight(u: f64) -> f64 {
    let angle = TAU * CORNER * u;
    let sinc = if u == 0.0 { 1.0 } else { angle.sin() / angle };
    sinc * 0.5 * (1.0 + (PI * u / HALF as f64).cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pass_band_is_flat_and_aliasing_components_are_removed() {
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
                // Pass-band ripple of the Hann-windowed sinc.
                assert!((found[k] - expected).abs() < 8e-3);
            }
        }
        for part in [0.52, 0.7, 0.98, 1.5, 2.03] {
            let found = decimated(tone(part), factor);
            // 40 dB at the edge of the stop band, and more beyond.
            assert!(middle.clone().all(|k| found[k].abs() < 1e-2), "{part}");
        }
    }
}
