//! Fits of explanations in closed loop: the extended case moves as it would, and not along the motion that was measured.

use crate::fit::candidate_model::{AfterRecords, CandidateModel};
use crate::fit::library::Library;
use crate::fit::regression::Regression;

/// What can fit explanations so.
pub(crate) trait ClosedFit {
    /// The explanation with the parameters at which the extended case agrees best with the records, from those of the regression
    /// on; `None` where that cannot be computed. It is given up where it stays behind `rival`, a χ² that another has reached;
    /// much is spent on it only where the regression leaves not much more than `best_left`, the least that it leaves.
    fn fit(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        explanation: &CandidateModel,
        limits: (f64, f64),
    ) -> Option<CandidateModel>;

    /// True where what cannot be fitted so is no explanation: the extended case cannot even be read along its own motion.
    fn is_needed(&self) -> bool {
        false
    }

    /// The same explanation once more with the slopes that the extended case itself has, where `fit` used those of the baseline;
    /// `None` where there is nothing to gain.
    fn polished(
        &self,
        _library: &mut Library,
        _regression: &mut Regression,
        _explanation: &CandidateModel,
    ) -> Option<CandidateModel> {
        None
    }

    /// The same explanation with the covariance of its parameters from differences that errors of the computation do not reach;
    /// `None` where they are not differences.
    fn with_covariance(&self, _library: &Library, _explanation: &CandidateModel) -> Option<CandidateModel> {
        None
    }

    /// The same explanation with the covariance that its parameters have where noise of the forces drives a machine that is not
    /// linear; `None` where that changes nothing.
    fn spread_by_force_noise(
        &self,
        _library: &Library,
        _explanation: &CandidateModel,
    ) -> Option<CandidateModel> {
        None
    }

    /// What the case alone leaves, in units of the noise, and its uncertain parameters then.
    fn left_by_baseline(
        &self,
        library: &Library,
        regression: &Regression,
    ) -> Option<(f64, Option<AfterRecords>)>;

    /// Measured less computed, by record and channel, of an explanation that was fitted so.
    fn left_of(&self, library: &Library, explanation: &CandidateModel) -> Option<Vec<Vec<Vec<f64>>>>;

    /// What is left of the held-out parts if the parameters come from the fitted ones alone.
    fn left_held_out(
        &self,
        library: &Library,
        regression: &Regression,
        explanation: &CandidateModel,
    ) -> Option<f64>;
}
