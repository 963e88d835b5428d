//! Natural frequency and damping ratio of one mode over the amplitude of its free decay, with their intervals.
//!
//! Windows of the length of one time constant or a fifth of the decay, at least eight periods, give the local pole of the decay
//! (`decay_window`) and its amplitude. Rate of decay and frequency change within a window. This bias is that
//! of a motion which follows a smooth law of the amplitude: A·σ(A) a cubic polynomial, ω(A) a sum of 1/A, 1, A and A²
//! (Coulomb friction, viscous, quadratic and cubic terms). The law is fitted to the local poles, its own local poles
//! are computed in the same windows, and the difference is taken off.
//!
//! The noise is the median power of the record beside the mode, from 0.375 to 0.625 and from 1.375 to 1.625 of its
//! frequency, so that hum and harmonics do not enter. Neighbouring windows overlap; their covariance enters averages
//! and the test whether the curve is flat.

use std::f64::consts::{LN_2, TAU};

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::statistics::{NINETY_PERCENT, f_quantile, median, student_ninety_percent};
use quietcut_recording::Quantity;

use super::decay_window::{DecayWindow, LocalPole, covariance, rad_per_s};
use super::smooth_law::SmoothLaw;
use super::spectrum::peak_frequency_hz;
use crate::criteria::{
    CURVE_BIAS_SHARE, DECAY_AGAIN, DECAY_ENDS, FLAT_PROBABILITY, LEAST_CURVE_POINTS, LEAST_DECAY_TO_NOISE,
    LEAST_RELATIVE_DEVIATION, SMOOTH_PROBABILITY,
};

/// A mode at one amplitude of its free decay. Standard deviations are those of a normal distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecayPoint {
    /// Time at the centre of the window from the first sample, s.
    pub time_s: f64,
    /// Amplitude of the displacement, m. From a measured velocity or acceleration it is that amplitude over ω or ω².
    pub amplitude_m: f64,
    /// Standard deviation of the amplitude, m.
    pub amplitude_std_m: f64,
    /// Natural frequency |p|/2π, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the natural frequency, Hz.
    pub frequency_std_hz: f64,
    /// Damping ratio −Re p/|p|.
    pub damping_ratio: f64,
    /// Standard deviation of the damping ratio.
    pub damping_ratio_std: f64,
}

/// Natural frequency and damping ratio over the amplitude of a free decay.
#[derive(Clone, Debug, PartialEq)]
pub struct DecayCurve {
    /// Points by time: the amplitude falls, unless modes beat.
    pub points: Vec<DecayPoint>,
    /// Mean of the points, weighted with the squared amplitude, as a linear model fitted to the decay gives it; its
    /// amplitude and time are those of the first point.
    pub average: DecayPoint,
    /// True if frequency and damping are the same at all amplitudes within the noise: the F ratio of both stays below the
    /// quantile of `FLAT_PROBABILITY`.
    pub is_flat: bool,
    /// False if frequency and damping are no smooth function of the amplitude within the noise, as where two modes beat
    /// within the band. The standard deviations then contain the scatter about the smooth function.
    pub is_smooth: bool,
    /// Standard deviation of the noise of the samples about the frequency of the mode, in the unit of the samples.
    pub noise: f64,
    /// Length of the windows, s.
    pub window_s: f64,
}

/// A recorded free decay.
#[derive(Clone, Copy, Debug)]
pub struct DecayRecord<'a> {
    /// Samples of the motion, SI units.
    pub samples: &'a [f64],
    /// Quantity of the motion: displacement, velocity or acceleration.
    pub quantity: Quantity,
    /// Samples per second.
    pub rate_hz: f64,
    /// Band in which the frequency of the mode is sought, Hz; windows are at least as long as separates the mode from
    /// others outside of the band. `None`: the largest line of the spectrum.
    pub band_hz: Option<[f64; 2]>,
}

/// Reason why a record gives no curve over the amplitude.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DecayCurveError {
    /// The record is too short for the windows.
    #[error(
        "{seconds:.3} s are too short for frequency and damping over the amplitude of a mode at {frequency_hz:.4} Hz; at least {needed_s:.3} s from the \
         beginning of the decay are needed"
    )]
    TooShort {
        /// Duration of the record, s.
        seconds: f64,
        /// Frequency of the mode, Hz.
        frequency_hz: f64,
        /// Duration needed, s.
        needed_s: f64,
    },
    /// Too few windows hold a decay above the noise.
    #[error(
        "{points} windows hold a decay at {frequency_hz:.4} Hz above the noise, at least {needed} are needed: take a larger deflection, or name the mode by --band-hz",
        needed = LEAST_CURVE_POINTS
    )]
    Noise {
        /// Number of windows above the noise.
        points: usize,
        /// Frequency of the mode, Hz.
        frequency_hz: f64,
    },
}

/// Shortest window, in periods. A choice: with eight, zero frequency and the second harmonic lie where the transform of
/// the window is 4e-5 of its largest value, and the image at −ω where it is 1e-6.
const LEAST_PERIODS: f64 = 8.0;

/// Windows whose noise is measured, in periods. A choice: at half the frequency of the mode its leakage is a part of
/// 1e-6.
const NOISE_PERIODS: f64 = 32.0;

/// Frequencies at which the noise is measured, relative to that of the mode: four bins of the window or more from each
/// other, from the mode and from its harmonics.
const NOISE_FREQUENCIES: [f64; 6] = [0.375, 0.5, 0.625, 1.375, 1.5, 1.625];

/// Smallest number of windows side by side in a decay, if they are not shorter than the shortest. A choice.
const WINDOWS: f64 = 5.0;

/// Length of a window between neighbouring centres, as a part of the length. A choice.
const HOP: f64 = 1.0 / 3.0;

/// Largest change of the frequency over a window, times its length, rad. With it the phase in a window deviates from
/// that of a sine by 0.5 rad at its standard deviation of 0.14 L; the correction takes off what remains. A choice.
const LARGEST_CHIRP: f64 = 25.0;

/// Iterations of the correction of the bias. A choice: it converges with the squared bias.
const ITERATIONS: usize = 4;

/// Natural frequency and damping ratio of one mode over the amplitude of its free decay.
///
/// # Errors
/// See [`DecayCurveError`].
pub fn decay_curve(record: &DecayRecord<'_>) -> Result<DecayCurve, DecayCurveError> {
    let rate_hz = record.rate_hz;
    let frequency_hz = peak_frequency_hz(record.samples, rate_hz, record.quantity, record.band_hz);
    let separating = record.band_hz.map_or(0.0, |[low, high]| 6.0 / (high - low));
    let shortest_s = (LEAST_PERIODS / frequency_hz).max(separating);
    let seconds = record.samples.len() as f64 / rate_hz;
    let needed_s = (1.0 + HOP * LEAST_CURVE_POINTS as f64) * shortest_s;
    if !(frequency_hz > 0.0 && seconds >= needed_s) {
        return Err(DecayCurveError::TooShort {
            seconds,
            frequency_hz,
            needed_s,
        });
    }
    // The position of rest: the mean of the last quarter.
    let tail = &record.samples[3 * record.samples.len() / 4..];
    let rest = tail.iter().sum::<f64>() / tail.len().max(1) as f64;
    let samples: Vec<f64> = record.samples.iter().map(|x| x - rest).collect();
    let (variance, cells) = noise(&samples, rate_hz, frequency_hz);
    let short = DecayWindow::new(shortest_s, rate_hz);
    let rough = Rough::new(&samples, &short, frequency_hz, variance);
    if rough.poles.len() < LEAST_CURVE_POINTS {
        return Err(DecayCurveError::Noise {
            points: rough.poles.len(),
            frequency_hz,
        });
    }
    let longest_s = (seconds - rough.first as f64 / rate_hz) / (1.0 + HOP * LEAST_CURVE_POINTS as f64);
    let window = DecayWindow::new(
        rough
            .window_s(&short)
            .clamp(shortest_s, longest_s.max(shortest_s)),
        rate_hz,
    );
    let poles = rough.refined(&samples, &window, variance);
    if poles.len() < LEAST_CURVE_POINTS {
        return Err(DecayCurveError::Noise {
            points: poles.len(),
            frequency_hz,
        });
    }
    Ok(Curve::new(&window, poles, variance).finished(record.quantity, cells))
}

/// Noise variance of the samples about `frequency_hz`, at least that of the best sensors, and the number of independent values of which it is the median.
///
/// The power of a noise at one frequency is exponentially distributed; its mean is the median over ln 2.
fn noise(samples: &[f64], rate_hz: f64, frequency_hz: f64) -> (f64, usize) {
    let length_s = (NOISE_PERIODS / frequency_hz).min(0.5 * samples.len() as f64 / rate_hz);
    let window = DecayWindow::new(length_s, rate_hz);
    let mut powers: Vec<f64> = NOISE_FREQUENCIES
        .iter()
        .filter(|part| **part * frequency_hz < 0.45 * rate_hz)
        .flat_map(|part| {
            let omega = rad_per_s(part * frequency_hz);
            (window.half..samples.len().saturating_sub(window.half))
                .step_by(window.half.max(1))
                .filter_map(|centre| window.noise_variance(samples, centre, omega))
                .collect::<Vec<_>>()
        })
        .collect();
    let count = powers.len();
    let largest = samples.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    let least = (LEAST_RELATIVE_DEVIATION * largest).powi(2);
    ((median(&mut powers).unwrap_or(0.0) / LN_2).max(least), count)
}

/// Local poles in the shortest windows, from the beginning of the decay on.
struct Rough {
    /// First sample of the decay.
    first: usize,
    poles: Vec<LocalPole>,
}

impl Rough {
    fn new(samples: &[f64], short: &DecayWindow, frequency_hz: f64, variance: f64) -> Self {
        let hop = (short.half / 4).max(1);
        let omega = rad_per_s(frequency_hz);
        let all: Vec<LocalPole> = (short.half..samples.len().saturating_sub(short.half))
            .step_by(hop)
            .filter_map(|centre| short.local(samples, centre, omega))
            .collect();
        let largest = (0..all.len())
            .max_by(|a, b| all[*a].amplitude.total_cmp(&all[*b].amplitude))
            .unwrap_or(0);
        let first = match all.get(largest) {
            // The window with the largest amplitude may contain the release: it lies at most a tenth of the window
            // after the centre, since the weights fall to both sides of it.
            Some(pole) if largest > 0 => pole.centre + short.half / 5,
            _ => largest_sample(&samples[..short.half.min(samples.len())]),
        };
        let least = LEAST_DECAY_TO_NOISE * variance.sqrt() * short.amplitude_noise();
        let mut poles: Vec<LocalPole> = Vec::new();
        for pole in all.into_iter().filter(|pole| pole.centre >= first + short.half) {
            if !pole_is_of_decay(&poles, &pole, least) {
                break;
            }
            poles.push(pole);
        }
        Self { first, poles }
    }

    /// Length of the windows, s: the time in which the amplitude falls by the factor e, or a fifth of the decay above the
    /// noise, which dry friction ends early; shorter if the frequency changes much in that time.
    fn window_s(&self, short: &DecayWindow) -> f64 {
        let (Some(first), Some(last)) = (self.poles.first(), self.poles.last()) else {
            return short.length_s();
        };
        let fallen = self
            .poles
            .iter()
            .find(|pole| pole.amplitude < first.amplitude / std::f64::consts::E)
            .unwrap_or(last);
        let seconds = (fallen.centre - first.centre) as f64 / short.rate_hz;
        let constant_s = seconds / (first.amplitude / fallen.amplitude).ln().abs().max(1e-6);
        let chirp = (fallen.pole.im - first.pole.im).abs() / seconds.max(1.0 / short.rate_hz);
        let whole_s = (last.centre - first.centre) as f64 / short.rate_hz + short.length_s();
        constant_s
            .min(whole_s / WINDOWS)
            .min((LARGEST_CHIRP / chirp).sqrt())
    }

    /// Local poles in the windows `window`, with the local frequency as carrier, from the beginning of the decay until
    /// it falls to the noise or the structure is excited again.
    fn refined(&self, samples: &[f64], window: &DecayWindow, variance: f64) -> Vec<LocalPole> {
        let least = LEAST_DECAY_TO_NOISE * variance.sqrt() * window.amplitude_noise();
        let hop = ((2.0 * HOP * window.half as f64) as usize).max(1);
        let mut poles: Vec<LocalPole> = Vec::new();
        let centres = (self.first + window.half..samples.len().saturating_sub(window.half)).step_by(hop);
        for centre in centres {
            let nearest = self.poles.iter().min_by_key(|pole| pole.centre.abs_diff(centre));
            let omega = match (nearest, poles.last()) {
                (_, Some(last)) if nearest.is_none_or(|pole| pole.centre + window.half < centre) => {
                    last.pole.im
                }
                (Some(pole), _) => pole.pole.im,
                _ => break,
            };
            let Some(pole) = window.local(samples, centre, omega) else {
                break;
            };
            if !pole_is_of_decay(&poles, &pole, least) || ends_within(&poles, &pole, window) {
                break;
            }
            poles.push(pole);
        }
        poles
    }
}

/// True if a window after those of `poles` still holds the decay: it is above the noise, and not excited again.
fn pole_is_of_decay(poles: &[LocalPole], pole: &LocalPole, least: f64) -> bool {
    pole.amplitude > least
        && poles
            .last()
            .is_none_or(|last| pole.amplitude < DECAY_AGAIN * last.amplitude)
}

/// True if the motion ends within a window, as by dry friction: its rate of decay has grown since the first window, and a
/// straight line of this slope through the amplitude at the centre ends before the window does.
fn ends_within(poles: &[LocalPole], pole: &LocalPole, window: &DecayWindow) -> bool {
    let reach = |rate: f64| 0.5 * window.length_s() * rate;
    poles
        .first()
        .is_some_and(|first| reach(-pole.pole.re) > 1.0 && -pole.pole.re > DECAY_ENDS * -first.pole.re)
}

fn largest_sample(samples: &[f64]) -> usize {
    (0..samples.len())
        .max_by(|a, b| samples[*a].abs().total_cmp(&samples[*b].abs()))
        .unwrap_or(0)
}

/// Local poles with their bias taken off, and the covariance of their real parts and of their imaginary parts.
struct Curve<'a> {
    window: &'a DecayWindow,
    found: Vec<LocalPole>,
    amplitudes: Vec<f64>,
    poles: Vec<Complex64>,
    /// Magnitude of the corrections, rad/s.
    corrections: Vec<f64>,
    covariance: DMatrix<f64>,
    variance: f64,
}

impl<'a> Curve<'a> {
    fn new(window: &'a DecayWindow, found: Vec<LocalPole>, variance: f64) -> Self {
        let kernels: Vec<Vec<Complex64>> = found.iter().map(|pole| pole.noise(window)).collect();
        let count = found.len();
        let mut of_noise = DMatrix::zeros(count, count);
        for i in 0..count {
            for j in i..count {
                let value = variance * covariance(window, (&found[i], &kernels[i]), (&found[j], &kernels[j]));
                of_noise[(i, j)] = value;
                of_noise[(j, i)] = value;
            }
        }
        let mut curve = Self {
            window,
            amplitudes: found.iter().map(|pole| pole.amplitude).collect(),
            poles: found.iter().map(|pole| pole.pole).collect(),
            corrections: vec![0.0; count],
            found,
            covariance: of_noise,
            variance,
        };
        for _ in 0..ITERATIONS {
            curve.correct();
        }
        for (index, correction) in curve.corrections.iter().enumerate() {
            curve.covariance[(index, index)] += (CURVE_BIAS_SHARE * correction).powi(2);
        }
        curve
    }

    fn deviations(&self) -> Vec<f64> {
        let largest = self.covariance.diagonal().max();
        let least = 1e-12 * largest.max(f64::MIN_POSITIVE);
        let diagonal = self.covariance.diagonal();
        diagonal
            .iter()
            .map(|variance| variance.max(least).sqrt())
            .collect()
    }

    /// Takes the bias of the windows off the local poles and amplitudes, as that of the smooth law through the present
    /// estimates.
    fn correct(&mut self) {
        let law = SmoothLaw::fitted(&self.amplitudes, &self.poles, &self.deviations());
        for (index, found) in self.found.iter().enumerate() {
            let Some(of_law) = self.window.local_of_law(&law, self.amplitudes[index], found) else {
                continue;
            };
            let bias = of_law.pole - law.pole(self.amplitudes[index]);
            if !(bias.is_finite() && of_law.amplitude > 0.0) {
                continue;
            }
            self.poles[index] = found.pole - bias;
            self.corrections[index] = bias.norm();
            self.amplitudes[index] *= found.amplitude / of_law.amplitude;
        }
    }

    /// χ² of the residual of a constant fitted to `values`, with their covariance.
    fn chi_squared_of_constant(&self, values: &DVector<f64>) -> Option<f64> {
        let cholesky = Cholesky::new(self.covariance.clone())?;
        let ones = DVector::from_element(values.len(), 1.0);
        let of_ones = cholesky.solve(&ones);
        let mean = of_ones.dot(values) / of_ones.dot(&ones);
        let residual = values.map(|value| value - mean);
        Some(cholesky.solve(&residual).dot(&residual))
    }

    fn finished(mut self, quantity: Quantity, cells: usize) -> DecayCurve {
        let count = self.poles.len();
        let parts = [
            DVector::from_iterator(count, self.poles.iter().map(|pole| pole.re)),
            DVector::from_iterator(count, self.poles.iter().map(|pole| pole.im)),
        ];
        let law = SmoothLaw::fitted(&self.amplitudes, &self.poles, &self.deviations());
        let residual: f64 = self
            .poles
            .iter()
            .zip(&self.amplitudes)
            .zip(self.deviations())
            .map(|((pole, amplitude), deviation)| {
                (pole - law.pole(*amplitude)).norm_sqr() / (deviation * deviation)
            })
            .sum();
        let freedoms = 2.0 * (count - law.terms) as f64;
        let of_noise = cells as f64;
        let is_smooth = residual <= freedoms * f_quantile(SMOOTH_PROBABILITY, [freedoms, of_noise]);
        if !is_smooth {
            self.covariance *= residual / freedoms;
        }
        let others = (count - 1) as f64;
        let largest = others * f_quantile(FLAT_PROBABILITY, [others, of_noise]);
        let is_flat = parts.iter().all(|values| {
            self.chi_squared_of_constant(values)
                .is_some_and(|sum| sum <= largest)
        });
        let student = student_ninety_percent(cells) / NINETY_PERCENT;
        let points: Vec<DecayPoint> = (0..count)
            .map(|index| {
                let deviation = student * self.covariance[(index, index)].sqrt();
                self.point(index, self.poles[index], deviation, quantity, student)
            })
            .collect();
        let weights = DVector::from_iterator(
            count,
            self.amplitudes.iter().map(|amplitude| amplitude * amplitude),
        );
        let weights = &weights / weights.sum();
        let mean = Complex64::new(weights.dot(&parts[0]), weights.dot(&parts[1]));
        let deviation = student * (&self.covariance * &weights).dot(&weights).sqrt();
        DecayCurve {
            average: self.point(0, mean, deviation, quantity, student),
            points,
            is_flat,
            is_smooth,
            noise: self.variance.sqrt(),
            window_s: self.window.length_s(),
        }
    }

    /// The point of the window `index` with the pole `pole`, whose real and imaginary part have the standard deviation
    /// `deviation`.
    fn point(
        &self,
        index: usize,
        pole: Complex64,
        deviation: f64,
        quantity: Quantity,
        student: f64,
    ) -> DecayPoint {
        let size = pole.norm();
        let derivatives = match quantity {
            Quantity::Velocity => 1,
            Quantity::Acceleration => 2,
            _ => 0,
        };
        let to_displacement = size.powi(-derivatives);
        DecayPoint {
            time_s: self.found[index].centre as f64 / self.window.rate_hz,
            amplitude_m: self.amplitudes[index] * to_displacement,
            amplitude_std_m: student * self.variance.sqrt() * self.window.amplitude_noise() * to_displacement,
            frequency_hz: size / TAU,
            frequency_std_hz: deviation / TAU,
            damping_ratio: -pole.re / size,
            damping_ratio_std: deviation / size,
        }
    }
}
