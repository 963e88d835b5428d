//! Refines the nonlinear parameters of candidate models between the points of their start grid.

use crate::criteria::{LEAST_REFINEMENT, REFINED_SHARE};
use crate::fit::candidate_model::CandidateModel;
use crate::fit::library::Library;
use crate::fit::regression::{Regression, Subset};
use crate::records::study::Study;

/// Largest number of candidate models whose nonlinear parameters one call of [`refine`] refines.
const REFINED: usize = 3;

/// Refines the nonlinear parameters of the best candidate models: the first `REFINED` of `found` that reduce χ² by more
/// than the share `REFINED_SHARE` of the reduction by the very first. Sorts `found` by χ² at the end.
pub(crate) fn refine(
    study: &Study<'_>,
    library: &mut Library,
    regression: &mut Regression,
    found: &mut [CandidateModel],
) {
    let Some(best) = found.first().map(|best| best.fit.left) else {
        return;
    };
    let whole = regression.residual(Subset::Whole);
    let refined: Vec<usize> = (0..found.len())
        .filter(|index| whole - found[*index].fit.left > REFINED_SHARE * (whole - best))
        .take(REFINED)
        .collect();
    for index in refined {
        let mut model = found[index].clone();
        for position in 0..model.choices.len() {
            model = one(study, library, regression, model, position);
        }
        found[index] = model;
    }
    found.sort_by(|a, b| a.fit.left.total_cmp(&b.fit.left));
}

fn one(
    study: &Study<'_>,
    library: &mut Library,
    regression: &mut Regression,
    model: CandidateModel,
    position: usize,
) -> CandidateModel {
    let choice = model.choices[position];
    let nonlinear_parameters = &library.candidates[choice.candidate].variants[choice.variant].0;
    if nonlinear_parameters.is_empty() {
        return model;
    }
    let settles = library
        .cause(choice.candidate)
        .settled(nonlinear_parameters, &[1.0; 8])
        .is_some();
    if settles {
        settle(study, library, regression, model, position)
    } else {
        search(study, library, regression, model, position)
    }
}

/// Largest number of fixed-point iterations of those nonlinear parameters of a cause that follow from the fitted
/// coefficients.
const FIXED_POINT_ITERATIONS: usize = 12;

/// Iterates towards their fixed point those nonlinear parameters that follow from the fitted coefficients. If the whole
/// step to the new values does not decrease χ², half a step is tried.
fn settle(
    study: &Study<'_>,
    library: &mut Library,
    regression: &mut Regression,
    mut model: CandidateModel,
    position: usize,
) -> CandidateModel {
    for _ in 0..FIXED_POINT_ITERATIONS {
        let choice = model.choices[position];
        let nonlinear_parameters = library.candidates[choice.candidate].variants[choice.variant]
            .0
            .clone();
        let coefficients = library.coefficients(&model, position);
        let Some(asked) = library
            .cause(choice.candidate)
            .settled(&nonlinear_parameters, &coefficients)
        else {
            break;
        };
        if asked
            .iter()
            .zip(&nonlinear_parameters)
            .all(|(a, b)| (a - b).abs() <= 1e-4 * b.abs())
        {
            break;
        }
        let better = [1.0, 0.5].into_iter().find_map(|share| {
            let next = nonlinear_parameters
                .iter()
                .zip(&asked)
                .map(|(nonlinear_parameters, asked)| {
                    nonlinear_parameters + share * (asked - nonlinear_parameters)
                });
            with_nonlinear_parameters(study, library, regression, &model, position, next.collect())
                .filter(|better| better.fit.left < model.fit.left)
        });
        // If no step decreases χ², the whole step is taken: the regressors are exact only at the fixed point, so that a
        // smaller χ² elsewhere does not count.
        let better =
            better.or_else(|| with_nonlinear_parameters(study, library, regression, &model, position, asked));
        let Some(better) = better else {
            break;
        };
        model = better;
    }
    model
}

/// Largest number of Gauss–Newton steps by which a cause's nonlinear parameters are refined after the search by
/// decreasing steps.
const GAUSS_NEWTON_STEPS: usize = 3;

/// Searches each nonlinear parameter of the cause at `position` in turn with decreasing steps, then takes Gauss–Newton
/// steps in all of them.
fn search(
    study: &Study<'_>,
    library: &mut Library,
    regression: &mut Regression,
    mut model: CandidateModel,
    position: usize,
) -> CandidateModel {
    let candidate = model.choices[position].candidate;
    let bounds = library
        .cause(candidate)
        .bounds(study, &library.candidates[candidate].location);
    let mut steps = vec![0.25; bounds.len()];
    for _ in 0..4 {
        for parameter in 0..bounds.len() {
            let [low, high] = bounds[parameter];
            let nonlinear_parameters = library.candidates[candidate].variants
                [model.choices[position].variant]
                .0
                .clone();
            let mut improved = false;
            for sign in [1.0, -1.0] {
                let mut moved = nonlinear_parameters.clone();
                let step = sign * steps[parameter];
                // A nonlinear parameter with a positive lower bound is changed by a factor, any other by a share of its
                // range.
                moved[parameter] = if low > 0.0 {
                    nonlinear_parameters[parameter] * (1.0 + step)
                } else {
                    nonlinear_parameters[parameter] + step * (high - low)
                }
                .clamp(low, high);
                if let Some(better) =
                    with_nonlinear_parameters(study, library, regression, &model, position, moved)
                        .filter(|tried| tried.fit.left < model.fit.left)
                {
                    model = better;
                    improved = true;
                    break;
                }
            }
            if !improved {
                steps[parameter] *= 0.4;
            }
        }
    }
    for _ in 0..GAUSS_NEWTON_STEPS {
        let Some(better) = along_slopes(study, library, regression, &model, position, &bounds) else {
            break;
        };
        model = better;
    }
    model
}

/// One Gauss–Newton step in the nonlinear parameters of the cause at `position`; `None` if it cannot be computed, or
/// does not decrease χ² by more than `LEAST_REFINEMENT`.
fn along_slopes(
    study: &Study<'_>,
    library: &mut Library,
    regression: &mut Regression,
    model: &CandidateModel,
    position: usize,
    bounds: &[[f64; 2]],
) -> Option<CandidateModel> {
    let choice = model.choices[position];
    let coefficients = library.coefficients(model, position);
    let slopes = library.slopes(study, regression, choice, &coefficients)?;
    let mut columns = library.columns_of(model);
    let own = columns.len();
    columns.extend(&slopes);
    let fit = regression.fit(Subset::Whole, &columns)?;
    let nonlinear_parameters = &library.candidates[choice.candidate].variants[choice.variant].0;
    let moved: Vec<f64> = nonlinear_parameters
        .iter()
        .zip(&fit.coefficients[own..])
        .zip(bounds)
        .map(|((value, step), [low, high])| {
            let most = 0.3 * if *low > 0.0 { *value } else { high - low };
            (value + step.clamp(-most, most)).clamp(*low, *high)
        })
        .collect();
    with_nonlinear_parameters(study, library, regression, model, position, moved)
        .filter(|tried| tried.fit.left < model.fit.left - LEAST_REFINEMENT)
}

fn with_nonlinear_parameters(
    study: &Study<'_>,
    library: &mut Library,
    regression: &mut Regression,
    model: &CandidateModel,
    position: usize,
    nonlinear_parameters: Vec<f64>,
) -> Option<CandidateModel> {
    let candidate = model.choices[position].candidate;
    let choice = library.add_variant(study, regression, candidate, nonlinear_parameters)?;
    let mut choices = model.choices.clone();
    choices[position] = choice;
    library.explain(study, regression, &choices)
}
