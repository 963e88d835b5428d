//! Joint covariance of parameters of a case: section `[uncertainty]`.

use nalgebra::DMatrix;

use super::deviation::{Deviation, Parameter};
use crate::criteria::DEPENDENT_PARAMETER;

/// Parameters of a case whose errors are jointly normal with a known covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterCovariance {
    /// The uncertain parameters, each once.
    pub parameters: Vec<Parameter>,
    /// Covariance of the parameters: symmetric and positive semidefinite; entry (i, j) in the product of the units of
    /// parameters i and j.
    pub covariance: DMatrix<f64>,
}

impl ParameterCovariance {
    /// Correlation matrix D⁻¹ C D⁻¹ of the covariance C with D = diag(√C_ii). A parameter without variance has the unit
    /// row and column.
    pub fn correlation(&self) -> DMatrix<f64> {
        let covariance = &self.covariance;
        let std = covariance.diagonal().map(f64::sqrt);
        DMatrix::from_fn(covariance.nrows(), covariance.ncols(), |i, j| {
            if i == j {
                1.0
            } else if std[i] > 0.0 && std[j] > 0.0 {
                covariance[(i, j)] / (std[i] * std[j])
            } else {
                0.0
            }
        })
    }

    /// Independent standard normal variables z that give the parameters their covariance: with C = L Lᵀ the errors are
    /// L z. One list for each variable: a column of the lower triangular L, from left to right, without the zeros.
    /// Entries may be negative.
    ///
    /// A parameter whose variance is zero, or whose error follows linearly from those of earlier parameters, has no
    /// variable of its own.
    pub fn independent_parts(&self) -> Vec<Vec<Deviation>> {
        let size = self.parameters.len();
        let std = self.covariance.diagonal().map(f64::sqrt);
        // Cholesky factorization of the correlation matrix. Each pivot is the share of a parameter's variance that
        // earlier parameters leave unexplained.
        let mut rest = self.correlation();
        let mut variables = Vec::new();
        for k in 0..size {
            let pivot = rest[(k, k)];
            if std[k] == 0.0 || pivot <= DEPENDENT_PARAMETER {
                continue;
            }
            let column: Vec<f64> = (k..size).map(|i| rest[(i, k)] / pivot.sqrt()).collect();
            for i in k..size {
                for j in k..size {
                    rest[(i, j)] -= column[i - k] * column[j - k];
                }
            }
            let parts = column.iter().enumerate().filter(|(_, entry)| **entry != 0.0);
            variables.push(
                parts
                    .map(|(below, entry)| Deviation {
                        parameter: self.parameters[k + below],
                        std: std[k + below] * entry,
                    })
                    .collect(),
            );
        }
        variables
    }
}
