//! Least squares of all regressors at once, in units of the noise, with free decays taken out.
//!
//! Every record is cut into a part that is fitted and a part that is held out. In each part residual and regressors are
//! transformed, cut to the band, divided by the noise of their channel, and freed of what decays of the initial state and
//! constant offsets of the sensors could explain. Their products (Gram matrices) then give the fit of any set of regressors.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::decay::dot;
use super::grid::Stretch;
use super::record::Record;
use super::scene::{Domain, Scene};

/// A part of a record.
#[derive(Clone, Debug)]
struct Part {
    record: usize,
    range: std::ops::Range<usize>,
    held_out: bool,
    bins: usize,
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
    /// What is left of the fitted parts, in units of the noise.
    pub left: f64,
    /// What is left of the held-out parts.
    pub left_held_out: f64,
}

/// All columns of a scene.
pub struct Regression {
    parts: Vec<Part>,
    stretches: Vec<Stretch>,
    /// By column, by part.
    columns: Vec<Vec<Vec<f64>>>,
    residuals: Vec<Vec<f64>>,
    fitted: Products,
    held_out: Products,
}

impl Regression {
    /// The residuals of a scene.
    pub fn new(scene: &Scene<'_>) -> Self {
        let mut parts = split(scene);
        let stretches: Vec<Stretch> = parts.iter().map(|part| Stretch::new(part.range.len())).collect();
        for (part, stretch) in parts.iter_mut().zip(&stretches) {
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
            fitted: Products::default(),
            held_out: Products::default(),
        };
        for (part, residual) in regression.parts.iter().zip(&regression.residuals) {
            let products = if part.held_out {
                &mut regression.held_out
            } else {
                &mut regression.fitted
            };
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
        let mut rows = [vec![0.0; number + 1], vec![0.0; number + 1]];
        let mut right = [0.0; 2];
        for (index, part) in self.parts.iter().enumerate() {
            let share = usize::from(part.held_out);
            let new = &self.columns[number][index];
            right[share] += dot(new, &self.residuals[index]);
            let products: Vec<f64> = self
                .columns
                .par_iter()
                .map(|column| dot(&column[index], new))
                .collect();
            for (sum, product) in rows[share].iter_mut().zip(products) {
                *sum += product;
            }
        }
        let [fitted, held_out] = rows;
        self.fitted.gram.push(fitted);
        self.fitted.with_residual.push(right[0]);
        self.held_out.gram.push(held_out);
        self.held_out.with_residual.push(right[1]);
        number
    }

    fn products(&self, share: Share) -> &Products {
        match share {
            Share::Fitted => &self.fitted,
            Share::HeldOut => &self.held_out,
        }
    }

    /// Σ residual² in units of the noise.
    pub fn residual(&self, share: Share) -> f64 {
        self.products(share).residual
    }

    /// Numbers that are compared.
    pub fn count(&self, share: Share) -> usize {
        self.products(share).count
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns.len()
    }

    /// The fit of some columns; `None` where they are one and the same, or nothing.
    pub fn fit(&self, columns: &[usize]) -> Option<Fit> {
        self.solve(columns, 1e-13)
    }

    /// What is left of the fitted parts if all columns may explain, numerically dependent ones softened.
    pub fn left_by_all(&self) -> f64 {
        let all: Vec<usize> = (0..self.columns.len())
            .filter(|column| self.fitted.gram[*column][*column] > 0.0)
            .collect();
        self.solve(&all, 1e-9)
            .map_or(self.fitted.residual, |fit| fit.left)
    }

    fn solve(&self, columns: &[usize], ridge: f64) -> Option<Fit> {
        let size = columns.len();
        let scale: Vec<f64> = columns
            .iter()
            .map(|column| self.fitted.gram[*column][*column].sqrt())
            .collect();
        if scale.iter().any(|scale| !(*scale > 0.0 && scale.is_finite())) {
            return None;
        }
        let mut gram = DMatrix::from_fn(size, size, |i, j| {
            self.fitted.entry(columns[i], columns[j]) / (scale[i] * scale[j])
        });
        for i in 0..size {
            gram[(i, i)] += ridge;
        }
        let right = DVector::from_fn(size, |i, _| self.fitted.with_residual[columns[i]] / scale[i]);
        let factor = gram.cholesky()?;
        let solution = factor.solve(&right);
        let coefficients: Vec<f64> = (0..size).map(|i| solution[i] / scale[i]).collect();
        let mut covariance = factor.inverse();
        for i in 0..size {
            for j in 0..size {
                covariance[(i, j)] /= scale[i] * scale[j];
            }
        }
        Some(Fit {
            left: self.left(Share::Fitted, columns, &coefficients),
            left_held_out: self.left(Share::HeldOut, columns, &coefficients),
            coefficients,
            covariance,
        })
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

    /// Root mean square of a column over all parts, in units of the noise.
    pub fn size(&self, column: usize) -> f64 {
        let sum = self.fitted.gram[column][column] + self.held_out.gram[column][column];
        (sum / (self.fitted.count + self.held_out.count).max(1) as f64).sqrt()
    }
}

impl Products {
    fn entry(&self, i: usize, j: usize) -> f64 {
        self.gram[i.max(j)][i.min(j)]
    }
}

/// Whole records where there are three and more: the one of middling motion is held out; else the last third of each.
fn split(scene: &Scene<'_>) -> Vec<Part> {
    let records = &scene.records;
    let held_out = middling(records);
    records
        .iter()
        .enumerate()
        .flat_map(|(index, record)| {
            let count = record.grid.count();
            match held_out {
                Some(held_out) => vec![(index, 0..count, index == held_out)],
                None => vec![
                    (index, 0..2 * count / 3, false),
                    (index, 2 * count / 3..count, true),
                ],
            }
        })
        .map(|(record, range, held_out)| Part {
            record,
            bins: bins_of(&records[record], range.len()),
            range,
            held_out,
            nuisance: Vec::new(),
        })
        .collect()
}

fn middling(records: &[Record]) -> Option<usize> {
    if records.len() < 3 {
        return None;
    }
    let size = |record: &Record| -> f64 { (0..3).map(|axis| record.motion.size_m(axis).powi(2)).sum() };
    let mut order: Vec<usize> = (0..records.len()).collect();
    order.sort_by(|a, b| size(&records[*a]).total_cmp(&size(&records[*b])));
    Some(order[records.len() / 2])
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
    for (samples, channel) in samples.iter().zip(&record.channels) {
        let from = column.len();
        stretch.parts(&samples[part.range.clone()], part.bins, &mut column);
        for value in &mut column[from..] {
            *value /= channel.deviation;
        }
    }
    column
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
