//! Local pole of a decaying oscillation: rate of decay and frequency within a short window, with their noise.
//!
//! With a window w(τ) = cos⁴(πτ/L) for |τ| < L/2 about the time t, and a carrier of the frequency ω,
//!
//!   Z(t) = ∫w(τ) x(t + τ) e^(−iωτ) dτ,  Z′(t) = −∫w′(τ) x(t + τ) e^(−iωτ) dτ + iω Z(t),
//!
//! so that Z′/Z is the pole p of x = Re(c·e^(pt)) exactly, whatever L is, but for the image at −ω. For a motion whose
//! rate of decay and frequency change with the amplitude, Z′/Z is their mean over the window with the weights w·A. The
//! transform of w falls with the fifth power of the frequency: over eight periods the image is a part of 1e-6. White
//! noise of the samples is a linear functional of Z′/Z to first order: see [`LocalPole::noise`].

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

/// The window w and its derivative at the samples about the centre.
#[derive(Clone, Debug)]
pub(super) struct DecayWindow {
    /// Samples on each side of the centre.
    pub(super) half: usize,
    weights: Vec<f64>,
    /// Derivative of w over time, 1/s.
    slopes: Vec<f64>,
    pub(super) rate_hz: f64,
}

/// Z and Z′ − iωZ of a window, and what follows from them.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalPole {
    /// Index of the centre of the window among the samples.
    pub(super) centre: usize,
    /// Frequency of the carrier, rad/s.
    omega: f64,
    /// Sum of w·x·e^(−iωτ) over the samples.
    sum: Complex64,
    /// The pole Z′/Z, rad/s.
    pub(super) pole: Complex64,
    /// Amplitude 2|Z|/Σw, in the unit of the samples.
    pub(super) amplitude: f64,
}

/// Rate of decay and frequency as smooth functions of the amplitude.
pub(super) trait AmplitudeLaw {
    /// −dA/dt, per second, at the amplitude A.
    fn decline(&self, amplitude: f64) -> f64;
    /// Frequency, rad/s, at the amplitude A.
    fn omega(&self, amplitude: f64) -> f64;
}

impl DecayWindow {
    /// The window of the length `length_s` at `rate_hz` samples per second.
    pub(super) fn new(length_s: f64, rate_hz: f64) -> Self {
        let half = (0.5 * length_s * rate_hz).round().max(1.0) as usize;
        let length_s = 2.0 * half as f64 / rate_hz;
        let angle = |at: usize| PI * (at as f64 - half as f64) / rate_hz / length_s;
        Self {
            half,
            weights: (0..=2 * half).map(|at| angle(at).cos().powi(4)).collect(),
            slopes: (0..=2 * half)
                .map(|at| -4.0 * PI / length_s * angle(at).cos().powi(3) * angle(at).sin())
                .collect(),
            rate_hz,
        }
    }

    /// Length of the window, s.
    pub(super) fn length_s(&self) -> f64 {
        2.0 * self.half as f64 / self.rate_hz
    }

    fn total(&self) -> f64 {
        self.weights.iter().sum()
    }

    fn carrier(&self, omega: f64) -> impl Iterator<Item = Complex64> {
        let (half, rate_hz) = (self.half as f64, self.rate_hz);
        (0..self.weights.len()).map(move |at| Complex64::cis(-omega * (at as f64 - half) / rate_hz))
    }

    /// Local pole about the sample `centre` with a carrier of the frequency `omega`, rad/s; `None` where the window
    /// reaches beyond the samples or the samples vanish.
    pub(super) fn local(&self, samples: &[f64], centre: usize, omega: f64) -> Option<LocalPole> {
        let first = centre.checked_sub(self.half)?;
        let within = samples.get(first..=centre + self.half)?;
        let (mut sum, mut slope) = (Complex64::ZERO, Complex64::ZERO);
        for (((x, w), s), carrier) in within
            .iter()
            .zip(&self.weights)
            .zip(&self.slopes)
            .zip(self.carrier(omega))
        {
            sum += w * x * carrier;
            slope -= s * x * carrier;
        }
        (sum.norm_sqr() > 0.0).then(|| LocalPole {
            centre,
            omega,
            sum,
            pole: slope / sum + Complex64::new(0.0, omega),
            amplitude: 2.0 * sum.norm() / self.total(),
        })
    }

    /// |Z|² per variance of a white noise: the mean of `|Z|²/Σw²` is the variance of the samples.
    pub(super) fn noise_variance(&self, samples: &[f64], centre: usize, omega: f64) -> Option<f64> {
        let energy: f64 = self.weights.iter().map(|w| w * w).sum();
        Some(self.local(samples, centre, omega)?.sum.norm_sqr() / energy)
    }

    /// Standard deviation of [`LocalPole::amplitude`] for a white noise of unit variance.
    pub(super) fn amplitude_noise(&self) -> f64 {
        let energy: f64 = self.weights.iter().map(|w| w * w).sum();
        (2.0 * energy).sqrt() / self.total()
    }

    /// Local pole that this window finds at the centre of a motion with the amplitude `amplitude` and the phase of
    /// `like` there, which follows `law`: dA/dt = −`decline`(A), dφ/dt = `omega`(A), by the midpoint rule over the
    /// sample interval.
    pub(super) fn local_of_law(
        &self,
        law: &impl AmplitudeLaw,
        amplitude: f64,
        like: &LocalPole,
    ) -> Option<LocalPole> {
        let mut samples = vec![0.0; 2 * self.half + 1];
        let phase = like.sum.arg();
        samples[self.half] = amplitude * phase.cos();
        for sign in [-1.0, 1.0] {
            let step = sign / self.rate_hz;
            let (mut size, mut angle) = (amplitude, phase);
            for offset in 1..=self.half {
                let middle = (size - 0.5 * step * law.decline(size)).max(0.0);
                angle += step * law.omega(middle);
                size = (size - step * law.decline(middle)).max(0.0);
                let at = if sign > 0.0 {
                    self.half + offset
                } else {
                    self.half - offset
                };
                samples[at] = size * angle.cos();
            }
        }
        self.local(&samples, self.half, like.omega)
    }
}

impl LocalPole {
    /// Complex weights of the samples in the first-order deviation of the pole: δp = Σ κ_j δx_j with
    /// κ = −(w′ + q·w)·e^(−iωτ)/Z and q = p − iω.
    pub(super) fn noise(&self, window: &DecayWindow) -> Vec<Complex64> {
        let q = self.pole - Complex64::new(0.0, self.omega);
        window
            .weights
            .iter()
            .zip(&window.slopes)
            .zip(window.carrier(self.omega))
            .map(|((w, s), carrier)| -(q * *w + *s) * carrier / self.sum)
            .collect()
    }
}

/// Covariance Re Σ κ_j κ*_j /2 of the real parts of two local poles, and of their imaginary parts, for a white noise of
/// unit variance; `first` is the earlier one. The phases of the carriers at the two centres are those of the motion.
pub(super) fn covariance(
    window: &DecayWindow,
    (first, of_first): (&LocalPole, &[Complex64]),
    (second, of_second): (&LocalPole, &[Complex64]),
) -> f64 {
    let Some(lag) = second.centre.checked_sub(first.centre) else {
        return 0.0;
    };
    if lag > 2 * window.half {
        return 0.0;
    }
    let sum: Complex64 = of_first[lag..]
        .iter()
        .zip(of_second)
        .map(|(a, b)| a * b.conj())
        .sum();
    0.5 * sum.re
}

/// Frequency in rad/s from Hz.
pub(super) fn rad_per_s(hertz: f64) -> f64 {
    TAU * hertz
}
