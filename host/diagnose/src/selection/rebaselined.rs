//! Searches a further cause with the extended case as the baseline.
//!
//! Regressors are filtered by the receptance H of the baseline: y = H(iω)·f. If a cause moves a resonance by more than
//! its bandwidth, that receptance is far from that of the machine, and the regressors of further causes do not fit.
//! With the extended case as the baseline, regressors and residual are linearized at the last point of the Gauss–Newton
//! iteration instead of the first.

use nalgebra::DMatrix;

use crate::candidates::extension_tables::joined;
use crate::fit::candidate_model::CandidateModel;
use crate::fit::library::Library;
use crate::fit::regression::{Fit, Regression, Subset};
use crate::records::study::Study;
use crate::selection::search::singles;
use quietcut_model::case::Case;
use quietcut_recording::Recording;

/// Candidate models that consist of `base` and one further cause, found with the extended case of `base` as the
/// baseline, best first: by ascending χ² plus the price of the parameters. Empty if `base` does not change the state
/// matrix of the linear structure, if one of its parameters is not physical or cannot be computed, or if the recordings
/// cannot be compared with the extended case.
pub(crate) fn extended_rebaselined(
    study: &Study<'_>,
    recordings: &[Recording],
    library: &mut Library,
    regression: &mut Regression,
    base: &CandidateModel,
) -> Vec<CandidateModel> {
    let Some(extensions) = library.extensions(study, base) else {
        return Vec::new();
    };
    let mut case: Case = study.baseline.case.clone();
    case.extensions
        .extend(joined(extensions.iter().map(|(name, table)| (*name, table))));
    let Ok(rebaselined) = Study::uncertain(&case, recordings, study.uncertain.clone()) else {
        return Vec::new();
    };
    if rebaselined.baseline.first_order.a == study.baseline.first_order.a {
        return Vec::new();
    }
    let mut columns = Regression::new(&rebaselined);
    let others = Library::new(&rebaselined, &mut columns);
    let mut found: Vec<CandidateModel> = singles(&others, &rebaselined, &columns)
        .into_iter()
        .filter_map(|single| {
            let choice = single.choices[0];
            let known = &others.candidates[choice.candidate];
            let candidate = library
                .candidates
                .iter()
                .position(|other| other.cause == known.cause && other.location == known.location)?;
            let nonlinear_parameters = known.variants[choice.variant].0.clone();
            let choice = library.add_variant(study, regression, candidate, nonlinear_parameters)?;
            if !library.may_act_together(&base.choices, choice) {
                return None;
            }
            let mut choices = base.choices.clone();
            choices.push(choice);
            let coefficients = [&base.fit.coefficients[..], &single.fit.coefficients].concat();
            let model = CandidateModel {
                choices,
                fit: Fit {
                    covariance: DMatrix::zeros(coefficients.len(), coefficients.len()),
                    coefficients,
                    left: single.fit.left,
                },
                parameter_count: base.parameter_count + library.parameter_count(choice),
                simulated: None,
            };
            library.parameters(study, &model).is_some().then_some(model)
        })
        .collect();
    regression.complete();
    let price = (columns.count(Subset::Whole).max(2) as f64).ln();
    let cost = |model: &CandidateModel| model.fit.left + model.parameter_count as f64 * price;
    found.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    found
}
