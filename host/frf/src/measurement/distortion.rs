//! Noise and nonlinear distortion of responses to periodic excitation.

use num_complex::Complex64;
use quietcut_numerics::statistics::f_quantile;

use crate::criteria::{FALSE_ALARM, LEAST_DISTORTION};
use crate::estimate::FrfLine;
use crate::period_average::PeriodAverage;
use crate::periodic_test::{DistortionLevel, ResponseDistortion};
use crate::test_channels::TestChannels;

/// Smallest number of lines over which a level is averaged, if there are so many. A choice: the level of a few lines
/// scatters by some decibels.
const LINES_OF_LEVEL: usize = 5;

/// Noise and nonlinear distortion of each response around the peak of its receptance, in the order of the responses.
/// `excited` holds, for each of the `lines`, its index in the spectra of the `averages`.
pub(super) fn distortion(
    averages: &[PeriodAverage],
    excited: &[usize],
    lines: &[FrfLine],
    channels: &TestChannels<'_>,
    realizations: usize,
) -> Vec<ResponseDistortion> {
    let responses = channels.responses.iter().enumerate();
    responses
        .map(|(index, response)| {
            let size =
                |line: &FrfLine| line.h[index][0].norm() / line.frequency_hz.powi(response.derivatives);
            let peak = (0..lines.len())
                .max_by(|&a, &b| size(&lines[a]).total_cmp(&size(&lines[b])))
                .unwrap_or(0);
            let around = around_peak(lines.len(), peak, |line| size(&lines[line]));
            let near: Vec<usize> = around.clone().map(|line| excited[line]).collect();
            let (first, last) = (excited[around.start], excited[around.end - 1]);
            let level = |parity: usize| {
                let silent = silent_lines(averages, excited, parity, [first, last]);
                detected(averages, index, &silent, &near, excited)
            };
            let (noise, total) = of_realizations(averages, index, &near);
            ResponseDistortion {
                response: response.direction,
                peak_hz: lines[peak].frequency_hz,
                noise,
                total: total.filter(|_| realizations > 1),
                even: level(0),
                odd: level(1),
            }
        })
        .collect()
}

/// Contiguous lines around the line `peak` whose size is at least 1/√2 of that of the peak; if these are fewer than
/// [`LINES_OF_LEVEL`], the range is widened on the side of the larger size to that number (at most to all `count`
/// lines).
fn around_peak(count: usize, peak: usize, size: impl Fn(usize) -> f64) -> std::ops::Range<usize> {
    let (mut from, mut to) = (peak, peak + 1);
    let least = size(peak) * std::f64::consts::FRAC_1_SQRT_2;
    loop {
        let below = (from > 0).then(|| size(from - 1));
        let above = (to < count).then(|| size(to));
        let is_narrow = to - from < LINES_OF_LEVEL.min(count);
        match (below, above) {
            (Some(below), above) if above.is_none_or(|above| below >= above) => {
                if below < least && !is_narrow {
                    return from..to;
                }
                from -= 1;
            }
            (_, Some(above)) => {
                if above < least && !is_narrow {
                    return from..to;
                }
                to += 1;
            }
            _ => return from..to,
        }
    }
}

/// Relative noise of the mean FRF at the lines `near`, and the relative distortion of one realization from the scatter
/// over the recordings beyond that noise; no distortion (`None`) for a single recording, or if the mean FRF is zero.
fn of_realizations(
    averages: &[PeriodAverage],
    response: usize,
    near: &[usize],
) -> (f64, Option<DistortionLevel>) {
    let count = averages.len() as f64;
    let (mut power, mut noise, mut total) = (0.0, 0.0, 0.0);
    for &line in near {
        let gains: Vec<Complex64> = averages
            .iter()
            .map(|average| average.gain(response, line))
            .collect();
        let mean = gains.iter().sum::<Complex64>() / count;
        power += mean.norm_sqr();
        // Both variances, `noise` and `total`, are those of the mean over the recordings.
        noise += averages
            .iter()
            .map(|average| average.noise_variance(response, line))
            .sum::<f64>()
            / count
            / count;
        total +=
            gains.iter().map(|gain| (gain - mean).norm_sqr()).sum::<f64>() / (count - 1.0).max(1.0) / count;
    }
    if power <= 0.0 {
        return (0.0, None);
    }
    let periods: usize = averages.iter().map(|average| average.used - 1).sum();
    let lines = near.len() as f64;
    let freedoms = [2.0 * lines * (count - 1.0), 2.0 * lines * periods as f64];
    let level = (averages.len() > 1).then(|| level(count / power, total, noise, freedoms));
    ((noise / power).sqrt(), level)
}

/// Lines of a parity (0 even, 1 odd) that no recording excites, between the first and the last line of `excited`: those
/// nearest to the middle of the lines `near[0]` to `near[1]`, as many as lie within these, but at least
/// [`LINES_OF_LEVEL`] if there are so many.
fn silent_lines(
    averages: &[PeriodAverage],
    excited: &[usize],
    parity: usize,
    near: [usize; 2],
) -> Vec<usize> {
    let (Some(&first), Some(&last), Some(average)) = (excited.first(), excited.last(), averages.first())
    else {
        return Vec::new();
    };
    let is_silent = |line: &usize| {
        (average.first_line + line) % 2 == parity && averages.iter().all(|average| !average.is_excited[*line])
    };
    let mut silent: Vec<usize> = (first..last).filter(is_silent).collect();
    let within = silent
        .iter()
        .filter(|line| (near[0]..=near[1]).contains(line))
        .count();
    let middle = near[0] + near[1];
    silent.sort_by_key(|line| (2 * line).abs_diff(middle));
    silent.truncate(within.max(LINES_OF_LEVEL));
    silent
}

/// Level of the response at the `silent` lines beyond the noise, relative to the response at the lines `near` the peak;
/// `None` without silent lines, or if the response near the peak is zero. The response to the little force that a
/// shaker has at silent lines is subtracted, with the FRF interpolated between excited lines.
fn detected(
    averages: &[PeriodAverage],
    response: usize,
    silent: &[usize],
    near: &[usize],
    excited: &[usize],
) -> Option<DistortionLevel> {
    if silent.is_empty() {
        return None;
    }
    let (mut power, mut noise, mut reference) = (0.0, 0.0, 0.0);
    for average in averages {
        for &line in silent {
            let of_force = between(average, response, excited, line) * average.force[line];
            let answer = &average.responses[response];
            power += (answer.mean[line] - of_force).norm_sqr();
            noise += answer.variance[line] / average.used as f64;
        }
        reference += near
            .iter()
            .map(|&line| average.responses[response].mean[line].norm_sqr())
            .sum::<f64>()
            / near.len() as f64;
    }
    let lines = silent.len() as f64;
    let periods: usize = averages.iter().map(|average| average.used - 1).sum();
    let freedoms = [2.0 * lines * averages.len() as f64, 2.0 * lines * periods as f64];
    (reference > 0.0).then(|| level(1.0 / lines / reference, power, noise, freedoms))
}

/// Level √(scale·(power − noise)) of a distortion, 0 if the noise is larger. The level is significant if it exceeds
/// [`LEAST_DISTORTION`] and an F-test of `power` against `noise`, with the degrees of freedom of both in this order.
fn level(scale: f64, power: f64, noise: f64, freedoms: [f64; 2]) -> DistortionLevel {
    let ratio = (scale * (power - noise).max(0.0)).sqrt();
    let is_above_noise = power > noise * f_quantile(1.0 - FALSE_ALARM, freedoms);
    DistortionLevel {
        ratio,
        is_significant: is_above_noise && ratio > LEAST_DISTORTION,
    }
}

/// FRF Ȳ/Ū of one recording at a line between two excited lines, by linear interpolation; 0 at other lines.
fn between(average: &PeriodAverage, response: usize, excited: &[usize], line: usize) -> Complex64 {
    let above = excited.partition_point(|&other| other < line);
    let (Some(&low), Some(&high)) = (
        above.checked_sub(1).and_then(|at| excited.get(at)),
        excited.get(above),
    ) else {
        return Complex64::ZERO;
    };
    let share = (line - low) as f64 / (high - low).max(1) as f64;
    average.gain(response, low) * (1.0 - share) + average.gain(response, high) * share
}
