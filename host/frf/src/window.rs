//! Time windows of segments, the number of independent averages of overlapping segments, and lengths for a fast FFT.

use std::f64::consts::TAU;

/// Time window that weights the samples of a segment before the Fourier transform.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Window {
    /// Rectangular window w = 1, for transients that begin and end at rest within the segment.
    Rectangular,
    /// Hann window w_k = ½ − ½ cos(2πk/N), whose side lobes fall fastest of the three windows.
    #[default]
    Hann,
    /// Hamming window w_k = 0.54 − 0.46 cos(2πk/N), which has the lowest first side lobes of the three windows.
    Hamming,
}

impl Window {
    /// Window weights w_k, k = 0 … N − 1, for N = `length` samples, with period N.
    pub fn weights(self, length: usize) -> Vec<f64> {
        let raised_cosine = |mean: f64| -> Vec<f64> {
            (0..length)
                .map(|k| mean - (1.0 - mean) * (TAU * k as f64 / length as f64).cos())
                .collect()
        };
        match self {
            Self::Rectangular => vec![1.0; length],
            Self::Hann => raised_cosine(0.5),
            Self::Hamming => raised_cosine(0.54),
        }
    }
}

/// Effective number of independent averages of n = `segments` segments whose starts are `shift` samples apart (Welch
/// 1967).
///
/// n_eff = n / (1 + 2 Σ_j (1 − j/n) ρ_j²), where ρ_j = Σ_k w_k w_{k+j·shift} / Σ_k w_k² is the correlation of segments
/// j apart.
pub(super) fn effective_averages(weights: &[f64], shift: usize, segments: usize) -> f64 {
    let energy: f64 = weights.iter().map(|w| w * w).sum();
    let mut shared = 0.0;
    for j in 1..segments {
        let Some(rest) = weights.get(j * shift.max(1)..).filter(|rest| !rest.is_empty()) else {
            break;
        };
        let product: f64 = rest.iter().zip(weights).map(|(a, b)| a * b).sum();
        shared += (1.0 - j as f64 / segments as f64) * (product / energy).powi(2);
    }
    segments as f64 / (1.0 + 2.0 * shared)
}

/// Smallest even transform length ≥ `length` with prime factors 2, 3 and 5 only, for which the FFT is fast.
pub(super) fn fast_length(length: usize) -> usize {
    let is_fast = |mut number: usize| {
        for factor in [2, 3, 5] {
            while number.is_multiple_of(factor) {
                number /= factor;
            }
        }
        number == 1
    };
    let mut even = length.max(2).next_multiple_of(2);
    while !is_fast(even) {
        even += 2;
    }
    even
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_overlap_of_a_hann_window_reduces_the_effective_averages() {
        let weights = Window::Hann.weights(1000);
        // ρ = 1/6 at half overlap: n/(1 + 2·(1 − 1/n)/36).
        let expected = 15.0 / (1.0 + 2.0 * (14.0 / 15.0) / 36.0);
        assert!((effective_averages(&weights, 500, 15) - expected).abs() < 1e-9);
        let rectangular = Window::Rectangular.weights(1000);
        assert_eq!(effective_averages(&rectangular, 1000, 15), 15.0);
        assert_eq!(effective_averages(&rectangular, 1000, 1), 1.0);
    }

    #[test]
    fn fast_lengths_have_small_factors() {
        for (length, fast) in [(0, 2), (7, 8), (11, 12), (1021, 1024), (614_400, 614_400)] {
            assert_eq!(fast_length(length), fast);
        }
    }
}
