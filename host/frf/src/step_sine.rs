//! One frequency after the other: the steps of a record, and the phasors of force and response in each.

use std::f64::consts::TAU;

use nalgebra::{Matrix4, Vector4};
use num_complex::Complex64;

use super::FrfError;
use super::driven::Driven;

/// Fewest periods that make a step.
const PERIODS_MIN: usize = 8;

/// Relative change of the period that begins a new step, at least.
const STEP: f64 = 1.5e-3;

/// Periods within which a former amplitude of the force is forgotten: more than one, and less than a step has.
const FORGET: f64 = 3.0;

/// The longest that it is remembered, s, which is also how long before a period is known.
const FORGET_S: f64 = 1.0;

/// Pieces of a step that are demodulated each by itself: they tell noise, and whether it has settled.
const PIECES: usize = 8;

/// A response has settled where the ratio of its phasor to the force's is off by less than this part of its size,
const SETTLED: f64 = 2e-3;

/// or by less than so many standard deviations of noise: one piece in some thousands is off by more.
const NOISE: f64 = 3.0;

/// One frequency.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) frequency_hz: f64,
    /// Samples of this frequency.
    samples: usize,
    /// Amplitude of the force, N.
    pub(super) force_n: f64,
    /// Response by force of each response, as it was measured.
    pub(super) h: Vec<Complex64>,
    /// Part of the response's power, near the frequency, that repeats from piece to piece.
    pub(super) coherence: Vec<f64>,
    /// Standard deviation of |H|.
    pub(super) deviation: Vec<f64>,
    /// Whether the responses had settled.
    pub(super) is_settled: bool,
}

/// The steps of a record at one force.
#[derive(Clone, Debug)]
pub(super) struct Level {
    /// Median of the amplitudes of the force, N.
    pub(super) force_n: f64,
    /// By rising frequency; of a frequency that comes again the longest is taken, and the last of equally long ones.
    pub(super) steps: Vec<Step>,
}

/// Forces within this ratio are one level.
const SAME_LEVEL: f64 = 1.05;

/// The levels of a record in their order: frequencies that come again at another force are another level.
///
/// # Errors
/// Several forces, or no stretch of constant frequency.
pub(super) fn levels(driven: &Driven<'_>) -> Result<Vec<Level>, FrfError> {
    let force = driven.only_force("a step-sine test")?;
    let rate = driven.recording.sample_rate_hz;
    let steps: Vec<Step> = stretches(&force.samples, rate)
        .into_iter()
        .filter_map(|stretch| demodulated(driven, &force.samples, stretch, rate))
        .collect();
    if steps.is_empty() {
        return Err(FrfError::Content {
            path: driven.recording.path.clone(),
            what: format!(
                "{} has no stretch of {PERIODS_MIN} periods of one frequency; is it a step-sine test?",
                force.name
            ),
        });
    }
    let mut levels: Vec<Level> = Vec::new();
    for pass in passes(steps) {
        let force_n = median_force(&pass);
        let same = levels
            .iter_mut()
            .find(|level| (level.force_n / force_n).ln().abs() < SAME_LEVEL.ln());
        match same {
            Some(level) => level.steps.extend(pass),
            None => levels.push(Level { force_n, steps: pass }),
        }
    }
    for level in &mut levels {
        level.steps = by_frequency(std::mem::take(&mut level.steps));
    }
    Ok(levels)
}

/// Steps in their order, cut where a frequency comes again that is not that of the step before.
fn passes(steps: Vec<Step>) -> Vec<Vec<Step>> {
    let mut passes: Vec<Vec<Step>> = Vec::new();
    for step in steps {
        let goes_on = |pass: &[Step]| match pass {
            [earlier @ .., last] => {
                is_same(last, &step) || !earlier.iter().any(|other| is_same(other, &step))
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

fn is_same(a: &Step, b: &Step) -> bool {
    (a.frequency_hz - b.frequency_hz).abs() < STEP * a.frequency_hz
}

fn median_force(steps: &[Step]) -> f64 {
    let mut forces: Vec<f64> = steps.iter().map(|step| step.force_n).collect();
    forces.sort_by(f64::total_cmp);
    forces[forces.len() / 2]
}

fn by_frequency(mut steps: Vec<Step>) -> Vec<Step> {
    steps.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    let mut kept: Vec<Step> = Vec::with_capacity(steps.len());
    for step in steps {
        match kept.last_mut() {
            Some(last) if is_same(last, &step) => {
                if step.samples as f64 > 0.9 * last.samples as f64 {
                    *last = step;
                }
            }
            _ => kept.push(step),
        }
    }
    kept
}

/// Samples of constant frequency and its period, by the upward crossings of the force.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    first: usize,
    last: usize,
    period: f64,
}

fn stretches(force: &[f64], rate: f64) -> Vec<Stretch> {
    let crossings = crossings(force, rate);
    let periods: Vec<f64> = crossings.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut stretches = Vec::new();
    let mut from = 0;
    while from + PERIODS_MIN <= periods.len() {
        let mut to = from + PERIODS_MIN;
        let spread = scatter(&periods[from..to]);
        let tolerance = |mean: f64| (STEP * mean).max(5.0 * spread);
        let mean = |to: usize| (crossings[to] - crossings[from]) / (to - from) as f64;
        // A start within a change of frequency has no common period, and one with a pause has a long one.
        let is_pause = |period: &f64| (period - mean(to)).abs() > 0.5 * mean(to);
        if spread > 10.0 * STEP * mean(to) || periods[from..to].iter().any(is_pause) {
            from += 1;
            continue;
        }
        while to < periods.len() {
            let now = mean(to);
            // One period alone may be off by noise; two in a row are a new step, and a long one is a pause.
            let off = |k: usize| periods.get(k).map_or(0.0, |period| (period - now).abs());
            let is_off = |k: usize| off(k) > tolerance(now);
            let drift = || (crossings[to] - crossings[to - PERIODS_MIN]) / PERIODS_MIN as f64 - now;
            let drifts = to >= from + 2 * PERIODS_MIN
                && drift().abs() > (STEP * now).max(5.0 * spread / PERIODS_MIN as f64);
            if off(to) > 0.5 * now || is_off(to) && is_off(to + 1) || drifts {
                break;
            }
            to += 1;
        }
        if to - from >= PERIODS_MIN {
            stretches.push(Stretch {
                first: crossings[from].ceil() as usize,
                last: crossings[to].floor() as usize,
                period: mean(to),
            });
        }
        from = to + 1;
    }
    stretches
}

/// Standard deviation of a few periods, from the median of their deviations.
fn scatter(periods: &[f64]) -> f64 {
    let mut sorted = periods.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted[sorted.len() / 2];
    let mut deviations: Vec<f64> = periods.iter().map(|period| (period - middle).abs()).collect();
    deviations.sort_by(f64::total_cmp);
    1.4826 * deviations[deviations.len() / 2]
}

/// Times, in samples, at which the force crosses its mean upward, with a hysteresis of a third of its amplitude there,
/// which noise does not pass.
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

/// Phasors over the settled part of a stretch.
fn demodulated(driven: &Driven<'_>, force: &[f64], stretch: Stretch, rate: f64) -> Option<Step> {
    let period = refined(force, stretch);
    let periods = ((stretch.last - stretch.first) as f64 / period).floor() as usize;
    // Whole periods in each piece, as long as can be.
    let per_piece = (periods / PIECES).max(1);
    let pieces = periods / per_piece;
    let length = (per_piece as f64 * period).round() as usize;
    if pieces < 4 || length < 5 {
        return None;
    }
    let phasors = |signal: &[f64]| -> Option<Vec<Phasor>> {
        (0..pieces)
            .map(|piece| {
                // Counted from the end: what has not settled is at the start.
                let end =
                    stretch.last - ((pieces - 1 - piece) as f64 * per_piece as f64 * period).round() as usize;
                phasor(signal, end.checked_sub(length)?, length, period)
            })
            .collect()
    };
    let forces = phasors(force)?;
    let responses: Vec<Vec<Phasor>> = driven
        .responses
        .iter()
        .map(|response| phasors(&response.channel.samples))
        .collect::<Option<_>>()?;
    let ratios: Vec<Vec<Phasor>> = responses
        .iter()
        .map(|response| response.iter().zip(&forces).map(|(x, f)| x.by(*f)).collect())
        .collect();
    let from = settled_from(&ratios);
    let mut step = Step {
        frequency_hz: rate / period,
        samples: stretch.last - stretch.first,
        force_n: forces.iter().map(|piece| piece.value.norm()).sum::<f64>() / pieces as f64,
        h: Vec::new(),
        coherence: Vec::new(),
        deviation: Vec::new(),
        is_settled: from.is_some(),
    };
    let used = from.unwrap_or(pieces / 2)..pieces;
    for response in &responses {
        let (h, coherence, deviation) = averaged(&forces[used.clone()], &response[used.clone()]);
        step.h.push(h);
        step.coherence.push(coherence);
        step.deviation.push(deviation);
    }
    Some(step)
}

/// H1 over pieces, its coherence and the deviation of its absolute value.
fn averaged(forces: &[Phasor], responses: &[Phasor]) -> (Complex64, f64, f64) {
    let count = forces.len() as f64;
    let pairs = || responses.iter().zip(forces).map(|(x, f)| (x.value, f.value));
    let ff: f64 = pairs().map(|(_, f)| f.norm_sqr()).sum();
    let xf: Complex64 = pairs().map(|(x, f)| x * f.conj()).sum();
    let h = xf / ff;
    let xx: f64 = pairs().map(|(x, _)| x.norm_sqr()).sum();
    let rest: f64 = pairs().map(|(x, f)| (x - h * f).norm_sqr()).sum();
    let coherence = if xx > 0.0 {
        (1.0 - rest / xx).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let variance = rest / (count - 1.0).max(1.0) / ff;
    (h, coherence, (0.5 * variance).sqrt())
}

/// The first piece from which on all responses have settled; `None` where not even the last half has.
///
/// From there on each piece is the mean of the last half, but for [`SETTLED`] or what its noise explains.
fn settled_from(ratios: &[Vec<Phasor>]) -> Option<usize> {
    let pieces = ratios.first()?.len();
    let first = |ratio: &Vec<Phasor>| {
        let half = &ratio[pieces / 2..];
        let mean = half.iter().map(|piece| piece.value).sum::<Complex64>() / half.len() as f64;
        let is_off = |piece: &Phasor| {
            (piece.value - mean).norm() > (SETTLED * mean.norm()).max(NOISE * piece.variance.sqrt())
        };
        ratio.iter().rposition(is_off).map_or(0, |last| last + 1)
    };
    let from = ratios.iter().map(first).max()?;
    (from <= pieces / 2).then_some(from)
}

/// The period of a stretch, from how its phase turns between its halves.
fn refined(force: &[f64], stretch: Stretch) -> f64 {
    let mut period = stretch.period;
    for _ in 0..3 {
        let half = (stretch.last - stretch.first) / 2;
        let length = ((half as f64 / period).floor() * period).round() as usize;
        let (Some(a), Some(b)) = (
            phasor(force, stretch.first, length, period),
            phasor(force, stretch.first + half, length, period),
        ) else {
            return period;
        };
        // Phasors refer to sample 0 of the record: between equal ones lies a whole number of periods.
        let turned = (b.value * a.value.conj()).arg();
        period = 1.0 / (1.0 / period + turned / TAU / half as f64);
    }
    period
}

/// A complex amplitude, and the variance that noise beside the sine gives it.
#[derive(Clone, Copy, Debug)]
struct Phasor {
    value: Complex64,
    variance: f64,
}

impl Phasor {
    /// The ratio of two.
    fn by(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self {
            value,
            variance: (self.variance + value.norm_sqr() * other.variance) / other.value.norm_sqr(),
        }
    }
}

/// The complex amplitude X of x = Re X e^{iωk} + offset + drift over samples `first .. first + length`, by least
/// squares.
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
    let solution = normal.cholesky()?.solve(&right);
    let rest: f64 = samples
        .iter()
        .enumerate()
        .map(|(k, sample)| (sample - row(k).dot(&solution)).powi(2))
        .sum();
    let count = length as f64;
    Some(Phasor {
        value: Complex64::new(solution[0], solution[1]),
        // 2σ²/n for each part.
        variance: 4.0 * rest / (count - 4.0).max(1.0) / count,
    })
}
