//! Average of a record of periodic excitation over its periods, without the periods of the transient.

use std::ops::Range;

use num_complex::Complex64;
use quietcut_numerics::statistics::{f_quantile, median};

use super::criteria::{EXCITED, FALSE_ALARM, FORCE_CHANGE, LINE_ABOVE_NOISE, SETTLED};
use super::cross_spectra::Transform;

/// Mean spectra of a record over the used periods of its excitation, with the scatter over these periods.
#[derive(Clone, Debug)]
pub(super) struct PeriodAverage {
    /// Number of the first line of the spectra: its frequency in multiples of the reciprocal of the period.
    pub(super) first_line: usize,
    /// Number of periods in the mean.
    pub(super) used: usize,
    /// Number of whole periods of the record that are not in the mean.
    pub(super) dropped: usize,
    /// True if [`settled_from`] finds a settled period; otherwise the second half of the periods is used.
    pub(super) is_settled: bool,
    /// True for each line that the force [excites](excited).
    pub(super) is_excited: Vec<bool>,
    /// Mean spectrum of the force.
    pub(super) force: Vec<Complex64>,
    /// Mean spectra of the responses, in the order given.
    pub(super) responses: Vec<ResponseAverage>,
}

/// Mean spectrum of one response over the periods.
#[derive(Clone, Debug)]
pub(super) struct ResponseAverage {
    /// Mean spectrum Ȳ.
    pub(super) mean: Vec<Complex64>,
    /// At each line, variance of one period about the mean, Σ|Y − Ȳ − G(U − Ū)|²/(M − 1), with G = Ȳ/Ū at excited lines
    /// and 0 elsewhere; 0 for M = 1.
    pub(super) variance: Vec<f64>,
    /// Power Σ|Y|²/M of the response.
    pub(super) power: Vec<f64>,
}

impl PeriodAverage {
    /// FRF Ȳ/Ū of one response at an excited line.
    pub(super) fn gain(&self, response: usize, line: usize) -> Complex64 {
        self.responses[response].mean[line] / self.force[line]
    }

    /// Variance by noise of the FRF of one response at an excited line: the variance of one period divided by M|Ū|².
    pub(super) fn noise_variance(&self, response: usize, line: usize) -> f64 {
        self.responses[response].variance[line] / self.used as f64 / self.force[line].norm_sqr()
    }
}

/// Spectra of a record: of the force by period and line, of the responses by response, period and line.
struct PeriodLines {
    force: Vec<Vec<Complex64>>,
    responses: Vec<Vec<Vec<Complex64>>>,
}

/// Averages a record over periods of `period` samples, at the `lines` of the transform of one period as far
/// as half the sample rate. Left out are periods in which the force changes, periods that hold a sample for which
/// `is_clipped` is true, and of the remaining ones those before the responses settle. `None` if fewer than two remain before the last step.
///
/// The last period ends with the record, since the transient is at the start of the record.
pub(super) fn period_average(
    force: &[f64],
    responses: &[&[f64]],
    period: usize,
    lines: Range<usize>,
    is_clipped: &[bool],
) -> Option<PeriodAverage> {
    let whole = force.len() / period;
    let first = force.len() - whole * period;
    let start = |index: usize| first + index * period;
    let steady = steady_force(force, period, whole, first);
    let is_clean = |index: &usize| {
        let samples = is_clipped.get(start(*index)..start(*index) + period);
        !samples.is_some_and(|samples| samples.contains(&true))
    };
    let starts: Vec<usize> = steady.filter(is_clean).map(start).collect();
    if starts.len() < 2 {
        return None;
    }
    let end = lines.end.min(period / 2 + 1);
    let lines = lines.start.min(end)..end;
    let mut transform = Transform::new(period);
    let weights = vec![1.0; period];
    let mut spectra = |signal: &[f64]| -> Vec<Vec<Complex64>> {
        let spectrum = |start: &usize| {
            let all = transform.of(&signal[*start..*start + period], &weights, true);
            all[lines.clone()].to_vec()
        };
        starts.iter().map(spectrum).collect()
    };
    let spectra = PeriodLines {
        force: spectra(force),
        responses: responses.iter().map(|signal| spectra(signal)).collect(),
    };
    let is_excited = excited(&spectra.force);
    let settled = settled_from(&spectra, &is_excited);
    let periods = settled.unwrap_or(starts.len() / 2)..starts.len();
    let force = mean(&spectra.force[periods.clone()]);
    Some(PeriodAverage {
        first_line: lines.start,
        used: periods.len(),
        dropped: whole - periods.len(),
        is_settled: settled.is_some(),
        responses: spectra
            .responses
            .iter()
            .map(|response| {
                let (forces, response) = (&spectra.force[periods.clone()], &response[periods.clone()]);
                let (mean, energy) = residual(forces, response, &is_excited);
                let count = response.len() as f64;
                ResponseAverage {
                    power: (0..mean.len())
                        .map(|line| response.iter().map(|y| y[line].norm_sqr()).sum::<f64>() / count)
                        .collect(),
                    mean,
                    variance: energy
                        .iter()
                        .map(|energy| energy / (count - 1.0).max(1.0))
                        .collect(),
                }
            })
            .collect(),
        force,
        is_excited,
    })
}

/// Indices of the longest run of consecutive periods, of equal ones the first, between which the force changes by at
/// most [`FORCE_CHANGE`] times the median change, or by no more than rounding.
fn steady_force(force: &[f64], period: usize, whole: usize, first: usize) -> Range<usize> {
    let change = |index: usize| -> f64 {
        let start = first + index * period;
        (start..start + period)
            .map(|k| (force[k + period] - force[k]).powi(2))
            .sum()
    };
    let changes: Vec<f64> = (0..whole.saturating_sub(1)).map(change).collect();
    let energy = force.iter().map(|sample| sample * sample).sum::<f64>() / whole.max(1) as f64;
    let usual = median(&mut changes.clone()).unwrap_or(0.0);
    // The lower bound allows for the rounding in a file of five digits, if the force has no other noise.
    let most = (FORCE_CHANGE * usual).max(1e-8 * energy);
    let (mut longest, mut from) = (0..0, 0);
    for index in 0..whole {
        if changes.get(index).is_none_or(|change| *change > most) {
            if index + 1 - from > longest.len() {
                longest = from..index + 1;
            }
            from = index + 1;
        }
    }
    longest
}

fn mean(periods: &[Vec<Complex64>]) -> Vec<Complex64> {
    let lines = periods.first().map_or(0, Vec::len);
    (0..lines)
        .map(|line| periods.iter().map(|period| period[line]).sum::<Complex64>() / periods.len() as f64)
        .collect()
}

/// True for each line at which the power of the mean force is above [`EXCITED`] of the largest such power, and above
/// [`LINE_ABOVE_NOISE`] times the variance of the mean force.
fn excited(force: &[Vec<Complex64>]) -> Vec<bool> {
    let mean = mean(force);
    let count = force.len() as f64;
    let variance = |line: usize| -> f64 {
        let energy: f64 = force.iter().map(|u| (u[line] - mean[line]).norm_sqr()).sum();
        energy / (count - 1.0).max(1.0) / count
    };
    let largest = mean.iter().map(|u| u.norm_sqr()).fold(0.0, f64::max);
    mean.iter()
        .enumerate()
        .map(|(line, u)| {
            let power = u.norm_sqr();
            power > EXCITED * largest && power > LINE_ABOVE_NOISE * variance(line)
        })
        .collect()
}

/// Mean of a response over the periods, and the energy Σ|Y − Ȳ − G(U − Ū)|² of its residual at each line.
fn residual(
    forces: &[Vec<Complex64>],
    response: &[Vec<Complex64>],
    is_excited: &[bool],
) -> (Vec<Complex64>, Vec<f64>) {
    let (force, mean) = (mean(forces), mean(response));
    let energy = (0..mean.len())
        .map(|line| {
            let gain = gain(mean[line], force[line], is_excited[line]);
            let residual = |(y, u): (&Vec<Complex64>, &Vec<Complex64>)| {
                (y[line] - mean[line] - gain * (u[line] - force[line])).norm_sqr()
            };
            response.iter().zip(forces).map(residual).sum()
        })
        .collect();
    (mean, energy)
}

fn gain(response: Complex64, force: Complex64, is_excited: bool) -> Complex64 {
    if is_excited {
        response / force
    } else {
        Complex64::ZERO
    }
}

/// Number of neighbouring lines whose residual energies are added up in the search for the transient. A choice: the
/// response to initial conditions is as wide as the resonances.
const LINES_OF_TRANSIENT: usize = 16;

/// Index of the first period from which all responses are settled; `None` if no such period is found with two periods
/// for reference.
///
/// The reference is the second half of the periods. A period of the first half has a transient if, in a band of
/// [`LINES_OF_TRANSIENT`] lines of a response, its difference from the mean over the reference exceeds both [`SETTLED`]
/// of that mean and the noise, by an F-test with the probability [`FALSE_ALARM`] over all bands and responses; the
/// linear response to a difference of the force does not count. The responses are settled after the last period with a
/// transient. If this is the last period of the first half, the second half is divided again.
fn settled_from(spectra: &PeriodLines, is_excited: &[bool]) -> Option<usize> {
    let periods = spectra.force.len();
    let mut from = 0;
    loop {
        let half = from + (periods - from) / 2;
        if periods - half < 2 {
            return None;
        }
        let last = (from..half)
            .rev()
            .find(|&period| has_transient(spectra, is_excited, period, half..periods));
        match last {
            None => return Some(from),
            Some(last) if last + 1 < half => return Some(last + 1),
            Some(_) => from = half,
        }
    }
}

/// True if `period` has a transient against the periods `reference`, see [`settled_from`].
fn has_transient(spectra: &PeriodLines, is_excited: &[bool], period: usize, reference: Range<usize>) -> bool {
    let count = reference.len() as f64;
    let lines = is_excited.len();
    let bands = lines.div_ceil(LINES_OF_TRANSIENT);
    let tests = (bands * spectra.responses.len()).max(1) as f64;
    let forces = &spectra.force[reference.clone()];
    let force = mean(forces);
    spectra.responses.iter().any(|response| {
        let (mean, noise) = residual(forces, &response[reference.clone()], is_excited);
        (0..bands).any(|band| {
            let band = band * LINES_OF_TRANSIENT..((band + 1) * LINES_OF_TRANSIENT).min(lines);
            let freedoms = 2.0 * band.len() as f64;
            let off: f64 = band
                .clone()
                .map(|line| {
                    let gain = gain(mean[line], force[line], is_excited[line]);
                    let of_force = gain * (spectra.force[period][line] - force[line]);
                    (response[period][line] - mean[line] - of_force).norm_sqr()
                })
                .sum();
            let size: f64 = band.clone().map(|line| mean[line].norm_sqr()).sum();
            if off <= SETTLED * SETTLED * size {
                return false;
            }
            let noise: f64 = band.map(|line| noise[line]).sum::<f64>() / (count - 1.0);
            let most = f_quantile(1.0 - FALSE_ALARM / tests, [freedoms, freedoms * (count - 1.0)]);
            off > most * noise * (1.0 + 1.0 / count)
        })
    })
}
