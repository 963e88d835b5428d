//! Products of columns: what every fit of some of them is made of.

use nalgebra::DMatrix;

/// Samples at a time: so many of all columns stay in the cache.
const BLOCK: usize = 1024;

/// Products of the columns of one share of the records.
#[derive(Clone, Debug, Default)]
pub(crate) struct Products {
    /// Of the columns from the first on, with all before: the lower triangle, row by row. Later columns are not in it yet.
    gram: Vec<Vec<f64>>,
    /// Of every column with itself.
    squares: Vec<f64>,
    /// Of every column with the residual.
    pub(crate) with_residual: Vec<f64>,
    /// Of the residual with itself.
    pub(crate) residual: f64,
    /// Real numbers that were compared, less those that decays and offsets took.
    pub(crate) count: usize,
}

impl Products {
    /// One column more, with its square and its product with the residual.
    pub(crate) fn add(&mut self, square: f64, with_residual: f64) {
        self.squares.push(square);
        self.with_residual.push(with_residual);
    }

    /// Adds the products of further columns with all before them, given as rows over all columns.
    pub(crate) fn complete(&mut self, rows: &DMatrix<f64>) {
        for row in rows.row_iter() {
            let until = self.gram.len() + 1;
            self.gram.push(row.iter().take(until).copied().collect());
        }
    }

    /// Square of a column.
    pub(crate) fn square(&self, column: usize) -> f64 {
        self.squares[column]
    }

    /// Product of two columns; `None` where it was not computed yet.
    pub(crate) fn known(&self, i: usize, j: usize) -> Option<f64> {
        if i == j {
            return Some(self.squares[i]);
        }
        Some(self.gram.get(i.max(j))?[i.min(j)])
    }
}

/// Products of the columns from `first` on with all of `columns`, one row each.
///
/// 2·(new columns)·(columns)·(samples) flops, as products of matrices that stay in the cache: one dot after the other would wait
/// for the memory.
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
