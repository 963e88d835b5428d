//! Least squares of all regressors at once, in units of the noise, with free decays taken out.
//!
//! Every record is looked at as a whole, and cut into blocks that are fitted and blocks that are held out. In each of these residual and regressors are
//! transformed, cut to the band, divided by the noise of their channel, and freed of what decays of the initial state and
//! constant offsets of the sensors could explain. Their products (Gram matrices) then give the fit of any set of regressors.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::decay::dot;
use super::grid::Stretch;
use super::record::Record;
use super::scene::{Domain, Scene};
use crate::recording::Kind;

/// A part of a record.
#[derive(Clone, Debug)]
struct Part {
    record: usize,
    range: std::ops::Range<usize>,
    share: Share,
    bins: usize,
    /// By channel: one over the deviation of each transformed number.
    weights: Vec<Vec<f64>>,
    /// Orthonormal: what decays and offsets can be.
    nuisance: Vec<Vec<f64>>,
}

/// Which parts count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// Those that are fitted.
    Fitted,
    /// Those that are held out.
    HeldOut,
    /// Each record as a whole.
    Whole,
}

/// Products of columns.
#[derive(Clone, Debug, Default)]
struct Products {
    /// Lower triangle, row by row.
    gram: Vec<Vec<f64>>,
    with_residual: Vec<f64>,
    residual: f64,
    /// Real numbers that were compared, less those that decays and offsets took.
    count: usize,
}

/// A fit of some columns.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The coefficients.
    pub coefficients: Vec<f64>,
    /// Their covariance for noise of deviation 1.
    pub covariance: DMatrix<f64>,
    /// What is left, in units of the noise.
    pub left: f64,
}

/// All columns of a scene.
pub struct Regression {
    parts: Vec<Part>,
    stretches: Vec<Stretch>,
    /// By column, by part.
    columns: Vec<Vec<Vec<f64>>>,
    residuals: Vec<Vec<f64>>,
    /// Fitted, held out, whole.
    products: [Products; 3],
}

impl Regression {
    /// The residuals of a scene.
    pub fn new(scene: &Scene<'_>) -> Self {
        let mut parts = split(scene);
        let stretches: Vec<Stretch> = parts.iter().map(|part| Stretch::new(part.range.len())).collect();
        for (part, stretch) in parts.iter_mut().zip(&stretches) {
            part.weights = weights(&scene.records[part.record], part);
            part.nuisance = nuisance(&scene.records[part.record], part, stretch);
        }
        let residuals: Vec<Vec<f64>> = parts
            .iter()
            .zip(&stretches)
            .map(|(part, stretch)| {
                let record = &scene.records[part.record];
                let residual: Vec<Vec<f64>> =
                    record.channels.iter().map(|channel| channel.residual()).collect();
                whiten(record, part, stretch, &residual)
            })
            .collect();
        let mut regression = Self {
            parts,
            stretches,
            columns: Vec::new(),
            residuals,
            products: std::array::from_fn(|_| Products::default()),
        };
        for (part, residual) in regression.parts.iter().zip(&regression.residuals) {
            let products = &mut regression.products[part.share as usize];
            products.residual += dot(residual, residual);
            products.count += residual.len() - part.nuisance.len();
        }
        regression
    }

    /// Adds a regressor, given as samples by record and channel; its number.
    pub fn add(&mut self, scene: &Scene<'_>, samples: &[Vec<Vec<f64>>]) -> usize {
        let column: Vec<Vec<f64>> = self
            .parts
            .par_iter()
            .zip(&self.stretches)
            .map(|(part, stretch)| whiten(&scene.records[part.record], part, stretch, &samples[part.record]))
            .collect();
        let number = self.columns.len();
        self.columns.push(column);
        let mut rows: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; number + 1]);
        let mut right = [0.0; 3];
        for (index, part) in self.parts.iter().enumerate() {
            let new = &self.columns[number][index];
            let with_residual = dot(new, &self.residuals[index]);
            let products: Vec<f64> = self
                .columns
                .par_iter()
                .map(|column| dot(&column[index], new))
                .collect();
            right[part.share as usize] += with_residual;
            for (sum, product) in rows[part.share as usize].iter_mut().zip(&products) {
                *sum += product;
            }
        }
        for ((products, row), right) in self.products.iter_mut().zip(rows).zip(right) {
            products.gram.push(row);
            products.with_residual.push(right);
        }
        number
    }

    fn products(&self, share: Share) -> &Products {
        &self.products[share as usize]
    }

    /// Σ residual² in units of the noise.
    pub fn residual(&self, share: Share) -> f64 {
        self.products(share).residual
    }

    /// Numbers that are compared.
    pub fn count(&self, share: Share) -> usize {
        self.products(share).count
    }

    /// Root mean square of the residual over that of what was measured, on what is held out; channels count alike.
    pub fn missed(&self, scene: &Scene<'_>) -> f64 {
        let (mut sum, mut count) = (0.0_f64, 0.0_f64);
        for part in self.parts.iter().filter(|part| part.share == Share::HeldOut) {
            for channel in &scene.records[part.record].channels {
                let energy =
                    |samples: &[f64]| dot(&samples[part.range.clone()], &samples[part.range.clone()]);
                let whole = dot(&channel.measured, &channel.measured) * part.range.len() as f64
                    / channel.measured.len() as f64;
                sum += energy(&channel.residual()) / whole.max(f64::MIN_POSITIVE);
                count += 1.0;
            }
        }
        if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns.len()
    }

    /// The fit of some columns to a share; `None` where they are one and the same, or nothing.
    pub fn fit(&self, share: Share, columns: &[usize]) -> Option<Fit> {
        self.solve(share, columns, 1e-13)
    }

    /// Σ column² in units of the noise.
    pub fn energy(&self, column: usize) -> f64 {
        self.products(Share::Whole).gram[column][column]
    }

    /// Coefficients of `columns` that fit the column `target`.
    pub fn fit_column(&self, share: Share, columns: &[usize], target: usize) -> Option<Vec<f64>> {
        let products = self.products(share);
        let right = |column: usize| products.entry(column, target);
        self.normal(share, columns, 1e-13, right)
            .map(|(solution, _)| solution)
    }

    /// What is left if all columns may explain, numerically dependent ones softened.
    pub fn left_by_all(&self) -> f64 {
        let whole = self.products(Share::Whole);
        let all: Vec<usize> = (0..self.columns.len())
            .filter(|column| whole.gram[*column][*column] > 0.0)
            .collect();
        self.solve(Share::Whole, &all, 1e-9)
            .map_or(whole.residual, |fit| fit.left)
    }

    fn solve(&self, share: Share, columns: &[usize], ridge: f64) -> Option<Fit> {
        let products = self.products(share);
        let right = |column: usize| products.with_residual[column];
        let (coefficients, covariance) = self.normal(share, columns, ridge, right)?;
        Some(Fit {
            left: self.left(share, columns, &coefficients),
            coefficients,
            covariance,
        })
    }

    /// Solution and inverse of the normal equations; `None` where columns are one and the same, or nothing.
    fn normal(
        &self,
        share: Share,
        columns: &[usize],
        ridge: f64,
        right: impl Fn(usize) -> f64,
    ) -> Option<(Vec<f64>, DMatrix<f64>)> {
        let products = self.products(share);
        let size = columns.len();
        let scale: Vec<f64> = columns
            .iter()
            .map(|column| products.gram[*column][*column].sqrt())
            .collect();
        if scale.iter().any(|scale| !(*scale > 0.0 && scale.is_finite())) {
            return None;
        }
        let mut gram = DMatrix::from_fn(size, size, |i, j| {
            products.entry(columns[i], columns[j]) / (scale[i] * scale[j])
        });
        for i in 0..size {
            gram[(i, i)] += ridge;
        }
        let right = DVector::from_fn(size, |i, _| right(columns[i]) / scale[i]);
        let factor = gram.cholesky()?;
        let solution = factor.solve(&right);
        let mut covariance = factor.inverse();
        for i in 0..size {
            for j in 0..size {
                covariance[(i, j)] /= scale[i] * scale[j];
            }
        }
        Some(((0..size).map(|i| solution[i] / scale[i]).collect(), covariance))
    }

    /// What is left of a share with given coefficients.
    pub fn left(&self, share: Share, columns: &[usize], coefficients: &[f64]) -> f64 {
        let products = self.products(share);
        let mut left = products.residual;
        for (column, coefficient) in columns.iter().zip(coefficients) {
            left -= 2.0 * coefficient * products.with_residual[*column];
            for (other, factor) in columns.iter().zip(coefficients) {
                left += coefficient * factor * products.entry(*column, *other);
            }
        }
        left.max(0.0)
    }
}

impl Products {
    fn entry(&self, i: usize, j: usize) -> f64 {
        self.gram[i.max(j)][i.min(j)]
    }
}

/// Each record as a whole, and in four blocks of a third, a sixth, a third and a sixth of which the short ones are held out:
/// they hold other times, and of a sweep other frequencies, than what is fitted. Of several free decays the last is held out
/// whole: the end of a decay tells nothing.
fn split(scene: &Scene<'_>) -> Vec<Part> {
    let several = scene.records.len() > 1;
    let last = scene.records.len().saturating_sub(1);
    scene
        .records
        .iter()
        .enumerate()
        .flat_map(|(index, record)| {
            let count = record.grid.count();
            let mut ranges = vec![(0..count, Share::Whole)];
            if several && record.kind == Some(Kind::FreeDecay) {
                let share = if index == last {
                    Share::HeldOut
                } else {
                    Share::Fitted
                };
                ranges.push((0..count, share));
            } else {
                ranges.extend([
                    (0..count / 3, Share::Fitted),
                    (count / 3..count / 2, Share::HeldOut),
                    (count / 2..5 * count / 6, Share::Fitted),
                    (5 * count / 6..count, Share::HeldOut),
                ]);
            }
            ranges.into_iter().map(move |(range, share)| Part {
                record: index,
                bins: bins_of(record, range.len()),
                range,
                share,
                weights: Vec::new(),
                nuisance: Vec::new(),
            })
        })
        .collect()
}

fn bins_of(record: &Record, length: usize) -> usize {
    let share = record.band_hz / record.grid.rate_hz();
    ((share * length as f64) as usize + 1).min(length / 2 + 1)
}

/// Transformed, cut to the band, in units of the noise, and without what nuisances explain.
fn whiten(record: &Record, part: &Part, stretch: &Stretch, samples: &[Vec<f64>]) -> Vec<f64> {
    let mut column = raw(record, part, stretch, samples);
    for nuisance in &part.nuisance {
        let along = dot(&column, nuisance);
        for (value, nuisance) in column.iter_mut().zip(nuisance) {
            *value -= along * nuisance;
        }
    }
    column
}

fn raw(record: &Record, part: &Part, stretch: &Stretch, samples: &[Vec<f64>]) -> Vec<f64> {
    let mut column = Vec::with_capacity(2 * part.bins * samples.len());
    for (samples, weights) in samples.iter().zip(&part.weights) {
        let from = column.len();
        stretch.parts(&samples[part.range.clone()], part.bins, &mut column);
        for (value, weight) in column[from..].iter_mut().zip(weights) {
            *value *= weight;
        }
    }
    debug_assert_eq!(samples.len(), record.channels.len());
    column
}

/// One over the deviation of each transformed number, by channel: of the sensor, and of what the channel reads of the response
/// to the noise of the force sensors and to what sampling hides of the forces, both taken as the floor of their spectra.
fn weights(record: &Record, part: &Part) -> Vec<Vec<f64>> {
    let length = part.range.len();
    let step = record.grid.omega(1);
    record
        .channels
        .iter()
        .map(|channel| {
            (0..part.bins)
                .flat_map(|bin| {
                    let omega = std::f64::consts::TAU * record.grid.rate_hz() * bin as f64 / length as f64;
                    let near = ((omega / step).round() as usize).min(record.transfer.len() - 1);
                    let mut variance = channel.deviation * channel.deviation;
                    if record.domain == Domain::Response {
                        for (from, force_deviation) in record.force_deviation_n.iter().enumerate() {
                            let response: num_complex::Complex64 = (0..3)
                                .map(|axis| {
                                    record.transfer[near][(axis, from)] * channel.pickup.weights[axis]
                                })
                                .sum();
                            variance += (response * channel.factor(omega)).norm_sqr()
                                * force_deviation
                                * force_deviation;
                        }
                    }
                    let parts = if bin == 0 || 2 * bin == length { 1 } else { 2 };
                    std::iter::repeat_n(1.0 / variance.sqrt(), parts)
                })
                .collect()
        })
        .collect()
}

/// An orthonormal basis of decays and offsets in a part; where forces are compared there is neither.
fn nuisance(record: &Record, part: &Part, stretch: &Stretch) -> Vec<Vec<f64>> {
    if record.domain == Domain::Force {
        return Vec::new();
    }
    let count = record.grid.count();
    let channels = record.channels.len();
    let mut raws = Vec::new();
    for state in 0..record.decays.count() {
        // The decay of a part begins with the part.
        let shifted: Vec<Vec<f64>> = (0..channels)
            .map(|channel| {
                let column = record.decays.column(channel, state);
                let mut samples = vec![0.0; count];
                samples[part.range.clone()].copy_from_slice(&column[..part.range.len()]);
                samples
            })
            .collect();
        raws.push(raw(record, part, stretch, &shifted));
    }
    for constant in 0..channels {
        let samples: Vec<Vec<f64>> = (0..channels)
            .map(|channel| vec![f64::from(u8::from(channel == constant)); count])
            .collect();
        raws.push(raw(record, part, stretch, &samples));
    }
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mut column in raws {
        let size = dot(&column, &column).sqrt();
        // Twice is enough: what is left after the first pass is rounding.
        for _ in 0..2 {
            for known in &basis {
                let along = dot(&column, known);
                column
                    .iter_mut()
                    .zip(known)
                    .for_each(|(value, known)| *value -= along * known);
            }
        }
        let left = dot(&column, &column).sqrt();
        if left > 1e-7 * size && left > 0.0 {
            column.iter_mut().for_each(|value| *value /= left);
            basis.push(column);
        }
    }
    basis
}
