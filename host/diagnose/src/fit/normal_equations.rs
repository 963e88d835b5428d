//! Inner products of regression columns: the normal equations of any set of columns consist of them.

use nalgebra::DMatrix;

/// Values of each column in one block of a matrix product: 8 KiB per column.
const BLOCK: usize = 1024;

/// Inner products of the whitened regression columns, over one subset of the records' segments.
#[derive(Clone, Debug, Default)]
pub(crate) struct Products {
    /// Lower triangle, row by row, of the Gram matrix: inner products between those regression columns that the last
    /// call of [`Self::complete`] has included.
    gram: Vec<Vec<f64>>,
    /// Squared length of every regression column over the subset.
    squares: Vec<f64>,
    /// Inner product of every regression column with the baseline's residual.
    pub(crate) with_residual: Vec<f64>,
    /// Squared length of the baseline's residual over the subset: its χ².
    pub(crate) residual: f64,
    /// Number of values of the subset, minus the skipped samples and one for each projected free decay or sensor
    /// offset.
    pub(crate) count: usize,
}

impl Products {
    /// Adds a regression column, given its squared length and its inner product with the baseline's residual.
    pub(crate) fn add(&mut self, square: f64, with_residual: f64) {
        self.squares.push(square);
        self.with_residual.push(with_residual);
    }

    /// Adds the inner products of new regression columns with all columns up to themselves: one row of `rows` for each
    /// new column.
    pub(crate) fn complete(&mut self, rows: &DMatrix<f64>) {
        for row in rows.row_iter() {
            let until = self.gram.len() + 1;
            self.gram.push(row.iter().take(until).copied().collect());
        }
    }

    /// Squared length of a regression column over the subset.
    pub(crate) fn square(&self, column: usize) -> f64 {
        self.squares[column]
    }

    /// Inner product of two regression columns; `None` if it is not computed yet.
    pub(crate) fn known(&self, i: usize, j: usize) -> Option<f64> {
        if i == j {
            return Some(self.squares[i]);
        }
        Some(self.gram.get(i.max(j))?[i.min(j)])
    }
}

/// Inner products of the regression columns from index `first` on with all `columns`, one row for each.
///
/// The cost is 2·(new columns)·(columns)·(samples) flops. It is spent block by block (`BLOCK` values of every column),
/// because single inner products would be limited by the memory's speed.
pub(crate) fn products(columns: &[&[f64]], first: usize) -> DMatrix<f64> {
    let (size, length) = (columns.len(), columns.first().map_or(0, |column| column.len()));
    let mut sum = DMatrix::zeros(size - first, size);
    let mut from = 0;
    while from < length {
        let to = (from + BLOCK).min(length);
        let all = DMatrix::from_iterator(
            to - from,
            size,
            columns.iter().flat_map(|column| column[from..to].iter().copied()),
        );
        let new = all.columns(first, size - first).transpose();
        sum.gemm(1.0, &new, &all, 1.0);
        from = to;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_by_blocks_are_those_of_each_pair() {
        let columns: Vec<Vec<f64>> = (0..5)
            .map(|c| {
                (0..2 * BLOCK + 77)
                    .map(|k| ((c * 31 + k) as f64 * 0.7).sin())
                    .collect()
            })
            .collect();
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let rows = products(&columns, 2);
        for new in 2..5 {
            for other in 0..5 {
                let exact: f64 = columns[new].iter().zip(columns[other]).map(|(a, b)| a * b).sum();
                // Rounding of a few thousand terms of size one.
                assert!((rows[(new - 2, other)] - exact).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn rows_are_known_once_they_are_complete() {
        let mut products = Products::default();
        products.add(1.0, 0.0);
        products.add(2.0, 0.0);
        assert_eq!(products.known(1, 1), Some(2.0));
        assert_eq!(products.known(1, 0), None);
        products.complete(&DMatrix::from_row_slice(2, 2, &[1.0, 0.5, 0.5, 2.0]));
        assert_eq!(products.known(0, 1), Some(0.5));
    }
}
