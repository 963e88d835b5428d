//! From evidence to an answer.

use super::answer::{Diagnosis, Gain, Outcome, Quality, Unexplained};
use super::evidence::{Explanation, Library, gain};
use super::named::{by_common_factor, named};
use super::output_error::{corrected, left_by_baseline};
use super::refine::refine;
use super::regression::{Regression, Share};
use super::scene::{Domain, Scene};
use super::views::views;
use super::{Options, next_test};

/// What a cause must gain to be believed (twice the logarithm of the likelihood, less the price of its parameters).
const BELIEVED: f64 = 20.0;
/// Two explanations whose gains differ by less are not told apart.
pub(super) const APART: f64 = 16.0;
/// Share of the residual that a right explanation may leave for reasons of sampling alone.
const SAMPLING: f64 = 2e-3;
/// Share of the residual's energy by which interpolation between samples may mislead the comparison of explanations.
const NUMERICS: f64 = 1e-4;
/// What may be left beyond the noise, as a share of the noise: that of the estimate of the noise and of chance.
const WITHIN_NOISE: f64 = 0.15;
/// Share of the residual's energy that may be left beyond noise and sampling before nothing is called explained: of responses,
/// where the noise is known by its floor, and of forces, where derivatives of the motion bring noise that is not white.
const LEFT_OF_RESPONSE: f64 = 0.012;
const LEFT_OF_FORCE: f64 = 0.15;

pub(super) fn judge(scene: &Scene<'_>, _options: &Options) -> Diagnosis {
    let mut regression = Regression::new(scene);
    let mut library = Library::new(scene, &mut regression);
    let inflation = inflation(&regression);
    let selection = select(scene, &mut library, &mut regression, inflation);
    answer(scene, &library, &mut regression, inflation, &selection)
}

/// How much what the whole library leaves, and what interpolation may leave, is above the noise.
fn inflation(regression: &Regression) -> f64 {
    let whole = regression.count(Share::Whole) as f64;
    let free = (whole - regression.columns() as f64).max(1.0);
    let sampling = NUMERICS * (regression.residual(Share::Whole) / whole - 1.0).max(0.0);
    (regression.left_by_all() / free + sampling).max(1.0)
}

/// What was selected: the best explanation, and those that are as good with as many causes.
struct Selection {
    best: Option<Explanation>,
    others: Vec<Explanation>,
    /// By how much the best is ahead of the next that is another.
    ahead: f64,
}

fn select(
    scene: &Scene<'_>,
    library: &mut Library,
    regression: &mut Regression,
    inflation: f64,
) -> Selection {
    let mut selection = Selection {
        best: None,
        others: Vec::new(),
        ahead: f64::INFINITY,
    };
    let mut reached = 0.0;
    let mut pairs = Vec::new();
    for size in 1..=3 {
        // Less than half of what the sensors' noise is at least: nothing is there to be explained.
        let silent = regression.residual(Share::Whole) < 0.5 * regression.count(Share::Whole) as f64;
        if silent || (size > 1 && is_enough(regression, selection.best.as_ref(), inflation)) {
            break;
        }
        let mut found = match size {
            1 => library.singles(scene, regression),
            2 => library.pairs(scene, regression),
            _ => library.triples(scene, regression, &pairs),
        };
        refine(scene, library, regression, &mut found);
        found.sort_by(|a, b| gain(regression, b, inflation).total_cmp(&gain(regression, a, inflation)));
        for explanation in found.iter().take(6) {
            let names: Vec<String> = explanation
                .choices
                .iter()
                .map(|choice| {
                    let known = &library.candidates[choice.candidate];
                    format!(
                        "{} {} {:?}",
                        library.cause(choice.candidate).name(),
                        known.place,
                        known.shapes[choice.shape].0
                    )
                })
                .collect();
            tracing::debug!(
                gain = gain(regression, explanation, inflation),
                left = explanation.fit.left / regression.count(Share::Whole) as f64,
                "{}",
                names.join(" + ")
            );
        }
        if size == 2 {
            pairs = found.clone();
        }
        let Some(best) = found.first() else { break };
        let gained = gain(regression, best, inflation);
        let held_out = library.left_held_out(regression, best);
        // What is held out may hold nothing of the effect, as the end of a decay; but it must not speak against it.
        let chance = 4.0 * (2.0 * regression.count(Share::HeldOut) as f64).sqrt();
        if gained < reached + BELIEVED || held_out > regression.residual(Share::HeldOut) + chance {
            continue;
        }
        reached = gained;
        let best = &simplest(scene, library, regression, &found, inflation);
        let gained = gain(regression, best, inflation).max(gained);
        let who = names(library, best);
        let rivals: Vec<&Explanation> = found
            .iter()
            .filter(|other| other.freedoms <= best.freedoms && names(library, other) != who)
            .collect();
        selection.ahead = rivals
            .iter()
            .map(|other| gained - gain(regression, other, inflation))
            .fold(f64::INFINITY, f64::min);
        selection.others = rivals
            .iter()
            .filter(|other| gained - gain(regression, other, inflation) < APART)
            .map(|other| (*other).clone())
            .collect();
        selection.best = Some(best.clone());
    }
    selection
}

/// The first of `found`, corrected by simulation, or one with fewer parameters that leaves as little once it is corrected:
/// more parameters may mend what sampling hides.
fn simplest(
    scene: &Scene<'_>,
    library: &mut Library,
    regression: &mut Regression,
    found: &[Explanation],
    inflation: f64,
) -> Explanation {
    let first = corrected(scene, library, regression, &found[0]);
    let candidate = found[1..]
        .iter()
        .filter(|other| other.freedoms < first.freedoms)
        .find(|other| excess(regression, other.fit.left).1 < SAMPLING);
    let Some(candidate) = candidate else {
        return first;
    };
    let simpler = corrected(scene, library, regression, candidate);
    if gain(regression, &simpler, inflation) > gain(regression, &first, inflation) - APART {
        simpler
    } else {
        first
    }
}

fn names(library: &Library, explanation: &Explanation) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = explanation
        .choices
        .iter()
        .flat_map(|choice| library.cause(choice.candidate).names())
        .collect();
    names.sort_unstable();
    names
}

/// What is left beyond the noise, as a share of the noise and as a share of what was there beyond the noise.
fn excess(regression: &Regression, left: f64) -> (f64, f64) {
    let noise = regression.count(Share::Whole) as f64;
    let beyond = (left - noise).max(0.0);
    let there = (regression.residual(Share::Whole) - noise).max(1e-9 * noise);
    (beyond / noise, beyond / there)
}

/// True where what is left is noise, or so little of what there was that sampling alone may leave it.
fn is_enough(regression: &Regression, best: Option<&Explanation>, inflation: f64) -> bool {
    let left = best.map_or(regression.residual(Share::Whole), |best| best.fit.left);
    let (of_noise, of_excess) = excess(regression, left);
    let count = regression.count(Share::Whole) as f64;
    of_noise / inflation < (4.0 * (2.0 / count).sqrt()).min(WITHIN_NOISE)
        || (best.is_some() && of_excess < SAMPLING)
}

fn answer(
    scene: &Scene<'_>,
    library: &Library,
    regression: &mut Regression,
    inflation: f64,
    selection: &Selection,
) -> Diagnosis {
    let held_out = regression.residual(Share::HeldOut);
    let count = regression.count(Share::HeldOut) as f64;
    let missed = regression.missed(scene);
    let quality = |left: f64| Quality {
        nrmse_heldout: missed * (left / held_out.max(f64::MIN_POSITIVE)).sqrt(),
    };
    let mut diagnosis = Diagnosis {
        outcome: Outcome::None,
        baseline: quality(held_out),
        causes: Vec::new(),
        equivalent: Vec::new(),
        extended: None,
        gain: None,
        unexplained: Unexplained {
            fraction: 0.0,
            place: "none above noise".into(),
            guess: None,
        },
        next_test: None,
        warnings: Vec::new(),
        acting: 0,
        views: views(scene, library, selection.best.as_ref()),
    };
    let left = selection
        .best
        .as_ref()
        .map_or(regression.residual(Share::Whole), |best| best.fit.left);
    let (mut of_noise, of_excess) = excess(regression, left);
    // Along the measured motion terms of the baseline carry the noise of that motion: in closed loop they do not.
    if selection.best.is_none()
        && !scene.baseline.terms.is_empty()
        && of_noise > WITHIN_NOISE
        && let Some(left) = left_by_baseline(scene, library, regression)
    {
        of_noise = of_noise.min(excess(regression, left).0);
    }
    let allowed = if scene.all_in(Domain::Force) {
        LEFT_OF_FORCE
    } else {
        LEFT_OF_RESPONSE
    };
    if of_noise > WITHIN_NOISE {
        diagnosis.unexplained = Unexplained {
            fraction: of_excess,
            place: super::leftover::describe(scene),
            guess: None,
        };
    }
    let Some(best) = selection
        .best
        .as_ref()
        .filter(|_| of_noise <= WITHIN_NOISE || of_excess <= allowed)
    else {
        if of_noise > WITHIN_NOISE {
            diagnosis.outcome = Outcome::Unexplained;
        }
        return diagnosis;
    };
    let left_held_out = library.left_held_out(regression, best);
    diagnosis.outcome = Outcome::Cause;
    let confidence = confidence(selection.ahead, of_excess / allowed);
    diagnosis.causes = named(scene, library, regression, best, inflation, confidence);
    diagnosis.acting = diagnosis.causes.len();
    for other in &selection.others {
        for cause in named(scene, library, regression, other, inflation, confidence) {
            if !diagnosis.causes.iter().any(|known| known.name == cause.name) {
                diagnosis.causes.push(cause);
            }
        }
    }
    for cause in by_common_factor(scene, library, regression, best, inflation) {
        if !diagnosis.causes.iter().any(|known| known.name == cause.name) {
            diagnosis.causes.push(cause);
        }
    }
    if diagnosis.causes.len() > diagnosis.acting {
        diagnosis.outcome = Outcome::Confounded;
        let shared: Vec<&str> = diagnosis.causes[..diagnosis.acting]
            .iter()
            .map(|cause| cause.name)
            .filter(|name| {
                !selection.others.is_empty()
                    && selection
                        .others
                        .iter()
                        .all(|other| names(library, other).contains(name))
            })
            .collect();
        let group: Vec<&'static str> = diagnosis
            .causes
            .iter()
            .map(|cause| cause.name)
            .filter(|name| !shared.contains(name))
            .collect();
        let share = 1.0 / group.len().max(1) as f64;
        for cause in &mut diagnosis.causes {
            if group.contains(&cause.name) {
                cause.confidence = cause.confidence.min(share);
            }
        }
        diagnosis.next_test = Some(next_test::for_group(&group));
        diagnosis.equivalent = vec![group];
    }
    diagnosis.extended = Some(quality(left_held_out));
    let there = (held_out - count).max(1e-9 * held_out);
    diagnosis.gain = Some(Gain {
        residual_energy_removed: (1.0 - (left_held_out - count) / there).min(1.0),
    });
    diagnosis
}

/// From the distance to the next explanation, and from what is left as a share of what is allowed.
fn confidence(ahead: f64, left: f64) -> f64 {
    let by_rivals = 1.0 / (1.0 + (-(ahead - 0.5 * APART) / 6.0).exp());
    let by_rest = 1.0 - 0.5 * left.clamp(0.0, 1.0).powi(2);
    (by_rivals * by_rest).min(0.995)
}
