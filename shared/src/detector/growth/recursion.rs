//! Sums of products of the last tooth passings with exponential forgetting.

use super::rows::{ENDS, GROUPS, Row};
use crate::synchronous::CHANNELS;

/// Order of the autoregression: two pairs of multipliers.
pub(super) const ORDER: usize = 4;
/// A row and the rows before it that the autoregression needs.
pub(super) const LAGS: usize = ORDER + 1;
/// Products of two of them, i ≤ j.
pub(super) const PRODUCTS: usize = LAGS * (LAGS + 1) / 2;

/// Place of the product of lags i ≤ j.
pub(super) const fn place(i: usize, j: usize) -> usize {
    j * (j + 1) / 2 + i
}

/// Products of each harmonic.
pub(super) type Products = [[f32; PRODUCTS]; GROUPS];

/// The last rows, newest first, and the products of each with those before.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    pub(super) rows: [Row; LAGS],
    /// For each of the last rows k, for each harmonic: x_k·x_{k−l}.
    lagged: [[[f32; LAGS]; GROUPS]; LAGS],
    filled: u8,
}

impl Rows {
    pub(super) const fn new() -> Self {
        Self {
            rows: [[0.0; CHANNELS]; LAGS],
            lagged: [[[0.0; LAGS]; GROUPS]; LAGS],
            filled: 0,
        }
    }

    pub(super) fn reset(&mut self) {
        self.filled = 0;
    }

    /// Takes the next row. True once as many are known as the autoregression needs.
    pub(super) fn push(&mut self, row: &Row) -> bool {
        self.rows.rotate_right(1);
        self.rows[0] = *row;
        self.lagged.rotate_right(1);
        for (lag, before) in self.rows.iter().enumerate() {
            for ((from, to), products) in ENDS.iter().zip(&mut self.lagged[0]) {
                let (new, old) = (&row[*from..*to], &before[*from..*to]);
                products[lag] = new.iter().zip(old).map(|(a, b)| a * b).sum();
            }
        }
        self.filled = (self.filled + 1).min(LAGS as u8);
        usize::from(self.filled) == LAGS
    }
}

/// Σ_k λ^{n−k}·x_{k−i}·x_{k−j} and Σ_k λ^{n−k}·x_{k−i}.
#[derive(Clone, Debug)]
pub(super) struct Recursion {
    keep: f32,
    /// Σ λ^{n−k}.
    pub(super) weight: f32,
    products: Products,
    sums: [Row; LAGS],
}

impl Recursion {
    /// Forgets by 1/e within `memory` passings.
    pub(super) const fn new(memory: f32) -> Self {
        Self {
            keep: 1.0 - 1.0 / memory,
            weight: 0.0,
            products: [[0.0; PRODUCTS]; GROUPS],
            sums: [[0.0; CHANNELS]; LAGS],
        }
    }

    pub(super) fn reset(&mut self) {
        self.weight = 0.0;
        self.products = [[0.0; PRODUCTS]; GROUPS];
        self.sums = [[0.0; CHANNELS]; LAGS];
    }

    /// Takes the newest rows.
    pub(super) fn push(&mut self, rows: &Rows) {
        let keep = self.keep;
        self.weight = keep * self.weight + 1.0;
        for (group, products) in self.products.iter_mut().enumerate() {
            for j in 0..LAGS {
                for i in 0..=j {
                    let slot = &mut products[place(i, j)];
                    *slot = keep * *slot + rows.lagged[i][group][j - i];
                }
            }
        }
        for (sums, row) in self.sums.iter_mut().zip(&rows.rows) {
            for (sum, value) in sums.iter_mut().zip(row) {
                *sum = keep * *sum + value;
            }
        }
    }

    /// The products about the mean of the window: a constant of each channel is fitted with the autoregression.
    pub(super) fn centred(&self) -> Products {
        let mut centred = self.products;
        let share = 1.0 / self.weight.max(1.0);
        for (products, (from, to)) in centred.iter_mut().zip(ENDS) {
            for j in 0..LAGS {
                for i in 0..=j {
                    let (a, b) = (&self.sums[i][from..to], &self.sums[j][from..to]);
                    let product: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                    products[place(i, j)] -= share * product;
                }
            }
        }
        centred
    }

    /// Square of the mean of the newest rows over the window, summed over the channels.
    pub(super) fn mean_square(&self) -> f32 {
        let share = 1.0 / self.weight.max(1.0);
        self.sums[0].iter().map(|sum| share * sum * share * sum).sum()
    }
}
