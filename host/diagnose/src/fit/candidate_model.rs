//! A candidate model: causes at their locations with fitted parameters.

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::fit::regression::Fit;
use crate::records::record::Clean;

/// One candidate with one of its shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Choice {
    /// The candidate.
    pub candidate: usize,
    /// Its shape.
    pub variant: usize,
}

/// Causes that act together, fitted.
#[derive(Clone, Debug)]
pub(crate) struct CandidateModel {
    /// What acts.
    pub choices: Vec<Choice>,
    /// The fit of all their coefficients, in the order of the choices.
    pub fit: Fit,
    /// Parameters that were fitted, those of the shape included.
    pub parameter_count: usize,
    /// What simulation says, where the records can be simulated: coefficients, shapes and what is left are then its own.
    pub simulated: Option<Simulated>,
}

/// Parameters that make a simulation agree with the records.
#[derive(Clone, Debug)]
pub(crate) struct Simulated {
    /// By choice: covariance of coefficients and, behind them, of the shape, for noise of deviation 1.
    pub covariance: Vec<DMatrix<f64>>,
    /// By record: states at its start; empty where it starts from rest.
    pub starts: Vec<Vec<f64>>,
    /// The records with the extended case, where that is kept.
    pub reading: Option<Arc<Reading>>,
}

/// Records with an extended case.
#[derive(Debug)]
pub(crate) struct Reading {
    /// By record and channel: measured less computed.
    pub residuals: Vec<Vec<Vec<f64>>>,
    /// What the channels read without their noise.
    pub predicted: Vec<Clean>,
}
