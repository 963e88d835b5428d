//! Builds candidate models with one cause more or less, from the residual of a simulation.
//!
//! The residual of a simulation contains neither the noise of the measured motion nor aliasing, and shows the next
//! cause (score test). A cause that a later one made redundant is removed, or replaced by a simpler one.

use nalgebra::DMatrix;

use crate::fit::candidate_model::{CandidateModel, Choice};
use crate::fit::library::Library;
use crate::fit::regression::{Fit, Regression, Subset};
use crate::records::study::Study;

/// Candidate models that consist of `base` and one further cause, at most one for each candidate, best first: by
/// ascending χ², divided by that of `base` per sample if that is above 1, plus the price of the parameters. `left` is
/// the residual of the simulation of `base`, by record and channel.
pub(crate) fn extended(
    study: &Study<'_>,
    library: &mut Library,
    regression: &mut Regression,
    base: &CandidateModel,
    left: &[Vec<Vec<f64>>],
) -> Vec<CandidateModel> {
    let target = regression.add(left);
    library.add_variants_beside(study, regression, left);
    regression.complete();
    let library = &*library;
    let mut found: Vec<CandidateModel> = library
        .choices()
        .into_iter()
        .filter(|choice| library.may_act_together(&base.choices, *choice))
        .filter_map(|choice| with(study, library, regression, base, choice, target))
        .collect();
    let price = (regression.count(Subset::Whole).max(2) as f64).ln();
    let inflation = (base.fit.left / regression.count(Subset::Whole).max(1) as f64).max(1.0);
    let cost = |model: &CandidateModel| model.fit.left / inflation + model.parameter_count as f64 * price;
    found.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    let mut seen: Vec<usize> = Vec::new();
    found.retain(|model| {
        let candidate = model.choices.last().map_or(0, |choice| choice.candidate);
        let new = !seen.contains(&candidate);
        seen.push(candidate);
        new
    });
    found
}

fn with(
    study: &Study<'_>,
    library: &Library,
    regression: &Regression,
    base: &CandidateModel,
    choice: Choice,
    target: usize,
) -> Option<CandidateModel> {
    let mut columns = library.columns_of(base);
    let own = columns.len();
    columns.extend(library.columns(choice));
    let (change, taken) = regression.fit_column(Subset::Whole, &columns, target)?;
    let mut choices = base.choices.clone();
    choices.push(choice);
    let of = |share: f64| {
        let coefficients: Vec<f64> = change
            .iter()
            .enumerate()
            .map(|(index, change)| match base.fit.coefficients.get(index) {
                Some(known) if index < own => known + share * change,
                _ => *change,
            })
            .collect();
        let model = CandidateModel {
            choices: choices.clone(),
            fit: Fit {
                covariance: DMatrix::zeros(coefficients.len(), coefficients.len()),
                coefficients,
                left: (base.fit.left - taken).max(0.0),
            },
            parameter_count: base.parameter_count + library.parameter_count(choice),
            simulated: None,
        };
        library.parameters(study, &model).is_some().then_some(model)
    };
    of(1.0).or_else(|| of(0.0))
}

/// The candidate model without the cause at index `position`; its other coefficients and its χ² are not computed anew.
pub(crate) fn without(library: &Library, model: &CandidateModel, position: usize) -> CandidateModel {
    let mut coefficients = Vec::new();
    for other in (0..model.choices.len()).filter(|other| *other != position) {
        coefficients.extend(library.coefficients(model, other));
    }
    let mut choices = model.choices.clone();
    let removed = choices.remove(position);
    CandidateModel {
        parameter_count: model.parameter_count - library.parameter_count(removed),
        choices,
        fit: Fit {
            covariance: DMatrix::zeros(coefficients.len(), coefficients.len()),
            coefficients,
            left: model.fit.left,
        },
        simulated: None,
    }
}

/// Candidate models in which a simpler cause at the same location replaces the cause at index `position`, such as a
/// cubic or a quintic spring for softening-hardening. The parameters of the simpler cause are some of those of the
/// replaced one, with the same values.
pub(crate) fn nested(
    study: &Study<'_>,
    library: &Library,
    model: &CandidateModel,
    position: usize,
) -> Vec<CandidateModel> {
    let Some(parameters) = library.parameters(study, model) else {
        return Vec::new();
    };
    let whole = model.choices[position];
    let values = &parameters[position];
    let acts_at = &library.candidates[whole.candidate].location;
    let before = model.choices[..position].iter();
    let from: usize = before.map(|choice| library.columns(*choice).len()).sum();
    let to = from + library.columns(whole).len();
    let simpler = |choice: Choice| {
        let known = &library.candidates[choice.candidate];
        let (nonlinear_parameters, columns) = &known.variants[choice.variant];
        if known.location != *acts_at
            || !nonlinear_parameters.is_empty()
            || library.parameter_count(choice) >= library.parameter_count(whole)
        {
            return None;
        }
        // A simpler cause can replace this one only if the parameters that it reports are among those of the replaced
        // cause, with equal values.
        let cause = library.cause(choice.candidate);
        let own = values.windows(columns.len()).find_map(|some| {
            let own: Vec<f64> = some.iter().map(|(_, value)| *value).collect();
            let reported = cause.parameters(study, acts_at, nonlinear_parameters, &own)?;
            let is_part = !reported.is_empty() && reported.iter().all(|known| values.contains(known));
            is_part.then_some(own)
        })?;
        let mut coefficients = model.fit.coefficients.clone();
        coefficients.splice(from..to, own);
        let mut choices = model.choices.clone();
        choices[position] = choice;
        Some(CandidateModel {
            parameter_count: choices
                .iter()
                .map(|choice| library.parameter_count(*choice))
                .sum(),
            choices,
            fit: Fit {
                covariance: DMatrix::zeros(coefficients.len(), coefficients.len()),
                coefficients,
                left: model.fit.left,
            },
            simulated: None,
        })
    };
    library.choices().into_iter().filter_map(simpler).collect()
}

/// Removes candidate models whose causes and locations occur earlier in the list.
pub(crate) fn distinct(found: Vec<CandidateModel>) -> Vec<CandidateModel> {
    let mut seen: Vec<Vec<usize>> = Vec::new();
    found
        .into_iter()
        .filter(|model| {
            let mut candidates: Vec<usize> = model.choices.iter().map(|choice| choice.candidate).collect();
            candidates.sort_unstable();
            let new = !seen.contains(&candidates);
            if new {
                seen.push(candidates);
            }
            new
        })
        .collect()
}
