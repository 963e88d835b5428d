//! Searches the best candidate models of one, two and three causes along the measured motion.

use rayon::prelude::*;

use crate::fit::candidate_model::CandidateModel;
use crate::fit::library::Library;
use crate::fit::regression::Regression;
use crate::records::study::Study;

/// Number of candidate models of two causes, the first of the sorted list, to which a third cause is added.
const PAIRS_KEPT: usize = 24;

/// The candidate models of one cause, for each candidate the best set of nonlinear parameters; by ascending χ².
pub(crate) fn singles(library: &Library, study: &Study<'_>, regression: &Regression) -> Vec<CandidateModel> {
    let found = library
        .choices()
        .par_iter()
        .filter_map(|choice| library.explain(study, regression, &[*choice]))
        .collect();
    best_of_each(found)
}

/// The candidate models of two causes, for each pair of candidates the best sets of nonlinear parameters; by ascending
/// χ².
pub(crate) fn pairs(library: &Library, study: &Study<'_>, regression: &Regression) -> Vec<CandidateModel> {
    let choices = library.choices();
    let found = choices
        .par_iter()
        .enumerate()
        .flat_map_iter(|(index, first)| {
            let rest = &choices[index + 1..];
            rest.iter()
                .filter(|second| library.may_act_together(&[*first], **second))
                .filter_map(|second| library.explain(study, regression, &[*first, *second]))
                .collect::<Vec<_>>()
        })
        .collect();
    best_of_each(found)
}

/// The candidate models of three causes that contain one of the first [`PAIRS_KEPT`] models of `pairs`, for each triple
/// of candidates the best sets of nonlinear parameters; by ascending χ².
pub(crate) fn triples(
    library: &Library,
    study: &Study<'_>,
    regression: &Regression,
    pairs: &[CandidateModel],
) -> Vec<CandidateModel> {
    let choices = library.choices();
    let found = pairs
        .par_iter()
        .take(PAIRS_KEPT)
        .flat_map_iter(|pair| {
            choices
                .iter()
                .filter(|third| library.may_act_together(&pair.choices, **third))
                .filter_map(|third| {
                    let mut all = pair.choices.clone();
                    all.push(*third);
                    all.sort_unstable();
                    library.explain(study, regression, &all)
                })
                .collect::<Vec<_>>()
        })
        .collect();
    best_of_each(found)
}

fn best_of_each(mut found: Vec<CandidateModel>) -> Vec<CandidateModel> {
    found.sort_by(|a, b| a.fit.left.total_cmp(&b.fit.left));
    let mut seen: Vec<Vec<usize>> = Vec::new();
    found.retain(|model| {
        let candidates: Vec<usize> = model.choices.iter().map(|choice| choice.candidate).collect();
        let new = !seen.contains(&candidates);
        if new {
            seen.push(candidates);
        }
        new
    });
    found
}
