//! Free decays: the response of the baseline to its initial state.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::least_squares::{Idle, NormalEquations};

use crate::baseline::{Baseline, derivatives};
use crate::signal::dot::dot;
use crate::signal::grid::Grid;
use quietcut_recording::Quantity;
use quietcut_simulate::effect::Pickup;

/// Ridge on the unit diagonal of the normal equations for the initial state: rounding of the free decays, which are
/// products of many matrices.
const ROUNDING: f64 = 1e-12;

/// Free decays of the baseline in each channel of a record, and the fitted initial state.
#[derive(Clone, Debug, Default)]
pub(crate) struct Decays {
    /// Free decays of the baseline in each channel for a unit initial value of one state variable: by channel, state
    /// variable and sample.
    columns: Vec<Vec<Vec<f64>>>,
    /// For each channel: indices of samples that are not compared and that the fit of the free decay leaves out.
    skipped: Vec<Vec<usize>>,
    /// Fitted initial state of the structure at the first sample of the record.
    pub start: Vec<f64>,
}

impl Decays {
    pub(crate) fn of<'p>(
        baseline: &Baseline<'_>,
        grid: &Grid,
        pickups: impl Iterator<Item = &'p Pickup>,
        skipped: &[Vec<usize>],
    ) -> Self {
        let first_order = &baseline.first_order;
        let order = first_order.order();
        let count = grid.count();
        let step = (&first_order.a / grid.rate_hz()).exp();
        let columns = pickups
            .map(|pickup| {
                let mut row = DMatrix::zeros(1, order);
                if pickup.quantity == Quantity::Force {
                    return vec![vec![0.0; count]; order];
                }
                let seen = first_order.at_sensor(&pickup.modes);
                for (axis, weight) in pickup.weights.iter().enumerate() {
                    row += seen.c.row(axis) * *weight;
                }
                for _ in 0..derivatives(pickup.quantity) {
                    row = &row * &first_order.a;
                }
                row = through_sensor(row, pickup, &first_order.a);
                let mut columns = vec![Vec::with_capacity(count); order];
                for _ in 0..count {
                    for (column, value) in columns.iter_mut().zip(row.iter()) {
                        column.push(*value);
                    }
                    row = &row * &step;
                }
                columns
            })
            .collect();
        Self {
            columns,
            skipped: skipped.to_vec(),
            start: vec![0.0; order],
        }
    }

    /// Number of state variables of the baseline structure.
    pub(crate) fn count(&self) -> usize {
        self.start.len()
    }

    /// Free decay of the baseline in a channel from the unit initial value of one state variable.
    pub(crate) fn column(&self, channel: usize, state: usize) -> &[f64] {
        &self.columns[channel][state]
    }

    /// Fits the initial state to `residuals`, samples by channel, by least squares over the compared samples, with the
    /// residual of each channel divided by its entry in `sizes`.
    pub(crate) fn fit(&mut self, residuals: &[Vec<f64>], sizes: &[f64]) {
        let order = self.start.len();
        let mut gram = DMatrix::<f64>::zeros(order, order);
        let mut right = DVector::<f64>::zeros(order);
        for (channel, (residual, size)) in residuals.iter().zip(sizes).enumerate() {
            let columns = self.compared(channel);
            let weight = 1.0 / (size * size).max(f64::MIN_POSITIVE);
            for i in 0..order {
                right[i] += weight * dot(&columns[i], residual);
                for j in 0..=i {
                    gram[(i, j)] += weight * dot(&columns[i], &columns[j]);
                }
            }
        }
        // The initial value of a state variable that no channel observes stays zero.
        self.start = match NormalEquations::new(&gram, ROUNDING, Idle::Hold) {
            Some(equations) => equations.solve(&right).as_slice().to_vec(),
            None => vec![0.0; order],
        };
    }

    /// Free decays of a channel from unit initial states, set to zero at the samples that are not compared.
    fn compared(&self, channel: usize) -> Cow<'_, [Vec<f64>]> {
        let mut columns = Cow::Borrowed(&self.columns[channel][..]);
        if !self.skipped[channel].is_empty() {
            for column in columns.to_mut() {
                for &sample in &self.skipped[channel] {
                    column[sample] = 0.0;
                }
            }
        }
        columns
    }

    /// `samples` of a channel minus the free decay from the fitted initial state, which counts as zero at samples that
    /// are not compared.
    pub(crate) fn without(&self, channel: usize, samples: &[f64]) -> Vec<f64> {
        let mut without = samples.to_vec();
        for (column, start) in self.compared(channel).iter().zip(&self.start) {
            for (sample, value) in without.iter_mut().zip(column) {
                *sample -= start * value;
            }
        }
        without
    }

    /// Adds the free decay from the fitted initial state to the compared samples of a channel.
    pub(crate) fn add_to(&self, channel: usize, samples: &mut [f64]) {
        for (column, start) in self.compared(channel).iter().zip(&self.start) {
            for (sample, value) in samples.iter_mut().zip(column) {
                *sample += start * value;
            }
        }
    }
}

/// Output row `row` of the free motion ẋ = A x behind the dynamics of a sensor: row·(b₀ + b₁·A)·(1 + T·A)⁻¹ for each
/// section. A section with a pole of the structure as its pole, for which the inverse does not exist, is left out.
fn through_sensor(row: DMatrix<f64>, pickup: &Pickup, a: &DMatrix<f64>) -> DMatrix<f64> {
    let one = DMatrix::<f64>::identity(a.nrows(), a.ncols());
    pickup.sections.iter().fold(row, |row, section| {
        let above = &one * section.static_gain + a * section.derivative_s;
        let below = &one + a * section.time_constant_s;
        match below.try_inverse() {
            Some(inverse) => row * above * inverse,
            None => row,
        }
    })
}
