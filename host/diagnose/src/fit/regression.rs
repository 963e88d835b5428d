//! Least squares of all regressors at once, in units of the noise, with free decays taken out.
//!
//! Every record is looked at as a whole, and cut into blocks that are fitted and blocks that are held out. In each of
//! these parts residual and regressors are whitened. Their products (Gram matrices) then give the fit of any set of regressors.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::criteria::RELATIVE_ERROR_OF_CUTS;
use crate::fit::normal_equations::{Products, products};
pub(crate) use crate::fit::segment::Subset;
use crate::fit::segment::{Nuisance, Segment, split};
use crate::records::study::Study;
use crate::signal::dot::dot;

/// What is added to the squares of columns, as a share, where all columns of the library are fitted at once.
const SOFTENED: f64 = 1e-9;

/// The same of the columns of a fit, where only rounding makes columns that are one look like two; of a cut, which is computed less
/// well, columns must be apart by more than the errors of the computation.
const ROUNDING: f64 = 1e-13;

/// A fit of some columns.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// The coefficients.
    pub coefficients: Vec<f64>,
    /// Their covariance for noise of deviation 1.
    pub covariance: DMatrix<f64>,
    /// What is left, in units of the noise.
    pub left: f64,
}

/// How some columns would take more of a residual.
#[derive(Clone, Debug)]
pub(crate) struct Refit {
    /// The change of their coefficients.
    pub change: Vec<f64>,
    /// Σ residual² before, in units of the noise.
    pub before: f64,
    /// What the change takes of it.
    pub taken: f64,
}

/// All columns of a scene.
pub(crate) struct Regression {
    segments: Vec<Segment>,
    /// By column, by part.
    columns: Vec<Vec<Vec<f64>>>,
    residuals: Vec<Vec<f64>>,
    /// Fitted, held out, whole.
    products: [Products; 3],
    /// So many columns have all their products.
    complete: usize,
    /// What is added to the squares of columns, as a share, in every fit.
    ridge: f64,
}

impl Regression {
    /// The residuals of a scene.
    pub(crate) fn new(study: &Study<'_>) -> Self {
        let segments = split(study, |_| Nuisance::StartAndOffsets);
        let residuals: Vec<Vec<f64>> = segments
            .iter()
            .map(|segment| {
                let channels = &study.records[segment.record].channels;
                let residual: Vec<Vec<f64>> = channels.iter().map(|channel| channel.residual()).collect();
                segment.whiten(&residual)
            })
            .collect();
        let mut regression = Self {
            segments,
            columns: Vec::new(),
            residuals,
            products: std::array::from_fn(|_| Products::default()),
            complete: 0,
            ridge: if study.records.iter().any(|record| record.cut.is_some()) {
                RELATIVE_ERROR_OF_CUTS * RELATIVE_ERROR_OF_CUTS
            } else {
                ROUNDING
            },
        };
        regression.sum();
        regression
    }

    /// Products of all that is there, but for those of different columns.
    fn sum(&mut self) {
        self.products = std::array::from_fn(|_| Products::default());
        self.complete = 0;
        for (segment, residual) in self.segments.iter().zip(&self.residuals) {
            let products = &mut self.products[segment.subset as usize];
            products.residual += dot(residual, residual);
            products.count += residual.len() - segment.taken();
        }
        for column in 0..self.columns.len() {
            self.sum_column(column);
        }
    }

    fn sum_column(&mut self, column: usize) {
        let mut sums = [[0.0; 2]; 3];
        let values = self.columns[column].iter().zip(&self.residuals);
        for (segment, (values, residual)) in self.segments.iter().zip(values) {
            let [square, with_residual] = &mut sums[segment.subset as usize];
            *square += dot(values, values);
            *with_residual += dot(values, residual);
        }
        for (products, [square, with_residual]) in self.products.iter_mut().zip(sums) {
            products.add(square, with_residual);
        }
    }

    /// Takes the noise of each record for so many times what it is that all columns together leave as much of one as of another.
    ///
    /// What is left of forces is no noise but what the equations get wrong, and that is larger in one record than in another: least
    /// squares in units of the noise would listen to the record that is described worst (weights by estimated variances, as in
    /// feasible generalized least squares).
    pub(crate) fn level_records(&mut self) {
        let records = self
            .segments
            .iter()
            .map(|segment| segment.record + 1)
            .max()
            .unwrap_or(0);
        let mut left = vec![1.0; records];
        for (index, segment) in self.segments.iter().enumerate() {
            if segment.subset == Subset::Whole {
                let free = self.residuals[index]
                    .len()
                    .saturating_sub(self.columns.len())
                    .max(1);
                left[segment.record] = self.left_of_segment(index) / free as f64;
            }
        }
        let least = left.iter().copied().fold(f64::INFINITY, f64::min).max(1.0);
        for (index, segment) in self.segments.iter_mut().enumerate() {
            segment.weight = (least / left[segment.record].max(least)).sqrt();
            let values = self.columns.iter_mut().flat_map(|column| &mut column[index]);
            for value in values.chain(&mut self.residuals[index]) {
                *value *= segment.weight;
            }
        }
        self.sum();
    }

    /// What all columns leave of one part.
    fn left_of_segment(&self, segment: usize) -> f64 {
        let residual = &self.residuals[segment];
        let mut columns: Vec<&[f64]> = self.columns.iter().map(|column| &column[segment][..]).collect();
        columns.retain(|column| column.iter().any(|value| *value != 0.0));
        let size = columns.len();
        columns.push(residual);
        let mut gram = products(&columns, 0);
        let whole = gram[(size, size)];
        let right = gram.view((0, size), (size, 1)).clone_owned();
        let scale = DVector::from_fn(size, |i, _| gram[(i, i)].sqrt());
        let mut gram = gram.view_mut((0, 0), (size, size)).clone_owned();
        for i in 0..size {
            for j in 0..size {
                gram[(i, j)] /= scale[i] * scale[j];
            }
            gram[(i, i)] += SOFTENED;
        }
        let right = right.column(0).component_div(&scale);
        match gram.cholesky() {
            Some(factor) => (whole - factor.solve(&right).dot(&right)).max(0.0),
            None => whole,
        }
    }

    /// Σ y² of what was measured in the whole records, in units of the noise.
    pub(crate) fn signal(&self, study: &Study<'_>) -> f64 {
        let of_segment = |segment: &Segment| {
            let channels = study.records[segment.record].channels.iter();
            let measured: Vec<Vec<f64>> = channels.map(|channel| channel.measured.clone()).collect();
            let whitened = segment.whiten(&measured);
            dot(&whitened, &whitened)
        };
        let whole = self
            .segments
            .iter()
            .filter(|segment| segment.subset == Subset::Whole);
        whole.map(of_segment).sum()
    }

    /// Adds a regressor, given as samples by record and channel; its number. Its products with others are computed as they are
    /// asked for, until [`Self::complete`].
    pub(crate) fn add(&mut self, samples: &[Vec<Vec<f64>>]) -> usize {
        let column: Vec<Vec<f64>> = self
            .segments
            .par_iter()
            .map(|segment| segment.whiten(&samples[segment.record]))
            .collect();
        self.columns.push(column);
        self.sum_column(self.columns.len() - 1);
        self.columns.len() - 1
    }

    /// Computes all products that are not known yet: before many sets of columns are tried.
    pub(crate) fn complete(&mut self) {
        let (first, size) = (self.complete, self.columns.len());
        if first == size {
            return;
        }
        let of_segments: Vec<DMatrix<f64>> = (0..self.segments.len())
            .into_par_iter()
            .map(|segment| {
                let columns: Vec<&[f64]> = self.columns.iter().map(|column| &column[segment][..]).collect();
                products(&columns, first)
            })
            .collect();
        let mut sums = [(); 3].map(|()| DMatrix::zeros(size - first, size));
        for (segment, rows) in self.segments.iter().zip(of_segments) {
            sums[segment.subset as usize] += rows;
        }
        for (products, rows) in self.products.iter_mut().zip(&sums) {
            products.complete(rows);
        }
        self.complete = size;
    }

    /// Length of a column over a share, per unit of its coefficient.
    pub(crate) fn length(&self, subset: Subset, column: usize) -> f64 {
        self.products(subset).square(column).sqrt()
    }

    /// Product of two columns over a share.
    fn product(&self, subset: Subset, i: usize, j: usize) -> f64 {
        self.products(subset).known(i, j).unwrap_or_else(|| {
            let mine = self
                .segments
                .iter()
                .enumerate()
                .filter(|(_, segment)| segment.subset == subset);
            mine.map(|(index, _)| dot(&self.columns[i][index], &self.columns[j][index]))
                .sum()
        })
    }

    fn products(&self, subset: Subset) -> &Products {
        &self.products[subset as usize]
    }

    /// Σ residual² in units of the noise.
    pub(crate) fn residual(&self, subset: Subset) -> f64 {
        self.products(subset).residual
    }

    /// Numbers that are compared.
    pub(crate) fn count(&self, subset: Subset) -> usize {
        self.products(subset).count
    }

    /// Root mean square of the residual over that of what was measured, on a share; channels count alike.
    pub(crate) fn missed(&self, study: &Study<'_>, subset: Subset) -> f64 {
        let (mut sum, mut count) = (0.0_f64, 0.0_f64);
        for segment in self.segments.iter().filter(|segment| segment.subset == subset) {
            for channel in &study.records[segment.record].channels {
                let energy =
                    |samples: &[f64]| dot(&samples[segment.range.clone()], &samples[segment.range.clone()]);
                let whole = dot(&channel.measured, &channel.measured) * segment.range.len() as f64
                    / channel.measured.len() as f64;
                sum += energy(&channel.residual()) / whole.max(f64::MIN_POSITIVE);
                count += 1.0;
            }
        }
        if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
    }

    /// Number of columns.
    pub(crate) fn columns(&self) -> usize {
        self.columns.len()
    }

    /// The fit of some columns to a share; `None` where they are one and the same, or nothing.
    pub(crate) fn fit(&self, subset: Subset, columns: &[usize]) -> Option<Fit> {
        self.solve(subset, columns, self.ridge)
    }

    /// Coefficients of `columns` that fit the column `target`, and how much of its energy they take.
    pub(crate) fn fit_column(
        &self,
        subset: Subset,
        columns: &[usize],
        target: usize,
    ) -> Option<(Vec<f64>, f64)> {
        let right: Vec<f64> = columns
            .iter()
            .map(|column| self.product(subset, *column, target))
            .collect();
        let (solution, _) = self.normal(subset, columns, self.ridge, &right)?;
        let taken = solution.iter().zip(&right).map(|(x, right)| x * right).sum();
        Some((solution, taken))
    }

    /// The change of the coefficients of `columns` that takes most of `residuals`, given by record and channel; `None` where the
    /// columns are one and the same, or nothing.
    pub(crate) fn refit(
        &self,
        subset: Subset,
        columns: &[usize],
        residuals: &[Vec<Vec<f64>>],
    ) -> Option<Refit> {
        let mine = self.whitened(subset, residuals);
        let with = |column: usize| -> f64 {
            mine.iter()
                .map(|(segment, residual)| dot(&self.columns[column][*segment], residual))
                .sum()
        };
        let right: Vec<f64> = columns.iter().map(|column| with(*column)).collect();
        let (change, _) = self.normal(subset, columns, self.ridge, &right)?;
        Some(Refit {
            before: mine.iter().map(|(_, residual)| dot(residual, residual)).sum(),
            taken: change
                .iter()
                .zip(&right)
                .map(|(change, right)| change * right)
                .sum(),
            change,
        })
    }

    /// What is left of `residuals`, given by record and channel, with given coefficients of `columns`.
    pub(crate) fn left_with(
        &self,
        subset: Subset,
        columns: &[usize],
        residuals: &[Vec<Vec<f64>>],
        coefficients: &[f64],
    ) -> f64 {
        let mut sum = 0.0;
        for (segment, mut residual) in self.whitened(subset, residuals) {
            for (column, coefficient) in columns.iter().zip(coefficients) {
                for (residual, value) in residual.iter_mut().zip(&self.columns[*column][segment]) {
                    *residual -= coefficient * value;
                }
            }
            sum += dot(&residual, &residual);
        }
        sum
    }

    /// The covariance of a fit to a share whose residual is no noise of deviation 1 but an error of the equations, which has a
    /// spectrum of its own: (XᵀX)⁻¹ Xᵀ diag(r²/(1 − h)²) X (XᵀX)⁻¹ with h = diag(X (XᵀX)⁻¹ Xᵀ), one number of the spectrum
    /// independent of the next (HC3 of MacKinnon and White, 1985).
    pub(crate) fn covariance_by_residual(
        &self,
        subset: Subset,
        columns: &[usize],
        fit: &Fit,
    ) -> DMatrix<f64> {
        let mut middle = DMatrix::zeros(columns.len(), columns.len());
        let mine = self
            .segments
            .iter()
            .enumerate()
            .filter(|(_, segment)| segment.subset == subset);
        for (segment, _) in mine {
            let residual = &self.residuals[segment];
            let mut x = DMatrix::from_fn(residual.len(), columns.len(), |row, column| {
                self.columns[columns[column]][segment][row]
            });
            let left =
                DVector::from_column_slice(residual) - &x * DVector::from_column_slice(&fit.coefficients);
            let leverage = (&x * &fit.covariance).component_mul(&x).column_sum();
            for (mut row, (left, leverage)) in x.row_iter_mut().zip(left.iter().zip(leverage.iter())) {
                row *= left / (1.0 - leverage.min(1.0 - f64::EPSILON));
            }
            middle += x.tr_mul(&x);
        }
        &fit.covariance * middle * &fit.covariance
    }

    pub(crate) fn whitened(&self, subset: Subset, residuals: &[Vec<Vec<f64>>]) -> Vec<(usize, Vec<f64>)> {
        self.segments
            .par_iter()
            .enumerate()
            .filter(|(_, segment)| segment.subset == subset)
            .map(|(index, segment)| (index, segment.whiten(&residuals[segment.record])))
            .collect()
    }

    /// What is left if all columns may explain, numerically dependent ones softened.
    pub(crate) fn left_by_all(&self) -> f64 {
        let whole = self.products(Subset::Whole);
        let all: Vec<usize> = (0..self.columns.len())
            .filter(|column| whole.square(*column) > 0.0)
            .collect();
        self.solve(Subset::Whole, &all, SOFTENED)
            .map_or(whole.residual, |fit| fit.left)
    }

    fn solve(&self, subset: Subset, columns: &[usize], ridge: f64) -> Option<Fit> {
        let products = self.products(subset);
        let right: Vec<f64> = columns
            .iter()
            .map(|column| products.with_residual[*column])
            .collect();
        let (coefficients, covariance) = self.normal(subset, columns, ridge, &right)?;
        Some(Fit {
            left: self.left(subset, columns, &coefficients),
            coefficients,
            covariance,
        })
    }

    /// Solution and inverse of the normal equations, `right` in the order of the columns; `None` where columns are one and the same, or nothing.
    fn normal(
        &self,
        subset: Subset,
        columns: &[usize],
        ridge: f64,
        right: &[f64],
    ) -> Option<(Vec<f64>, DMatrix<f64>)> {
        let products = self.products(subset);
        let size = columns.len();
        let scale: Vec<f64> = columns
            .iter()
            .map(|column| products.square(*column).sqrt())
            .collect();
        if scale.iter().any(|scale| !(*scale > 0.0 && scale.is_finite())) {
            return None;
        }
        let mut gram = DMatrix::from_fn(size, size, |i, j| {
            self.product(subset, columns[i], columns[j]) / (scale[i] * scale[j])
        });
        for i in 0..size {
            gram[(i, i)] += ridge;
        }
        let right = DVector::from_fn(size, |i, _| right[i] / scale[i]);
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
    pub(crate) fn left(&self, subset: Subset, columns: &[usize], coefficients: &[f64]) -> f64 {
        let products = self.products(subset);
        let mut left = products.residual;
        for (column, coefficient) in columns.iter().zip(coefficients) {
            left -= 2.0 * coefficient * products.with_residual[*column];
            for (other, factor) in columns.iter().zip(coefficients) {
                left += coefficient * factor * self.product(subset, *column, *other);
            }
        }
        left.max(0.0)
    }
}
