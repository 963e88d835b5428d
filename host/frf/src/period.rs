//! Period of a periodic force, in whole samples.

use std::f64::consts::TAU;

use num_complex::Complex64;
use realfft::RealFftPlanner;

use super::criteria::{PERIOD_SHIFT, PERIOD_SHIFT_ERRORS, PERIODS_RECORDED_MIN, SHARE_OF_LINES};
use super::cross_spectra::Transform;
use super::window::fast_length;

/// Reason why no period of whole samples is taken from a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NoPeriod {
    /// The record holds fewer than [`PERIODS_RECORDED_MIN`] periods of the `samples` that were stated.
    TooShort {
        /// Stated period, samples.
        samples: usize,
        /// Whole periods in the record.
        periods: usize,
    },
    /// At every lag from the first zero of the autocorrelation to a quarter of the record, less than [`SHARE_OF_LINES`]
    /// of the energy of the force repeats.
    DoesNotRepeat {
        /// Lag of these at which the force repeats best, samples; `None` if there is no such zero.
        best: Option<usize>,
        /// Share of the energy of the force that does not repeat at that lag; 1 without it.
        unrepeated: f64,
    },
    /// The force does not repeat after the period that was stated, but after another one.
    Differs {
        /// Stated period, samples.
        samples: usize,
        /// Share of the energy of the force that does not repeat after the stated period.
        unrepeated: f64,
        /// Lag at which the force repeats, samples.
        found: usize,
    },
    /// The force repeats, but not after a whole number of samples.
    NotWhole {
        /// Estimated period of the force, samples.
        samples: f64,
    },
}

impl NoPeriod {
    /// Message with what was found, with times at the sample rate `rate`, Hz, and what would be right.
    pub(super) fn sentence(self, rate: f64) -> String {
        match self {
            Self::TooShort { samples, periods } => format!(
                "{periods} whole periods of {samples} samples ({:.4} s); at least {PERIODS_RECORDED_MIN} are needed, two for the transient and \
                 two for its absence: record longer, or take a shorter period",
                samples as f64 / rate
            ),
            Self::DoesNotRepeat { best, unrepeated } => {
                let best = best.map_or_else(String::new, |lag| {
                    format!(
                        "; the best is {lag} samples ({:.4} s), where {:.0} % of its energy does not repeat",
                        lag as f64 / rate,
                        100.0 * unrepeated
                    )
                });
                format!(
                    "the force has no period of which the record holds {PERIODS_RECORDED_MIN}{best}: record more periods, or say --excitation random"
                )
            }
            Self::Differs {
                samples,
                unrepeated,
                found,
            } => format!(
                "after the stated period of {samples} samples ({:.4} s) {:.0} % of the energy of the force does not repeat, but it repeats after \
                 {found} samples: say --period-s {}, or omit the option",
                samples as f64 / rate,
                100.0 * unrepeated,
                found as f64 / rate
            ),
            Self::NotWhole { samples } => format!(
                "the force repeats after {samples:.3} samples, which is no whole number: its lines leak into each other; let generator and \
                 recorder share one clock, and choose a period of whole samples, or say --excitation random"
            ),
        }
    }
}

/// Period of `force` in samples: the stated one, or the lag at which the force [repeats](repetition), corrected by
/// whole samples to the period that the lines show.
///
/// The lines must confirm the period, see [`PeriodShift::is_whole`]: from one period to the next a line of the
/// frequency ω turns by −ωδ, if the true period is δ samples longer.
///
/// # Errors
/// See [`NoPeriod`].
pub(super) fn period(force: &[f64], stated: Option<usize>) -> Result<usize, NoPeriod> {
    let samples = match stated {
        Some(samples) => {
            let periods = force.len() / samples.max(1);
            if periods < PERIODS_RECORDED_MIN {
                return Err(NoPeriod::TooShort { samples, periods });
            }
            check_stated(force, samples)?;
            samples.max(1)
        }
        None => repetition(force, force.len() / PERIODS_RECORDED_MIN)?,
    };
    let mut samples = samples;
    let mut shift = period_shift(force, samples);
    // A noisy autocorrelation of a smooth force may have its largest value some samples beside the period.
    for _ in 0..3 {
        let whole = shift.samples.round();
        if whole == 0.0 || stated.is_some() {
            break;
        }
        samples = ((samples as f64 + whole).max(2.0) as usize).min(force.len() / PERIODS_RECORDED_MIN);
        shift = period_shift(force, samples);
    }
    if shift.is_whole() {
        Ok(samples)
    } else {
        Err(NoPeriod::NotWhole {
            samples: samples as f64 + shift.samples,
        })
    }
}

/// Refuses the stated period if the force does not repeat after it, but after another lag.
fn check_stated(force: &[f64], samples: usize) -> Result<(), NoPeriod> {
    let correlation = normalized_autocorrelation(force, force.len() / PERIODS_RECORDED_MIN);
    let unrepeated = |lag: usize| 1.0 - correlation.get(lag).copied().unwrap_or(0.0);
    if unrepeated(samples) <= 1.0 - SHARE_OF_LINES {
        return Ok(());
    }
    match repetition(force, force.len() / PERIODS_RECORDED_MIN) {
        Ok(found) if unrepeated(samples) > AS_WELL * unrepeated(found) + ROUNDING => Err(NoPeriod::Differs {
            samples,
            unrepeated: unrepeated(samples),
            found,
        }),
        _ => Ok(()),
    }
}

/// Period, samples, of a force of which the record holds at least two periods, but fewer than [`PERIODS_RECORDED_MIN`];
/// `None` if there is none.
pub(super) fn long_period(force: &[f64]) -> Option<usize> {
    let shortest = force.len() / PERIODS_RECORDED_MIN;
    repetition(force, force.len() / 2)
        .ok()
        .filter(|lag| *lag > shortest)
}

/// Lag at which `force` repeats, samples: the first local maximum of the normalized autocorrelation of at least 1.5 r −
/// 0.5 − [`ROUNDING`], where r is the largest value. The search begins at the first lag without positive correlation
/// and ends at `longest`. An error if there is no such lag, or if r is below [`SHARE_OF_LINES`].
fn repetition(force: &[f64], longest: usize) -> Result<usize, NoPeriod> {
    let correlation = normalized_autocorrelation(force, longest);
    let nowhere = NoPeriod::DoesNotRepeat {
        best: None,
        unrepeated: 1.0,
    };
    let zero = correlation.iter().position(|r| *r <= 0.0).ok_or(nowhere)?;
    let best = (zero..correlation.len())
        .max_by(|&a, &b| correlation[a].total_cmp(&correlation[b]))
        .ok_or(nowhere)?;
    let unrepeated = 1.0 - correlation[best];
    if unrepeated > 1.0 - SHARE_OF_LINES {
        return Err(NoPeriod::DoesNotRepeat {
            best: Some(best),
            unrepeated,
        });
    }
    let enough = 1.0 - (AS_WELL * unrepeated + ROUNDING);
    let mut lag = (zero..best)
        .find(|&lag| correlation[lag] >= enough)
        .unwrap_or(best);
    while lag < best && correlation[lag + 1] > correlation[lag] {
        lag += 1;
    }
    Ok(lag)
}

/// Largest ratio of the energies that do not repeat at two lags at which a force repeats equally well. A choice: half of the distance of the
/// largest correlation from 1 is left to its scatter.
const AS_WELL: f64 = 1.5;

/// Share of the energy of a force that rounding in a file of five digits keeps from repeating, with some reserve.
const ROUNDING: f64 = 1e-8;

/// Autocorrelation r(lag) = Σ f_k f_{k+lag} / √(Σ f_k² Σ f_{k+lag}²) of a force without its mean, for the lags from 0
/// to `longest`; 0 where the denominator is 0.
fn normalized_autocorrelation(force: &[f64], longest: usize) -> Vec<f64> {
    let mean = force.iter().sum::<f64>() / force.len().max(1) as f64;
    let length = fast_length(force.len() + longest + 1);
    let mut planner = RealFftPlanner::new();
    let (forward, back) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let (mut time, mut lines) = (forward.make_input_vec(), forward.make_output_vec());
    for (padded, sample) in time.iter_mut().zip(force) {
        *padded = sample - mean;
    }
    // Energy of the first k samples, with index k; the two sums in the denominator of r are differences of such
    // energies.
    let mut energy = Vec::with_capacity(force.len() + 1);
    energy.push(0.0);
    let mut sum = 0.0;
    for sample in &time[..force.len()] {
        sum += sample * sample;
        energy.push(sum);
    }
    let is_done = forward.process(&mut time, &mut lines).is_ok();
    for line in &mut lines {
        *line = Complex64::from(line.norm_sqr());
    }
    if !is_done || back.process(&mut lines, &mut time).is_err() {
        return Vec::new();
    }
    let count = force.len();
    (0..=longest.min(count))
        .map(|lag| {
            let both = (energy[count - lag] * (energy[count] - energy[lag])).sqrt();
            if both > 0.0 {
                time[lag] / length as f64 / both
            } else {
                0.0
            }
        })
        .collect()
}

/// Difference between the period of a force and a whole number of samples.
struct PeriodShift {
    /// Period minus the whole number, samples.
    samples: f64,
    /// Standard deviation of `samples`.
    deviation: f64,
    /// Shift of the highest line that [`period_shift`] uses against its line of the transform, in line spacings.
    lines: f64,
}

impl PeriodShift {
    /// True if the magnitude of `lines` is at most [`PERIOD_SHIFT`], or that of `samples` at most
    /// [`PERIOD_SHIFT_ERRORS`] standard deviations.
    fn is_whole(&self) -> bool {
        self.lines.abs() <= PERIOD_SHIFT || self.samples.abs() <= PERIOD_SHIFT_ERRORS * self.deviation
    }
}

/// Estimates by how much the period of `force` differs from `period` samples, from the mean phase advance of the lines
/// of `force` from each period to the next.
fn period_shift(force: &[f64], period: usize) -> PeriodShift {
    let mut transform = Transform::new(period);
    let weights = vec![1.0; period];
    let periods = force.len() / period;
    let first = force.len() - periods * period;
    let mut before: Vec<Complex64> = Vec::new();
    let mut advance = vec![Complex64::ZERO; period / 2 + 1];
    for index in 0..periods {
        let start = first + index * period;
        let lines = transform.of(&force[start..start + period], &weights, true);
        for ((sum, line), before) in advance.iter_mut().zip(lines).zip(&before) {
            *sum += line * before.conj();
        }
        before.clear();
        before.extend_from_slice(lines);
    }
    let largest = advance.iter().map(|sum| sum.norm()).fold(0.0, f64::max);
    let (mut weight, mut moment, mut square) = (0.0, 0.0, 0.0);
    let mut strong: Vec<(f64, f64, f64)> = Vec::new();
    for (line, sum) in advance.iter().enumerate().skip(1) {
        // Lines with less than a tenth of the largest power are left out, since noise has more effect on their phases.
        if sum.norm() < 0.1 * largest || largest == 0.0 {
            continue;
        }
        let omega = TAU * line as f64 / period as f64;
        let (w, angle) = (sum.norm(), sum.arg());
        weight += w;
        moment += w * omega * angle;
        square += w * omega * omega;
        strong.push((omega, angle, w));
    }
    if strong.is_empty() || square <= 0.0 {
        return PeriodShift {
            samples: 0.0,
            deviation: 0.0,
            lines: 0.0,
        };
    }
    // If the period is δ samples longer, the lines turn by −ωδ from one period to the next.
    let samples = -moment / square;
    let scatter: f64 = strong
        .iter()
        .map(|(omega, angle, w)| w * (angle + omega * samples).powi(2))
        .sum();
    let count = strong.len() as f64;
    let highest = strong.last().map_or(0.0, |(omega, _, _)| *omega) / TAU * period as f64;
    PeriodShift {
        samples,
        deviation: (scatter / weight / (count - 1.0).max(1.0) / (square / weight)).sqrt(),
        lines: highest * samples / period as f64,
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Multisine of the lines `lines` with a period of `period` samples (not necessarily whole), with uniform noise.
    fn multisine(
        lines: std::ops::Range<usize>,
        step: usize,
        period: f64,
        count: usize,
        noise: f64,
    ) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let tones: Vec<(f64, f64)> = lines
            .step_by(step)
            .map(|line| (line as f64, random.random_range(0.0..TAU)))
            .collect();
        (0..count)
            .map(|k| {
                let sum: f64 = tones
                    .iter()
                    .map(|(line, phase)| (TAU * line * k as f64 / period + phase).cos())
                    .sum();
                sum + noise * random.random_range(-1.0..1.0)
            })
            .collect()
    }

    #[test]
    fn whole_periods_are_found_with_and_without_noise() {
        for (step, noise) in [(1, 0.0), (2, 0.0), (1, 1.0), (2, 1.0)] {
            // An odd multisine has the correlation −1 at half its period.
            let force = multisine(21..91, step, 1000.0, 8300, noise);
            assert_eq!(period(&force, None), Ok(1000), "{step} {noise}");
        }
        // A period of 500.5 samples is one of 1001 samples for the transform.
        assert_eq!(period(&multisine(10..40, 1, 500.5, 8000, 0.0), None), Ok(1001));
        // Lines 16 to 18 alone: at a lag of one oscillation the force nearly repeats.
        assert_eq!(
            period(&multisine(160..181, 1, 2000.0, 16_000, 0.05), None),
            Ok(2000)
        );
    }

    #[test]
    fn a_period_that_the_record_holds_two_or_three_times_is_found() {
        for periods in [2.0, 2.6, 3.0, 3.9] {
            let count = (1000.0 * periods) as usize;
            let force = multisine(21..91, 1, 1000.0, count, 0.1);
            assert_eq!(long_period(&force), Some(1000), "{periods}");
            assert!(period(&force, None).is_err(), "{periods}");
        }
        assert_eq!(long_period(&multisine(21..91, 1, 1000.0, 4200, 0.1)), None);
        assert_eq!(long_period(&multisine(21..91, 1, 1000.0, 1800, 0.1)), None);
    }

    #[test]
    fn periods_of_no_whole_samples_and_noise_are_refused() {
        let force = multisine(21..91, 1, 1000.3, 8300, 0.1);
        let Err(NoPeriod::NotWhole { samples }) = period(&force, Some(1000)) else {
            panic!("{:?}", period(&force, Some(1000)));
        };
        // The advance of a thousandth of a radian is far below the noise; half a hundredth of a sample is what it
        // allows.
        assert!((samples - 1000.3).abs() < 5e-3, "{samples}");
        // A stated period that is no period of the force, and one that is twice the smallest.
        let force = multisine(21..91, 1, 1000.0, 8300, 0.1);
        for wrong in [900, 998, 1500] {
            let found = period(&force, Some(wrong));
            let Err(NoPeriod::Differs { samples, found, .. }) = found else {
                panic!("{wrong}: {found:?}");
            };
            assert_eq!((samples, found), (wrong, 1000));
        }
        assert_eq!(period(&force, Some(2000)), Ok(2000));
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let noise: Vec<f64> = (0..8192).map(|_| random.random_range(-1.0..1.0)).collect();
        assert!(matches!(
            period(&noise, None),
            Err(NoPeriod::DoesNotRepeat { .. })
        ));
        assert_eq!(long_period(&noise), None);
        assert_eq!(
            period(&noise, Some(3000)),
            Err(NoPeriod::TooShort {
                samples: 3000,
                periods: 2
            })
        );
    }
}
