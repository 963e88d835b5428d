//! Concludes a diagnosis: selects a candidate model and turns it into an answer.

use crate::baseline::uncertain::Uncertain;
use crate::conclusion::answer::{Diagnosis, EstimatedCause, Gain, Outcome, Quality, Unexplained};
use crate::conclusion::nearest_baseline::nearest_baseline;
use crate::conclusion::parameter_estimates::{by_common_factor, parameter_estimates};
use crate::conclusion::prediction_error::{prediction_error, prediction_error_of};
use crate::conclusion::residual_views::{ResidualView, residual_views};
use crate::conclusion::updates::Posterior;
use crate::conclusion::{places, unexplained};
use crate::criteria::{
    CHANCE_OF_DOUBT, CONFIDENCE_LOSS, CONFIDENCE_WIDTH, DOUBT, DOUBTFUL_RESIDUAL, EQUIVALENT,
    HIGHEST_CONFIDENCE, NOISE_TOLERANCE, UNEXPLAINED_OF_FORCE, UNEXPLAINED_OF_RESPONSE,
    UNEXPLAINED_PER_FURTHER_CAUSE, UNLIKE_SEGMENTS,
};
use crate::error::DiagnoseError;
use crate::fit::candidate_model::CandidateModel;
use crate::fit::library::Library;
use crate::fit::regression::{Regression, Subset};
use crate::progress::{Options, Stage};
use crate::records::checks;
use crate::records::domain::Domain;
use crate::records::study::Study;
use crate::selection::select::{Selection, SelectionCriteria, names, select};
use quietcut_model::case::Case;
use quietcut_model::effects::EffectName;
use quietcut_recording::Recording;

/// The baseline as its case has it, beside its records.
struct Written<'a> {
    study: &'a Study<'a>,
    regression: Regression,
}

/// Concludes the diagnosis of records that are not all answered by their orders. What the case states as uncertain of its
/// structure is fitted with every candidate model, unless a record is a cut.
///
/// # Errors
/// The case cannot be simulated, or a recording cannot be compared.
pub(crate) fn of_records(
    case: &Case,
    recordings: &[Recording],
    _options: &Options,
    watch: &dyn Fn(Stage),
) -> Result<Diagnosis, DiagnoseError> {
    let study = Study::new(case, recordings)?;
    let written = Written {
        regression: Regression::new(&study),
        study: &study,
    };
    let uncertain = Uncertain::of_case(case);
    let is_cut = study.records.iter().any(|record| record.cut.is_some());
    if is_cut || uncertain.len() == 0 {
        return Ok(conclude(&written, written.study, recordings, watch));
    }
    let (nearest, uncertain) = nearest_baseline(case, recordings, uncertain);
    let study = Study::uncertain(&nearest, recordings, uncertain)?;
    Ok(conclude(&written, &study, recordings, watch))
}

fn conclude(
    written: &Written<'_>,
    study: &Study<'_>,
    recordings: &[Recording],
    watch: &dyn Fn(Stage),
) -> Diagnosis {
    watch(Stage::Library);
    let mut regression = Regression::new(study);
    let mut library = Library::new(study, &mut regression);
    if study.all_in(Domain::Force) && study.records.len() > 1 {
        regression.level_records();
    }
    let criteria = SelectionCriteria::new(study, recordings, &library, &regression);
    let selection = select(&criteria, &mut library, &mut regression, watch);
    watch(Stage::Answer);
    answer(written, &criteria, &library, &mut regression, &selection)
}

fn answer(
    written: &Written<'_>,
    criteria: &SelectionCriteria<'_>,
    library: &Library,
    regression: &mut Regression,
    selection: &Selection,
) -> Diagnosis {
    let study = criteria.study;
    let inflation = criteria.inflation(regression, selection.best.as_ref());
    let held_out = regression.residual(Subset::HeldOut);
    let count = regression.count(Subset::HeldOut) as f64;
    let mut diagnosis = of_baseline(prediction_error(written.study, &written.regression), library);
    let written_held_out = written.regression.residual(Subset::HeldOut);
    diagnosis.views = views(written, study, library, selection.best.as_ref());
    let (of_noise, of_excess) = criteria.excess(regression, selection.best.as_ref());
    let allowed = allowed_residual(study, selection.best.as_ref());
    if of_noise > NOISE_TOLERANCE {
        diagnosis.unexplained.fraction = of_excess;
    }
    let accepted = selection
        .best
        .as_ref()
        .filter(|_| of_noise <= NOISE_TOLERANCE || of_excess <= allowed);
    diagnosis.posterior = posterior(written, criteria, library, regression, accepted);
    diagnosis.updates = diagnosis
        .posterior
        .as_ref()
        .map_or_else(Vec::new, Posterior::updates);
    let Some(best) = accepted else {
        if of_noise > NOISE_TOLERANCE {
            // No candidate model is accepted: the views show the residual of the baseline.
            diagnosis.views = views(written, study, library, None);
            locate(&mut diagnosis);
            diagnosis.outcome = Outcome::Unexplained;
            diagnosis.unexplained.guess = crate::conclusion::guess::guess(study, regression);
        } else if !diagnosis.updates.is_empty() {
            diagnosis.outcome = Outcome::Update;
            diagnosis.extended = extended_error(&mut diagnosis, written, criteria.recordings);
            diagnosis.gain = Some(Gain::new(written_held_out, held_out, count));
        }
        return diagnosis;
    };
    if of_noise > NOISE_TOLERANCE {
        locate(&mut diagnosis);
    }
    let left_held_out = criteria.left_held_out(library, regression, best);
    diagnosis.outcome = Outcome::Cause;
    let chance =
        CHANCE_OF_DOUBT * (2.0 / regression.count(Subset::Whole).max(1) as f64).sqrt() + DOUBTFUL_RESIDUAL;
    let doubt = if best.simulated.is_some() && of_noise > chance {
        DOUBT
    } else {
        1.0
    };
    let confidence = doubt * confidence(selection.ahead, of_excess / allowed);
    // Errors of the computation are proportional to the signal. If they resemble the contribution of a cause, they bias
    // the parameters of the cause, so the variances are raised.
    let uncertain = inflation + criteria.coherent;
    let estimated = |model: &CandidateModel| {
        let Some(closed) = &criteria.closed else {
            return model.clone();
        };
        let model = closed
            .with_covariance(library, model)
            .unwrap_or_else(|| model.clone());
        closed.spread_by_force_noise(library, &model).unwrap_or(model)
    };
    let best = &estimated(best);
    diagnosis.causes = parameter_estimates(study, library, regression, best, uncertain, confidence);
    diagnosis.acting = diagnosis.causes.len();
    diagnosis.warnings.extend(unit_warnings(&diagnosis.causes));
    diagnosis.explanations = vec![diagnosis.causes.clone()];
    let who = names(library, best);
    for other in &selection.others {
        let other = &estimated(other);
        let causes = parameter_estimates(study, library, regression, other, uncertain, confidence);
        diagnosis.add_rival(causes, names(library, other) == who);
    }
    let by_factor = by_common_factor(study, library, regression, best, inflation);
    diagnosis.add_rival(by_factor, false);
    if diagnosis.causes.len() > diagnosis.acting {
        let shared = shared_names(library, selection, &who);
        confound(&mut diagnosis, &shared);
    }
    diagnosis.extended = extended_error(&mut diagnosis, written, criteria.recordings);
    diagnosis.gain = Some(Gain::new(written_held_out, left_held_out, count));
    diagnosis
}

/// The prediction error of the extended case; `None`, with a warning, if it cannot be compared with the records.
fn extended_error(
    diagnosis: &mut Diagnosis,
    written: &Written<'_>,
    recordings: &[Recording],
) -> Option<Quality> {
    let case = diagnosis.extended(written.study.baseline.case)?;
    let error = prediction_error_of(&case, recordings);
    error
        .inspect_err(|error| {
            let reason = format!("the extended case cannot be compared with the records: {error}");
            diagnosis.warnings.push(reason);
        })
        .ok()
}

/// The answer if the baseline is right, with the warnings of the library, and one more if the prediction error is much
/// larger on the whole records than on the held-out segments.
fn of_baseline(baseline: Quality, library: &Library) -> Diagnosis {
    let mut warnings = library.unexamined.clone();
    if baseline.nrmse_whole > UNLIKE_SEGMENTS * baseline.nrmse_heldout {
        warnings.push(format!(
            "prediction error (NRMSE): {:.2} % on held-out segments, {:.2} % overall: most of the residual lies in the fitted segments, so that the held-out gain is of little value",
            100.0 * baseline.nrmse_heldout,
            100.0 * baseline.nrmse_whole
        ));
    }
    Diagnosis {
        outcome: Outcome::None,
        baseline,
        causes: Vec::new(),
        equivalent: Vec::new(),
        extended: None,
        gain: None,
        unexplained: Unexplained {
            fraction: 0.0,
            location: "none above noise".into(),
            places: Vec::new(),
            guess: None,
        },
        lobes: None,
        baseline_lobes: None,
        next_test: None,
        warnings,
        explanations: Vec::new(),
        acting: 0,
        posterior: None,
        updates: Vec::new(),
        views: Vec::new(),
    }
}

/// Says where the residual that the views show lies.
fn locate(diagnosis: &mut Diagnosis) {
    diagnosis.unexplained.location = unexplained::describe(&diagnosis.views);
    diagnosis.unexplained.places = places::of_views(&diagnosis.views);
}

/// The residuals of the case as it is, and what its uncertain parameters and `best` leave of them.
fn views(
    written: &Written<'_>,
    study: &Study<'_>,
    library: &Library,
    best: Option<&CandidateModel>,
) -> Vec<ResidualView> {
    let mut views = residual_views(study, library, best);
    if study.uncertain.len() > 0 {
        let as_written = residual_views(written.study, library, None);
        for (view, written) in views.iter_mut().zip(as_written) {
            let fitted = std::mem::replace(&mut view.residual, written.residual);
            if view.left.is_empty() {
                view.left = fitted;
            }
        }
    }
    views
}

/// The uncertain parameters of the case after the records, with the causes of `best`; `None` without such parameters.
fn posterior(
    written: &Written<'_>,
    criteria: &SelectionCriteria<'_>,
    library: &Library,
    regression: &Regression,
    best: Option<&CandidateModel>,
) -> Option<Posterior> {
    let uncertain = &criteria.study.uncertain;
    let simulated = match best {
        Some(best) => best
            .simulated
            .as_ref()
            .and_then(|simulated| simulated.baseline.clone()),
        None => criteria.baseline.clone(),
    };
    let (z, covariance) = simulated.or_else(|| {
        let columns = best.map_or_else(Vec::new, |best| library.columns_of(best));
        let (change, covariance) = regression.after(&columns, best.map(|best| &best.fit))?;
        Some((&uncertain.at + change, covariance))
    })?;
    Posterior::new(written.study.baseline.case, &uncertain.variables, &z, &covariance)
}

/// Largest share of the baseline's residual energy above the noise that may stay unexplained by the candidate model
/// `best` for `best` to be accepted.
fn allowed_residual(study: &Study<'_>, best: Option<&CandidateModel>) -> f64 {
    match best {
        _ if study.all_in(Domain::Force) => UNEXPLAINED_OF_FORCE,
        Some(best) if best.simulated.is_some() => {
            UNEXPLAINED_OF_RESPONSE * UNEXPLAINED_PER_FURTHER_CAUSE.powi(best.choices.len() as i32 - 1)
        }
        _ => UNEXPLAINED_OF_RESPONSE,
    }
}

/// Warnings about estimated sensor gains close to the ratio of a unit mix-up (such as 9.81 for g instead of m/s²).
fn unit_warnings(causes: &[EstimatedCause]) -> Vec<String> {
    causes
        .iter()
        .filter(|cause| cause.name == EffectName::SensorGain.name())
        .filter_map(|cause| {
            let gain = cause.parameters["gain"].value;
            let unit = checks::unit_of_gain(gain)?;
            let channel = cause.channel.as_deref().unwrap_or("every channel of motion");
            Some(format!(
                "{channel} reads {gain:.4} times the true value, which is about {unit}: check its unit and that of the force"
            ))
        })
        .collect()
}

/// The names of causes of the best candidate model, `best`, that all equivalent models contain; empty without an
/// equivalent model.
fn shared_names(library: &Library, selection: &Selection, best: &[&'static str]) -> Vec<&'static str> {
    let others = &selection.others;
    let in_all = |name: &&'static str| {
        let contains = |other: &CandidateModel| names(library, other).contains(name);
        !others.is_empty() && others.iter().all(contains)
    };
    best.iter().copied().filter(in_all).collect()
}

/// Sets the outcome to confounded. The group of equivalent names holds those that not all equivalent candidate models
/// share, and the confidence in them is bounded by one over the number of names in the group or of models, whichever is
/// larger. If all models share all names, the group holds the names of the causes that equivalent models add.
fn confound(diagnosis: &mut Diagnosis, shared: &[&'static str]) {
    diagnosis.outcome = Outcome::Confounded;
    let mut group = diagnosis.names();
    group.retain(|name| !shared.contains(name));
    if group.is_empty() {
        let elsewhere = &diagnosis.causes[diagnosis.acting..];
        group = diagnosis.names();
        group.retain(|name| elsewhere.iter().any(|cause| cause.name == *name));
    }
    let share = 1.0 / group.len().max(diagnosis.explanations.len()) as f64;
    let explanations = diagnosis.explanations.iter_mut().flatten();
    for cause in diagnosis.causes.iter_mut().chain(explanations) {
        if group.contains(&cause.name) {
            cause.confidence = cause.confidence.min(share);
        }
    }
    diagnosis.equivalent = vec![group];
}

/// Confidence that a cause is present, from 0 to [`HIGHEST_CONFIDENCE`]. `ahead` is the lead in gain of its candidate
/// model over its best rival; `left` is the share of the residual energy above the noise that the model does not
/// explain, over the allowed share.
fn confidence(ahead: f64, left: f64) -> f64 {
    let by_rivals = 1.0 / (1.0 + (-(ahead - 0.5 * EQUIVALENT) / CONFIDENCE_WIDTH).exp());
    let by_rest = 1.0 - CONFIDENCE_LOSS * left.clamp(0.0, 1.0).powi(2);
    (by_rivals * by_rest).min(HIGHEST_CONFIDENCE)
}
