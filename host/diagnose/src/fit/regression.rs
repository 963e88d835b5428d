//! Linear least squares of regressors in units of the noise, with free decays and sensor offsets projected out.
//!
//! Every record is one segment as a whole, and besides fitted or held-out segments: see [`split`]. Residual and
//! regressors of each segment are whitened. Their inner products (Gram matrices) then give the fit of any set of
//! regressors.

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::least_squares::{Idle, NormalEquations};
use rayon::prelude::*;

use crate::criteria::RELATIVE_ERROR_OF_CUTS;
use crate::fit::normal_equations::{Products, products};
use crate::fit::nuisances::Nuisances;
pub(crate) use crate::fit::segment::Subset;
use crate::fit::segment::{Nuisance, Segment, split};
use crate::records::channel::Observed;
use crate::records::record::Record;
use crate::records::study::Study;
use crate::signal::dot::dot;

/// Ridge added to the unit diagonal of the scaled normal equations with all regression columns of the library, which
/// are nearly dependent.
const SOFTENED: f64 = 1e-9;

/// Ridge added to the unit diagonal of the scaled normal equations of a fit of few regression columns: the rounding
/// error. In a study with a cut, `RELATIVE_ERROR_OF_CUTS`² replaces it.
const ROUNDING: f64 = 1e-13;

/// Result of a linear fit of some regression columns to the residual of the baseline.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// The coefficients of the regression columns, in the order of the columns.
    pub coefficients: Vec<f64>,
    /// Covariance of the fitted coefficients for unit-variance noise.
    pub covariance: DMatrix<f64>,
    /// χ² of the fit: residual sum of squares in units of the noise. A prediction-error fit overwrites it and the
    /// coefficients.
    pub left: f64,
}

/// Result of a linear fit of some regression columns to the residual of a candidate model.
#[derive(Clone, Debug)]
pub(crate) struct Refit {
    /// Change of the coefficient of each regression column, in the order of the columns.
    pub change: Vec<f64>,
    /// χ² of the candidate model before the change of its coefficients.
    pub before: f64,
    /// Decrease of χ² by the changed coefficients that the linear fit predicts.
    pub taken: f64,
}

/// The residuals and regression columns of a study, whitened and by segment.
pub(crate) struct Regression {
    pub(super) segments: Vec<Segment>,
    /// Whitened regression columns: by column and segment, the values of the whitened segment.
    pub(super) columns: Vec<Vec<Vec<f64>>>,
    pub(super) residuals: Vec<Vec<f64>>,
    /// Inner products of the regression columns over the fitted segments, over the held-out segments and over the whole
    /// records, in this order: that of [`Subset`].
    products: [Products; 3],
    /// Number of regression columns, from the first, whose inner products with each other are computed.
    complete: usize,
    /// Ridge added to the unit diagonal of the scaled normal equations of fits of few regression columns.
    ridge: f64,
    /// Uncertain parameters of the baseline, which are fitted with every set of columns; `None` without any.
    nuisances: Option<Nuisances>,
}

impl Regression {
    /// The whitened residuals of a study, still without regression columns.
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
            nuisances: None,
        };
        regression.nuisances = Nuisances::new(study, &regression.segments);
        regression.sum();
        regression
    }

    /// Recomputes χ² of the baseline and the inner products of each regression column with itself and with the
    /// baseline's residual, and discards those between columns.
    fn sum(&mut self) {
        self.products = std::array::from_fn(|_| Products::default());
        self.complete = 0;
        for (segment, residual) in self.segments.iter().zip(&self.residuals) {
            let products = &mut self.products[segment.subset as usize];
            products.residual += dot(residual, residual);
            products.count += residual.len() - segment.taken();
        }
        if let Some(nuisances) = &mut self.nuisances {
            nuisances.start(&self.segments, &self.residuals);
            for (products, residual) in self.products.iter_mut().zip(nuisances.of_residual()) {
                products.residual += residual;
            }
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
        if let Some(nuisances) = &mut self.nuisances {
            nuisances.add(&self.segments, &self.columns[column]);
            for (sums, taken) in sums.iter_mut().zip(nuisances.of_column(column)) {
                for (sum, taken) in sums.iter_mut().zip(taken) {
                    *sum -= taken;
                }
            }
        }
        for (products, [square, with_residual]) in self.products.iter_mut().zip(sums) {
            products.add(square, with_residual);
        }
    }

    /// Multiplies the noise variance of each record by its χ² per degree of freedom over the smallest one of all
    /// records (feasible GLS). This χ² is that of the record after a fit of all regression columns to the record alone;
    /// a value below 1 per degree of freedom counts as 1.
    ///
    /// In the force domain the residual contains errors of the equations, which differ between records. Without
    /// rescaling, least squares would fit mainly the record that the equations describe worst.
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
                left[segment.record] = self.residual_of_segment(index) / free as f64;
            }
        }
        let least = left.iter().copied().fold(f64::INFINITY, f64::min).max(1.0);
        for (index, segment) in self.segments.iter_mut().enumerate() {
            segment.weight = (least / left[segment.record].max(least)).sqrt();
            let nuisances = self.nuisances.iter_mut().flat_map(Nuisances::columns_mut);
            let columns = self.columns.iter_mut().chain(nuisances);
            let values = columns.flat_map(|column| &mut column[index]);
            for value in values.chain(&mut self.residuals[index]) {
                *value *= segment.weight;
            }
        }
        self.sum();
    }

    /// χ² of one segment of a record after a fit of all regression columns of the library to this segment alone.
    fn residual_of_segment(&self, segment: usize) -> f64 {
        let residual = &self.residuals[segment];
        let mut columns: Vec<&[f64]> = self.columns.iter().map(|column| &column[segment][..]).collect();
        columns.retain(|column| column.iter().any(|value| *value != 0.0));
        let size = columns.len();
        columns.push(residual);
        let products = products(&columns, 0);
        let whole = products[(size, size)];
        let gram = products.view((0, 0), (size, size)).into_owned();
        let right = products.view((0, size), (size, 1)).column(0).into_owned();
        match NormalEquations::new(&gram, SOFTENED, Idle::Refuse) {
            Some(equations) => (whole - equations.explained(&right)).max(0.0),
            None => whole,
        }
    }

    /// Energy of the whitened measured samples of all records, in units of the noise variance; free decays and sensor
    /// offsets are projected out.
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

    /// Adds a regressor, given as samples by record and channel, as a regression column and returns the index of that
    /// column. Its inner products with other columns are computed on demand until [`Self::complete`].
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

    /// Computes all missing inner products of the regression columns at once. It is called before many sets of columns
    /// are fitted.
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
        if let Some(nuisances) = &self.nuisances {
            for (subset, rows) in sums.iter_mut().enumerate() {
                *rows -= DMatrix::from_fn(size - first, size, |row, column| {
                    nuisances.between(subset, first + row, column)
                });
            }
        }
        for (products, rows) in self.products.iter_mut().zip(&sums) {
            products.complete(rows);
        }
        self.complete = size;
    }

    /// Euclidean length of a whitened regression column over a subset of segments: standard deviations of noise per
    /// unit of the coefficient.
    pub(crate) fn length(&self, subset: Subset, column: usize) -> f64 {
        self.products(subset).square(column).sqrt()
    }

    /// Inner product of two whitened regression columns over a subset of segments.
    fn product(&self, subset: Subset, i: usize, j: usize) -> f64 {
        self.products(subset).known(i, j).unwrap_or_else(|| {
            let of_subset = self
                .segments
                .iter()
                .enumerate()
                .filter(|(_, segment)| segment.subset == subset);
            let raw: f64 = of_subset
                .map(|(index, _)| dot(&self.columns[i][index], &self.columns[j][index]))
                .sum();
            let taken = self
                .nuisances
                .as_ref()
                .map_or(0.0, |nuisances| nuisances.between(subset as usize, i, j));
            raw - taken
        })
    }

    /// χ² of the baseline's residual and of its uncertain parameters as they are, and how much less a linear fit of these parameters
    /// would leave.
    pub(crate) fn at_baseline(&self) -> (f64, f64) {
        let left = self.residual(Subset::Whole);
        let promised = self
            .nuisances
            .as_ref()
            .map_or(0.0, |nuisances| nuisances.promised(Subset::Whole as usize));
        (left + promised, promised)
    }

    /// Change of the uncertain parameters of the baseline, from [`Uncertain::at`](crate::baseline::uncertain::Uncertain::at), with
    /// the regression columns `columns` of a fit to the whole records, and their covariance; `None` without such parameters.
    pub(crate) fn after(&self, columns: &[usize], fit: Option<&Fit>) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let nuisances = self.nuisances.as_ref()?;
        let none = DMatrix::zeros(0, 0);
        let (coefficients, covariance) =
            fit.map_or((&[][..], &none), |fit| (&fit.coefficients[..], &fit.covariance));
        Some(nuisances.after(Subset::Whole as usize, columns, coefficients, covariance))
    }

    fn products(&self, subset: Subset) -> &Products {
        &self.products[subset as usize]
    }

    /// χ² of the baseline, without any cause, over a subset of segments.
    pub(crate) fn residual(&self, subset: Subset) -> f64 {
        self.products(subset).residual
    }

    /// Number of values over a subset of segments, minus the skipped samples and one for each projected free decay or
    /// sensor offset.
    pub(crate) fn count(&self, subset: Subset) -> usize {
        self.products(subset).count
    }

    /// Prediction error (NRMSE) of the baseline on a subset, relative to the mean square of each channel over its whole
    /// record; the squares are averaged over all channels of all segments with equal weight.
    pub(crate) fn nrmse(&self, study: &Study<'_>, subset: Subset) -> f64 {
        let channels = |record: &Record| record.channels.iter().map(Observed::residual).collect();
        let residuals: Vec<Vec<Vec<f64>>> = study.records.iter().map(channels).collect();
        self.nrmse_of(study, &residuals, subset)
    }

    /// The same of residuals by record and channel.
    pub(crate) fn nrmse_of(&self, study: &Study<'_>, residuals: &[Vec<Vec<f64>>], subset: Subset) -> f64 {
        let (mut sum, mut count) = (0.0_f64, 0.0_f64);
        for segment in self.segments.iter().filter(|segment| segment.subset == subset) {
            let channels = &study.records[segment.record].channels;
            for (channel, residual) in channels.iter().zip(&residuals[segment.record]) {
                let energy =
                    |samples: &[f64]| dot(&samples[segment.range.clone()], &samples[segment.range.clone()]);
                let whole = dot(&channel.measured, &channel.measured) * segment.range.len() as f64
                    / channel.measured.len() as f64;
                sum += energy(residual) / whole.max(f64::MIN_POSITIVE);
                count += 1.0;
            }
        }
        if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
    }

    /// Number of regression columns.
    pub(crate) fn columns(&self) -> usize {
        self.columns.len()
    }

    /// Linear fit of the regression columns `columns` to the baseline's residual on a subset of segments; `None` if the
    /// columns are dependent or zero.
    pub(crate) fn fit(&self, subset: Subset, columns: &[usize]) -> Option<Fit> {
        self.solve(subset, columns, self.ridge)
    }

    /// Coefficients with which the regression columns `columns` fit the regression column `target`, and the squared
    /// length of `target` that they explain; `None` if the columns are dependent or zero.
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

    /// The change of the coefficients of the regression columns `columns` that fits `residuals`, given by record and
    /// channel; `None` if the columns are dependent or zero.
    pub(crate) fn refit(
        &self,
        subset: Subset,
        columns: &[usize],
        residuals: &[Vec<Vec<f64>>],
    ) -> Option<Refit> {
        let of_subset = self.whitened(subset, residuals);
        let with = |column: usize| -> f64 {
            of_subset
                .iter()
                .map(|(segment, residual)| dot(&self.columns[column][*segment], residual))
                .sum()
        };
        let right: Vec<f64> = columns.iter().map(|column| with(*column)).collect();
        let (change, _) = self.normal(subset, columns, self.ridge, &right)?;
        Some(Refit {
            before: of_subset
                .iter()
                .map(|(_, residual)| dot(residual, residual))
                .sum(),
            taken: change
                .iter()
                .zip(&right)
                .map(|(change, right)| change * right)
                .sum(),
            change,
        })
    }

    /// χ² of `residuals`, given by record and channel, after subtracting the regression columns `columns` times these
    /// `coefficients`.
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

    pub(crate) fn whitened(&self, subset: Subset, residuals: &[Vec<Vec<f64>>]) -> Vec<(usize, Vec<f64>)> {
        self.segments
            .par_iter()
            .enumerate()
            .filter(|(_, segment)| segment.subset == subset)
            .map(|(index, segment)| (index, segment.whiten(&residuals[segment.record])))
            .collect()
    }

    /// χ² after a fit of all columns of the library to the whole records; that of the baseline if the fit fails.
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

    /// Solution and inverse of the normal equations of the regression columns `columns`, with the right side `right` in
    /// the same order; `None` if the columns are dependent or zero.
    fn normal(
        &self,
        subset: Subset,
        columns: &[usize],
        ridge: f64,
        right: &[f64],
    ) -> Option<(Vec<f64>, DMatrix<f64>)> {
        let size = columns.len();
        let gram = DMatrix::from_fn(size, size, |i, j| {
            // The equations use only the lower triangle.
            if i < j {
                0.0
            } else {
                self.product(subset, columns[i], columns[j])
            }
        });
        let equations = NormalEquations::new(&gram, ridge, Idle::Refuse)?;
        let solution = equations.solve(&DVector::from_column_slice(right));
        Some((solution.as_slice().to_vec(), equations.inverse()))
    }

    /// χ² of the baseline's residual on a subset of segments after subtracting the regression columns `columns` times
    /// these `coefficients`.
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
