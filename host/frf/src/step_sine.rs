//! Step-sine tests: segments of constant frequency, and phasors of force and response in each.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};
use num_complex::Complex64;
use quietcut_numerics::least_squares::solve_normal_equations;

use super::FrfError;
use super::criteria::{
    FREQUENCY_STEP, PAUSE, PERIOD_SCATTER, PERIODS_MIN, REPEATED_STEP, SAME_LEVEL, SETTLED, SETTLED_NOISE,
    STEADY_SCATTER, SUBSEGMENT_SAMPLES_MIN, SUBSEGMENTS_MIN,
};
use super::test_channels::TestChannels;

/// Decay time of the tracked amplitude of the force of a step-sine test, in periods of the excitation. A choice: more
/// than one period, and less than a frequency step.
const FORGET: f64 = 3.0;

/// Longest decay time of the tracked amplitude of the force of a step-sine test, s; also the decay time before the
/// first period is known. A choice.
const FORGET_S: f64 = 1.0;

/// Smallest number of subsegments in which a frequency step of this many periods or more is demodulated, to estimate
/// noise and settling; a shorter step has one subsegment per period. A choice.
const SUBSEGMENTS: usize = 8;

/// Phasor ratios response/force of one frequency step of a step-sine test.
#[derive(Clone, Debug)]
pub(super) struct FrequencyStep {
    pub(super) frequency_hz: f64,
    /// Number of samples of the frequency step.
    samples: usize,
    /// Mean amplitude of the force over the frequency step, N.
    pub(super) force_n: f64,
    /// H1 estimate of response per force for each response, in the order of the response channels, (m, m/s or m/s²)/N
    /// as measured.
    pub(super) h: Vec<Complex64>,
    /// Coherence of each response over the subsegments of the step that are evaluated: the settled ones, or the second
    /// half.
    pub(super) coherence: Vec<f64>,
    /// Standard deviation of the magnitude of each estimate in `h` (not of one subsegment), in the unit of the
    /// estimate.
    pub(super) deviation: Vec<f64>,
    /// True if the phasor ratios of all responses reached their steady state by the middle of the step.
    pub(super) is_settled: bool,
}

/// Frequency steps of a step-sine record at one level of the force amplitude.
#[derive(Clone, Debug)]
pub(super) struct ForceLevel {
    /// Median of the force amplitudes of the frequency steps in the first pass at this level, N.
    pub(super) force_n: f64,
    /// Steps by ascending frequency. Of steps at one frequency, a later one replaces the kept one if it is longer than
    /// the fraction [`REPEATED_STEP`] of the longest up to it.
    pub(super) steps: Vec<FrequencyStep>,
}

/// Frequency steps of a step-sine record, by force level.
#[derive(Clone, Debug)]
pub(super) struct StepSine {
    /// Force levels in the order of their first passes.
    pub(super) levels: Vec<ForceLevel>,
    /// Approximate frequencies of the steps that cannot be evaluated, as a rule for too few samples per period, Hz, in
    /// the order of time; equal ones once.
    pub(super) unresolved_hz: Vec<f64>,
}

/// Frequency steps of a record by force level: the [`passes`] through the frequency range whose median forces agree
/// within [`SAME_LEVEL`] are one level.
///
/// # Errors
/// The record has several forces, no segment of constant frequency, or none that can be evaluated.
pub(super) fn step_sine(channels: &TestChannels<'_>) -> Result<StepSine, FrfError> {
    let force = channels.only_force("a step-sine test")?;
    let rate = channels.recording.sample_rate_hz;
    let (mut steps, mut unresolved_hz): (Vec<FrequencyStep>, Vec<f64>) = (Vec::new(), Vec::new());
    for tone in tone_segments(&force.samples, rate) {
        match demodulated(channels, &force.samples, tone, rate) {
            Some(step) => steps.push(step),
            None => {
                let hertz = rate / tone.period;
                let is_known = |known: &f64| (known - hertz).abs() < FREQUENCY_STEP * hertz;
                if !unresolved_hz.iter().any(is_known) {
                    unresolved_hz.push(hertz);
                }
            }
        }
    }
    if steps.is_empty() && !unresolved_hz.is_empty() {
        return Err(FrfError::Content {
            path: channels.recording.path.clone(),
            what: format!(
                "no frequency step has {SUBSEGMENT_SAMPLES_MIN} samples per period; a higher sampling rate than {rate} Hz is needed"
            ),
        });
    }
    if steps.is_empty() {
        return Err(FrfError::Content {
            path: channels.recording.path.clone(),
            what: format!(
                "{} has no segment of {PERIODS_MIN} periods of one frequency; is it a step-sine test?",
                force.name
            ),
        });
    }
    let mut levels: Vec<ForceLevel> = Vec::new();
    for pass in passes(steps) {
        let force_n = median_force(&pass);
        let same = levels
            .iter_mut()
            .find(|level| (level.force_n / force_n).ln().abs() < SAME_LEVEL.ln());
        match same {
            Some(level) => level.steps.extend(pass),
            None => levels.push(ForceLevel { force_n, steps: pass }),
        }
    }
    for level in &mut levels {
        level.steps = by_frequency(std::mem::take(&mut level.steps));
    }
    Ok(StepSine {
        levels,
        unresolved_hz,
    })
}

/// Divides the frequency steps, in the order of time, into passes through the frequency range: a step begins a new pass
/// if its frequency is not that of the step before, but that of an earlier step of the pass.
fn passes(steps: Vec<FrequencyStep>) -> Vec<Vec<FrequencyStep>> {
    let mut passes: Vec<Vec<FrequencyStep>> = Vec::new();
    for step in steps {
        let goes_on = |pass: &[FrequencyStep]| match pass {
            [earlier @ .., last] => {
                is_same_frequency(last, &step) || !earlier.iter().any(|other| is_same_frequency(other, &step))
            }
            [] => true,
        };
        match passes.last_mut() {
            Some(pass) if goes_on(pass) => pass.push(step),
            _ => passes.push(vec![step]),
        }
    }
    passes
}

fn is_same_frequency(a: &FrequencyStep, b: &FrequencyStep) -> bool {
    (a.frequency_hz - b.frequency_hz).abs() < FREQUENCY_STEP * a.frequency_hz
}

fn median_force(steps: &[FrequencyStep]) -> f64 {
    let mut forces: Vec<f64> = steps.iter().map(|step| step.force_n).collect();
    forces.sort_by(f64::total_cmp);
    forces[forces.len() / 2]
}

/// The steps of a level, given in the order of time, by ascending frequency and without repeats: see
/// [`ForceLevel::steps`].
fn by_frequency(steps: Vec<FrequencyStep>) -> Vec<FrequencyStep> {
    // Each step that is kept so far, with the length of the longest step at its frequency, samples.
    let mut kept: Vec<(FrequencyStep, usize)> = Vec::with_capacity(steps.len());
    for step in steps {
        match kept
            .iter_mut()
            .find(|(earlier, _)| is_same_frequency(earlier, &step))
        {
            Some((earlier, longest)) => {
                *longest = step.samples.max(*longest);
                if step.samples as f64 > REPEATED_STEP * *longest as f64 {
                    *earlier = step;
                }
            }
            None => {
                let longest = step.samples;
                kept.push((step, longest));
            }
        }
    }
    let mut kept: Vec<FrequencyStep> = kept.into_iter().map(|(step, _)| step).collect();
    kept.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    kept
}

/// Segment of a step-sine record with constant frequency: first and last sample, and period in samples, from the upward
/// crossings of the force through its mean.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ToneSegment {
    first: usize,
    last: usize,
    period: f64,
}

fn tone_segments(force: &[f64], rate: f64) -> Vec<ToneSegment> {
    let crossings = crossings(force, rate);
    let periods: Vec<f64> = crossings.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut tone_segments = Vec::new();
    let mut from = 0;
    while from + PERIODS_MIN <= periods.len() {
        let mut to = from + PERIODS_MIN;
        let spread = scatter(&periods[from..to]);
        let tolerance = |mean: f64| (FREQUENCY_STEP * mean).max(PERIOD_SCATTER * spread);
        let mean = |to: usize| (crossings[to] - crossings[from]) / (to - from) as f64;
        // The first periods of a segment must hold no frequency change, where periods scatter, and no pause, which is
        // one long period.
        let is_pause = |period: &f64| (period - mean(to)).abs() > PAUSE * mean(to);
        if spread > STEADY_SCATTER * FREQUENCY_STEP * mean(to) || periods[from..to].iter().any(is_pause) {
            from += 1;
            continue;
        }
        while to < periods.len() {
            let now = mean(to);
            // One deviating excitation period may be noise; two in a row, or a slow drift, end the frequency step; a
            // single period with a large deviation is a pause of the sine and ends it too.
            let off = |k: usize| periods.get(k).map_or(0.0, |period| (period - now).abs());
            let is_off = |k: usize| off(k) > tolerance(now);
            let drift = || (crossings[to] - crossings[to - PERIODS_MIN]) / PERIODS_MIN as f64 - now;
            let drifts = to >= from + 2 * PERIODS_MIN
                && drift().abs() > (FREQUENCY_STEP * now).max(PERIOD_SCATTER * spread / PERIODS_MIN as f64);
            if off(to) > PAUSE * now || is_off(to) && is_off(to + 1) || drifts {
                break;
            }
            to += 1;
        }
        if to - from >= PERIODS_MIN {
            tone_segments.push(ToneSegment {
                first: crossings[from].ceil() as usize,
                last: crossings[to].floor() as usize,
                period: mean(to),
            });
        }
        from = to + 1;
    }
    tone_segments
}

/// Robust standard deviation of the excitation periods `periods`, in samples: 1.4826 · median absolute deviation.
fn scatter(periods: &[f64]) -> f64 {
    let mut sorted = periods.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted[sorted.len() / 2];
    let mut deviations: Vec<f64> = periods.iter().map(|period| (period - middle).abs()).collect();
    deviations.sort_by(f64::total_cmp);
    1.4826 * deviations[deviations.len() / 2]
}

/// Times, in samples, of the upward crossings of the force through its mean, ascending. A hysteresis of a third of the
/// local amplitude rejects noise.
fn crossings(force: &[f64], rate: f64) -> Vec<f64> {
    let mean = force.iter().sum::<f64>() / force.len().max(1) as f64;
    let mut forget = FORGET_S * rate;
    let mut amplitude = 0.0_f64;
    let mut crossings: Vec<f64> = Vec::new();
    let mut is_low = false;
    let mut last = None;
    for (k, pair) in force.windows(2).enumerate() {
        let (a, b) = (pair[0] - mean, pair[1] - mean);
        amplitude = b.abs().max(amplitude * (1.0 - 1.0 / forget));
        let level = amplitude / 3.0;
        if a < -level {
            is_low = true;
        }
        if is_low && a <= 0.0 && b > 0.0 {
            last = Some(k as f64 + a / (a - b));
        }
        if is_low && b > level {
            crossings.extend(last.take());
            is_low = false;
            if let [.., a, b] = crossings.as_slice() {
                forget = (FORGET * (b - a)).min(FORGET_S * rate);
            }
        }
    }
    crossings
}

/// Phasor ratios response/force over the settled part of a segment of constant frequency, or over its second half if it
/// does not settle; `None` if the segment has too few periods, a subsegment of it has too few samples or begins before
/// the record, or a [`phasor`] cannot be computed.
fn demodulated(
    channels: &TestChannels<'_>,
    force: &[f64],
    tone: ToneSegment,
    rate: f64,
) -> Option<FrequencyStep> {
    let period = refined(force, tone);
    let periods = ((tone.last - tone.first) as f64 / period).floor() as usize;
    // Number of excitation periods in each subsegment; it is whole, so that each subsegment covers full periods but for
    // the rounding to samples.
    let periods_per_subsegment = (periods / SUBSEGMENTS).max(1);
    let subsegments = periods / periods_per_subsegment;
    let length = (periods_per_subsegment as f64 * period).round() as usize;
    if subsegments < SUBSEGMENTS_MIN || length < SUBSEGMENT_SAMPLES_MIN {
        return None;
    }
    let phasors = |signal: &[f64]| -> Option<Vec<Phasor>> {
        (0..subsegments)
            .map(|subsegment| {
                // Subsegments are aligned with the end of the step, since transients are at its start.
                let end = tone.last
                    - ((subsegments - 1 - subsegment) as f64 * periods_per_subsegment as f64 * period).round()
                        as usize;
                phasor(signal, end.checked_sub(length)?, length, period)
            })
            .collect()
    };
    let forces = phasors(force)?;
    let responses: Vec<Vec<Phasor>> = channels
        .responses
        .iter()
        .map(|response| phasors(&response.channel.samples))
        .collect::<Option<_>>()?;
    let ratios: Vec<Vec<Phasor>> = responses
        .iter()
        .map(|response| {
            response
                .iter()
                .zip(&forces)
                .map(|(x, f)| x.divided_by(*f))
                .collect()
        })
        .collect();
    let from = settled_from(&ratios);
    let mut step = FrequencyStep {
        frequency_hz: rate / period,
        samples: tone.last - tone.first,
        force_n: forces
            .iter()
            .map(|subsegment| subsegment.value.norm())
            .sum::<f64>()
            / subsegments as f64,
        h: Vec::new(),
        coherence: Vec::new(),
        deviation: Vec::new(),
        is_settled: from.is_some(),
    };
    let used = from.unwrap_or(subsegments / 2)..subsegments;
    for response in &responses {
        let (h, coherence, deviation) = averaged(&forces[used.clone()], &response[used.clone()]);
        step.h.push(h);
        step.coherence.push(coherence);
        step.deviation.push(deviation);
    }
    Some(step)
}

/// H1 estimate of H over the given subsegments of a frequency step, its coherence, and the standard deviation of the
/// magnitude of this estimate (not of one subsegment).
fn averaged(forces: &[Phasor], responses: &[Phasor]) -> (Complex64, f64, f64) {
    let count = forces.len() as f64;
    let pairs = || responses.iter().zip(forces).map(|(x, f)| (x.value, f.value));
    let ff: f64 = pairs().map(|(_, f)| f.norm_sqr()).sum();
    let xf: Complex64 = pairs().map(|(x, f)| x * f.conj()).sum();
    let h = xf / ff;
    let xx: f64 = pairs().map(|(x, _)| x.norm_sqr()).sum();
    let residual: f64 = pairs().map(|(x, f)| (x - h * f).norm_sqr()).sum();
    let coherence = if xx > 0.0 {
        (1.0 - residual / xx).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let variance = residual / (count - 1.0).max(1.0) / ff;
    (h, coherence, (0.5 * variance).sqrt())
}

/// Index of the first subsegment from which all responses are settled; `None` if one of them is not settled in the
/// second half of the step, or without responses.
///
/// Settled: the phasor ratio differs from its mean over the second half by at most [`SETTLED`] (relative) or by at most
/// [`SETTLED_NOISE`] standard deviations of the ratio.
fn settled_from(ratios: &[Vec<Phasor>]) -> Option<usize> {
    let subsegments = ratios.first()?.len();
    let first = |ratio: &Vec<Phasor>| {
        let half = &ratio[subsegments / 2..];
        let mean = half.iter().map(|subsegment| subsegment.value).sum::<Complex64>() / half.len() as f64;
        let is_off = |subsegment: &Phasor| {
            (subsegment.value - mean).norm()
                > (SETTLED * mean.norm()).max(SETTLED_NOISE * subsegment.variance.sqrt())
        };
        ratio.iter().rposition(is_off).map_or(0, |last| last + 1)
    };
    let from = ratios.iter().map(first).max()?;
    (from <= subsegments / 2).then_some(from)
}

/// Refined period of the force in a segment, in samples, from the phase shift between the two halves of the segment.
fn refined(force: &[f64], tone: ToneSegment) -> f64 {
    let mut period = tone.period;
    for _ in 0..3 {
        let half = (tone.last - tone.first) / 2;
        let length = ((half as f64 / period).floor() * period).round() as usize;
        let (Some(a), Some(b)) = (
            phasor(force, tone.first, length, period),
            phasor(force, tone.first + half, length, period),
        ) else {
            return period;
        };
        // The phases of all phasors refer to sample 0 of the record. The two halves have equal phases if the period is
        // exact.
        let phase_shift = (b.value * a.value.conj()).arg();
        period = 1.0 / (1.0 / period + phase_shift / TAU / half as f64);
    }
    period
}

/// Complex amplitude of a sine, or ratio of two such amplitudes, and its variance due to noise.
#[derive(Clone, Copy, Debug)]
struct Phasor {
    value: Complex64,
    variance: f64,
}

impl Phasor {
    /// Ratio of this phasor to `other`, with the variance propagated from both.
    fn divided_by(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self {
            value,
            variance: (self.variance + value.norm_sqr() * other.variance) / other.value.norm_sqr(),
        }
    }
}

/// Complex amplitude X of x_k = Re(X e^{iωk}) + offset + linear drift over the samples `first .. first + length` of
/// `signal`, by least squares. `None` if the signal has fewer samples or the equations are singular.
fn phasor(signal: &[f64], first: usize, length: usize, period: f64) -> Option<Phasor> {
    let samples = signal.get(first..first.checked_add(length)?)?;
    let row = |k: usize| {
        let (sin, cos) = (TAU * ((first + k) as f64 / period).fract()).sin_cos();
        Vector4::new(cos, -sin, 1.0, 2.0 * k as f64 / length as f64 - 1.0)
    };
    let mut normal = Matrix4::<f64>::zeros();
    let mut right = Vector4::<f64>::zeros();
    for (k, sample) in samples.iter().enumerate() {
        let row = row(k);
        normal += row * row.transpose();
        right += row * *sample;
    }
    let solution = solve_normal_equations(
        &DMatrix::from_column_slice(4, 4, normal.as_slice()),
        &DVector::from_column_slice(right.as_slice()),
    )?;
    let solution = Vector4::from_column_slice(solution.as_slice());
    let residual: f64 = samples
        .iter()
        .enumerate()
        .map(|(k, sample)| (sample - row(k).dot(&solution)).powi(2))
        .sum();
    let count = length as f64;
    Some(Phasor {
        value: Complex64::new(solution[0], solution[1]),
        // Variance of the complex amplitude: the sum of the variances of its real and imaginary part, 2σ²/n each, with
        // the residual variance σ² of n samples.
        variance: 4.0 * residual / (count - 4.0).max(1.0) / count,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_equally_long_steps_at_one_frequency_the_latest_is_kept() {
        let step = |frequency_hz: f64, samples: usize, force_n: f64| FrequencyStep {
            frequency_hz,
            samples,
            force_n,
            h: Vec::new(),
            coherence: Vec::new(),
            deviation: Vec::new(),
            is_settled: true,
        };
        // The force numbers the steps in the order of time. The measured frequency of the second step is above that of
        // the repeat.
        let kept = by_frequency(vec![
            step(40.0, 1000, 1.0),
            step(20.001, 1000, 2.0),
            step(30.0, 1000, 3.0),
            step(20.0, 1000, 4.0),
            // A repeat that is cut short does not replace the earlier step.
            step(30.001, 300, 5.0),
            // Of repeats that each are a little shorter, the latest that is about as long as the longest is kept.
            step(50.0, 1000, 6.0),
            step(50.0, 920, 7.0),
            step(50.0, 850, 8.0),
            step(50.0, 780, 9.0),
        ]);
        let kept: Vec<f64> = kept.iter().map(|step| step.force_n).collect();
        assert_eq!(kept, [4.0, 3.0, 1.0, 7.0]);
    }
}
