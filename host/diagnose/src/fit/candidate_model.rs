//! A candidate model: causes at their locations with fitted parameters.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::fit::regression::Fit;
use crate::records::record::Clean;

/// A cause at one location with one set of values of its nonlinear parameters, referred to by indices into the library
/// of candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Choice {
    /// Index, in the library, of the candidate: a cause at one location.
    pub candidate: usize,
    /// Index of the chosen set of nonlinear parameters among those that the library holds for the candidate.
    pub variant: usize,
}

/// A candidate model: causes at their locations, with fitted parameters.
#[derive(Clone, Debug)]
pub(crate) struct CandidateModel {
    /// The causes of this candidate model, each at its location and with one set of nonlinear parameters.
    pub choices: Vec<Choice>,
    /// The linear fit of all coefficients to the residual of the baseline, cause after cause in the order of `choices`.
    /// A prediction-error fit overwrites its coefficients and its χ².
    pub fit: Fit,
    /// Number of fitted parameters of the candidate model: see
    /// [`Library::parameter_count`](crate::fit::library::Library::parameter_count).
    pub parameter_count: usize,
    /// Result of the prediction-error fit; `None` if none was made. With such a result, coefficients, nonlinear
    /// parameters and χ² of the model are those of this fit.
    pub simulated: Option<Simulated>,
}

impl CandidateModel {
    /// The baseline alone.
    pub(crate) fn without_causes() -> Self {
        Self {
            choices: Vec::new(),
            fit: Fit {
                coefficients: Vec::new(),
                covariance: DMatrix::zeros(0, 0),
                left: 0.0,
            },
            parameter_count: 0,
            simulated: None,
        }
    }
}

/// Result of a prediction-error fit of a candidate model.
#[derive(Clone, Debug)]
pub(crate) struct Simulated {
    /// For each cause of the candidate model: covariance of its coefficients and, after them, of its nonlinear
    /// parameters, for unit-variance noise.
    pub covariance: Vec<DMatrix<f64>>,
    /// For each record: the fitted initial state of the simulation; empty for a start from rest. No entries in a study
    /// with a cut.
    pub starts: Vec<Vec<f64>>,
    /// The uncertain parameters of the baseline with this model; `None` without such parameters.
    pub baseline: Option<AfterRecords>,
    /// Steps of the finite differences at the end of the fit, one for each free parameter; none in a study with a cut.
    pub steps: Vec<f64>,
    /// Prediction of the records by the extended case in a study with a cut; otherwise `None`.
    pub reading: Option<Arc<ExtendedPrediction>>,
}

/// Uncertain parameters of the baseline after the records: values in standard deviations from the case, and their covariance.
pub(crate) type AfterRecords = (DVector<f64>, DMatrix<f64>);

/// Prediction of the records by an extended case.
#[derive(Debug)]
pub(crate) struct ExtendedPrediction {
    /// For each record and channel: measured samples minus those that the extended case predicts, 0 at samples that are
    /// not compared.
    pub residuals: Vec<Vec<Vec<f64>>>,
    /// Noise-free samples of the channels of each record, as the extended case predicts them.
    pub predicted: Vec<Clean>,
}
