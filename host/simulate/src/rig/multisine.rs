//! Multisine of random phases: the lines of a period that it excites.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Signal;

/// Lines of a multisine, multiples of the reciprocal of its period, that are excited within its band.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MultisineLines {
    /// All lines.
    All,
    /// Odd lines: even nonlinear distortion falls on lines without force.
    Odd,
    /// Odd lines, of which one in every full group of three, chosen at random, is left out: even and odd distortion
    /// fall on lines without force (Pintelon and Schoukens, System Identification, 2nd ed. 2012, section 4.3).
    OddSparse,
}

impl Signal {
    /// Random-phase multisine of the period `period_s` with the root mean square `rms_n` and equal amplitudes at its
    /// lines from `first_hz` to `last_hz`, for `seconds`. The phases come from `seed`; the lines that are left out are
    /// the same for every seed, so that realizations can be averaged.
    ///
    /// Without a line in the band it has no tones.
    pub fn multisine(
        [first_hz, last_hz]: [f64; 2],
        period_s: f64,
        lines: MultisineLines,
        rms_n: f64,
        seconds: f64,
        seed: u64,
    ) -> Self {
        // A line at an end of the band belongs to the band in spite of rounding.
        let first = (first_hz * period_s * (1.0 - 1e-9)).ceil().max(1.0) as u64;
        let last = (last_hz * period_s * (1.0 + 1e-9)).floor() as u64;
        let mut left_out = ChaCha8Rng::seed_from_u64(first);
        let mut odd = 0_u32;
        let mut silent = 0_u32;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let tones: Vec<(f64, f64)> = (first..=last)
            .filter(|line| {
                if lines == MultisineLines::All {
                    return true;
                }
                if line.is_multiple_of(2) {
                    return false;
                }
                if odd.is_multiple_of(3) {
                    silent = left_out.random_range(0..3);
                }
                odd += 1;
                lines == MultisineLines::Odd || (odd - 1) % 3 != silent
            })
            .map(|line| (line as f64 / period_s, random.random_range(0.0..TAU)))
            .collect();
        // Each of n tones of amplitude a has the mean square a²/2.
        let amplitude_n = rms_n * (2.0 / tones.len().max(1) as f64).sqrt();
        Self::Tones {
            tones,
            first_n: amplitude_n,
            last_n: amplitude_n,
            seconds,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines_of(signal: &Signal, period_s: f64) -> Vec<u64> {
        let Signal::Tones { tones, .. } = signal else {
            panic!("a multisine has tones")
        };
        tones
            .iter()
            .map(|(hertz, _)| (hertz * period_s).round() as u64)
            .collect()
    }

    #[test]
    fn a_multisine_has_its_lines_and_its_root_mean_square() {
        for (choice, count) in [
            (MultisineLines::All, 81),
            (MultisineLines::Odd, 40),
            // Thirteen groups of three, and one line in a group that is not full.
            (MultisineLines::OddSparse, 27),
        ] {
            let signal = Signal::multisine([10.0, 30.0], 4.0, choice, 7.0, 8.0, 3);
            let lines = lines_of(&signal, 4.0);
            assert!(lines.len().abs_diff(count) <= 1, "{choice:?}: {}", lines.len());
            assert!(lines[0] >= 40 && *lines.last().unwrap() <= 120);
            assert!(choice == MultisineLines::All || lines.iter().all(|line| line % 2 == 1));
            // The mean over one period, sampled finely enough for all products of two tones.
            let samples: Vec<f64> = (0..1024)
                .map(|k| signal.force_n(4.0 * f64::from(k) / 1024.0))
                .collect();
            let mean_square = samples.iter().map(|f| f * f).sum::<f64>() / 1024.0;
            assert!(
                (mean_square.sqrt() - 7.0).abs() < 1e-9,
                "{choice:?}: {mean_square}"
            );
            // The same lines for another seed, with other phases; the signal repeats.
            let other = Signal::multisine([10.0, 30.0], 4.0, choice, 7.0, 8.0, 4);
            assert_eq!(lines_of(&other, 4.0), lines);
            assert!((other.force_n(0.5) - signal.force_n(0.5)).abs() > 1e-3);
            assert!((signal.force_n(4.7) - signal.force_n(0.7)).abs() < 1e-9);
        }
    }
}
