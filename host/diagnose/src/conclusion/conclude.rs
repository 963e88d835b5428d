//! Concludes a diagnosis: selects a candidate model and turns it into an answer.

use crate::conclusion::answer::{Diagnosis, EstimatedCause, Gain, Outcome, Quality, Unexplained};
use crate::conclusion::parameter_estimates::{by_common_factor, parameter_estimates};
use crate::conclusion::residual_views::{ResidualView, residual_views};
use crate::criteria::{
    CHANCE_OF_DOUBT, CONFIDENCE_LOSS, CONFIDENCE_WIDTH, DOUBT, DOUBTFUL_RESIDUAL, EQUIVALENT,
    HIGHEST_CONFIDENCE, NOISE_TOLERANCE, UNEXPLAINED_OF_FORCE, UNEXPLAINED_OF_RESPONSE,
    UNEXPLAINED_PER_FURTHER_CAUSE, UNLIKE_SEGMENTS,
};
use crate::fit::candidate_model::CandidateModel;
use crate::fit::library::Library;
use crate::fit::regression::{Regression, Subset};
use crate::progress::{Options, Stage};
use crate::records::checks;
use crate::records::domain::Domain;
use crate::records::study::Study;
use crate::selection::select::{Selection, SelectionCriteria, names, select};
use quietcut_model::effects::EffectName;
use quietcut_recording::Recording;

pub(crate) fn conclude(
    study: &Study<'_>,
    recordings: &[Recording],
    _options: &Options,
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
    answer(&criteria, &library, &mut regression, &selection)
}

fn answer(
    criteria: &SelectionCriteria<'_>,
    library: &Library,
    regression: &mut Regression,
    selection: &Selection,
) -> Diagnosis {
    let study = criteria.study;
    let inflation = criteria.inflation(regression, selection.best.as_ref());
    let held_out = regression.residual(Subset::HeldOut);
    let count = regression.count(Subset::HeldOut) as f64;
    let whole = regression.residual(Subset::Whole);
    let views = residual_views(study, library, selection.best.as_ref());
    let mut diagnosis = of_baseline(study, library, regression, views);
    let baseline_quality = diagnosis.baseline;
    let (of_noise, of_excess) = criteria.excess(regression, selection.best.as_ref());
    let allowed = allowed_residual(study, selection.best.as_ref());
    if of_noise > NOISE_TOLERANCE {
        diagnosis.unexplained.fraction = of_excess;
    }
    let Some(best) = selection
        .best
        .as_ref()
        .filter(|_| of_noise <= NOISE_TOLERANCE || of_excess <= allowed)
    else {
        if of_noise > NOISE_TOLERANCE {
            // No candidate model is accepted: the views show the residual of the baseline.
            diagnosis.views = residual_views(study, library, None);
            diagnosis.unexplained.location = crate::conclusion::unexplained::describe(&diagnosis.views);
            diagnosis.outcome = Outcome::Unexplained;
            diagnosis.unexplained.guess = crate::conclusion::guess::guess(study, regression);
        }
        return diagnosis;
    };
    if of_noise > NOISE_TOLERANCE {
        diagnosis.unexplained.location = crate::conclusion::unexplained::describe(&diagnosis.views);
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
    let spread = |model: &CandidateModel| {
        let closed = criteria.closed.as_ref();
        closed.and_then(|closed| closed.spread_by_force_noise(library, model))
    };
    let best = &spread(best).unwrap_or_else(|| best.clone());
    diagnosis.causes = parameter_estimates(study, library, regression, best, uncertain, confidence);
    diagnosis.acting = diagnosis.causes.len();
    diagnosis.warnings.extend(unit_warnings(&diagnosis.causes));
    diagnosis.explanations = vec![diagnosis.causes.clone()];
    let who = names(library, best);
    for other in &selection.others {
        let other = &spread(other).unwrap_or_else(|| other.clone());
        let causes = parameter_estimates(study, library, regression, other, uncertain, confidence);
        diagnosis.add_rival(causes, names(library, other) == who);
    }
    let by_factor = by_common_factor(study, library, regression, best, inflation);
    diagnosis.add_rival(by_factor, false);
    if diagnosis.causes.len() > diagnosis.acting {
        let shared = shared_names(library, selection, &who);
        confound(&mut diagnosis, &shared);
    }
    let share = |left: f64, there: f64| (left / there.max(f64::MIN_POSITIVE)).sqrt();
    diagnosis.extended = Some(Quality {
        nrmse_heldout: baseline_quality.nrmse_heldout * share(left_held_out, held_out),
        nrmse_whole: baseline_quality.nrmse_whole * share(best.fit.left, whole),
    });
    diagnosis.gain = Some(Gain::new(held_out, left_held_out, count));
    diagnosis
}

/// The answer if the baseline is right, with the warnings of the library, and one more if the prediction error is much
/// larger on the whole records than on the held-out segments.
fn of_baseline(
    study: &Study<'_>,
    library: &Library,
    regression: &Regression,
    views: Vec<ResidualView>,
) -> Diagnosis {
    let baseline = Quality {
        nrmse_heldout: regression.nrmse(study, Subset::HeldOut),
        nrmse_whole: regression.nrmse(study, Subset::Whole),
    };
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
            guess: None,
        },
        lobes: None,
        baseline_lobes: None,
        next_test: None,
        warnings,
        explanations: Vec::new(),
        acting: 0,
        views,
    }
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
