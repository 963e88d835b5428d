//! The answer of a diagnosis of cuts by their orders.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::eigenvalues::of_symmetric;

use super::candidate::Candidate;
use super::record::ReducedCut;
use super::selection::{Explanation, Explanations};
use super::views;
use crate::baseline::direction_of;
use crate::candidates::cause::Location;
use crate::conclusion::answer::{
    Diagnosis, EstimatedCause, Figure, Gain, NINETY_PERCENT, Outcome, Quality, Unexplained,
};
use crate::conclusion::places;
use crate::conclusion::updates::Posterior;
use quietcut_recording::Recording;
use quietcut_stability::Variable;

/// Difference of two log evidences up to which two sets of effects explain records equally well: odds of 20.
const EQUIVALENT: f64 = 3.0;
/// Largest confidence.
const HIGHEST_CONFIDENCE: f64 = 0.99;
/// Largest share of the baseline's χ² beyond the noise that a cause may leave.
const LEFT_BY_CAUSE: f64 = 0.05;

/// The answer to the explanations of the records.
pub(super) fn answer(
    explanations: &Explanations<'_>,
    records: &[ReducedCut],
    recordings: &[Recording],
) -> Diagnosis {
    let baseline = &explanations.baseline;
    let best = explanations.ranked.first();
    let excess = |explanation: &Explanation<'_>| {
        let count = explanation.fit.residual.len() as f64;
        (explanation.fit.left - count).max(0.0)
    };
    let last = best.unwrap_or(baseline);
    let left = if last.fit.is_enough() {
        0.0
    } else {
        excess(last) / excess(baseline).max(f64::MIN_POSITIVE)
    };
    let explained = best.filter(|_| left <= LEFT_BY_CAUSE);
    let written = explanations.written.as_ref().unwrap_or(baseline);
    let posterior = posterior(explained.unwrap_or(baseline));
    let updates = posterior.as_ref().map_or_else(Vec::new, Posterior::updates);
    let mut diagnosis = Diagnosis {
        outcome: if left > 0.0 && explained.is_none() {
            Outcome::Unexplained
        } else if updates.is_empty() {
            Outcome::None
        } else {
            Outcome::Update
        },
        baseline: quality(written, records),
        causes: Vec::new(),
        updates,
        posterior,
        equivalent: Vec::new(),
        extended: None,
        gain: None,
        unexplained: Unexplained {
            fraction: left,
            location: if left > 0.0 {
                views::place(last, records)
            } else {
                "none above noise".into()
            },
            places: Vec::new(),
            guess: None,
        },
        lobes: None,
        baseline_lobes: None,
        next_test: None,
        warnings: Vec::new(),
        explanations: Vec::new(),
        acting: 0,
        views: Vec::new(),
    };
    if let Some(best) = explained {
        name_causes(&mut diagnosis, explanations, best);
    }
    let extended = explained.or((diagnosis.outcome == Outcome::Update).then_some(baseline));
    if let Some(extended) = extended {
        diagnosis.extended = Some(quality(extended, records));
        let count = extended.fit.residual.len() as f64;
        diagnosis.gain = Some(Gain::new(written.fit.left, extended.fit.left, count));
    }
    diagnosis.views = views::views(written, extended, records, recordings);
    if left > 0.0 {
        diagnosis.unexplained.places = views::places(last, records);
        diagnosis
            .unexplained
            .places
            .extend(places::events(&diagnosis.views));
    }
    diagnosis
}

/// The parameters that the case states as uncertain, after the records.
fn posterior(explanation: &Explanation<'_>) -> Option<Posterior> {
    let space = &explanation.space;
    let case = space.baseline.case;
    if !case.is_uncertain() {
        return None;
    }
    let (places, variables): (Vec<usize>, Vec<Variable>) = space
        .of_case()
        .map(|(number, variable)| (number, variable.clone()))
        .unzip();
    let covariance = explanation.fit.covariance()?;
    let own = covariance.select_rows(&places).select_columns(&places);
    let z = DVector::from_iterator(places.len(), places.iter().map(|place| explanation.fit.z[*place]));
    Posterior::new(case, &variables, &z, &own)
}

/// Prediction error of the orders but 0.
pub(super) fn quality(explanation: &Explanation<'_>, records: &[ReducedCut]) -> Quality {
    let shares: Vec<f64> = explanation
        .fit
        .errors()
        .zip(records)
        .flat_map(|(error, record)| {
            let measured = &record.orders.amplitudes;
            (0..measured.ncols())
                .map(|channel| {
                    let energy = |of: &DMatrix<_>| {
                        of.column(channel)
                            .iter()
                            .skip(1)
                            .map(num_complex::Complex64::norm_sqr)
                            .sum::<f64>()
                    };
                    energy(error) / energy(measured).max(f64::MIN_POSITIVE)
                })
                .collect::<Vec<f64>>()
        })
        .collect();
    let nrmse = (shares.iter().sum::<f64>() / shares.len().max(1) as f64).sqrt();
    Quality {
        nrmse_heldout: nrmse,
        nrmse_whole: nrmse,
    }
}

/// Names of the effects of an explanation.
fn names(explanation: &Explanation<'_>) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = explanation
        .space
        .candidates
        .iter()
        .map(|candidate| candidate.effect.name())
        .collect();
    names.sort_unstable();
    names
}

fn name_causes(diagnosis: &mut Diagnosis, explanations: &Explanations<'_>, best: &Explanation<'_>) {
    let who = names(best);
    // Probabilities of all explanations, the baseline among them.
    let weight = |explanation: &Explanation<'_>| (explanation.evidence - best.evidence).exp();
    let all: f64 = explanations.ranked.iter().map(weight).sum::<f64>() + weight(&explanations.baseline);
    let own: f64 = explanations
        .ranked
        .iter()
        .filter(|other| names(other) == who)
        .map(weight)
        .sum();
    let confidence = (own / all).min(HIGHEST_CONFIDENCE);
    diagnosis.causes = causes(best, confidence);
    diagnosis.acting = diagnosis.causes.len();
    diagnosis.explanations = vec![diagnosis.causes.clone()];
    diagnosis.outcome = Outcome::Cause;
    let rivals: Vec<&Explanation<'_>> = explanations
        .ranked
        .iter()
        .skip(1)
        .filter(|other| best.evidence - other.evidence < EQUIVALENT)
        .collect();
    for rival in &rivals {
        diagnosis.add_rival(causes(rival, confidence), names(rival) == who);
    }
    if rivals.iter().any(|rival| names(rival) != who) {
        diagnosis.outcome = Outcome::Confounded;
        let in_all = |name: &&'static str| rivals.iter().all(|rival| names(rival).contains(name));
        let shared: Vec<&'static str> = who.iter().copied().filter(in_all).collect();
        let mut group = diagnosis.names();
        group.retain(|name| !shared.contains(name));
        let most = 1.0 / group.len().max(2) as f64;
        let explanations = diagnosis.explanations.iter_mut().flatten();
        for cause in diagnosis.causes.iter_mut().chain(explanations) {
            if group.contains(&cause.name) {
                cause.confidence = cause.confidence.min(most);
            }
        }
        diagnosis.equivalent = vec![group];
    }
}

fn causes(explanation: &Explanation<'_>, confidence: f64) -> Vec<EstimatedCause> {
    let covariance = explanation.fit.covariance();
    let space = &explanation.space;
    space
        .candidates
        .iter()
        .enumerate()
        .flat_map(|(number, candidate)| {
            let places = space.places_of(number);
            let own = covariance
                .as_ref()
                .map(|covariance| covariance.select_rows(&places).select_columns(&places));
            let z: Vec<f64> = places.iter().map(|place| explanation.fit.z[*place]).collect();
            let each = candidate.by_channel().into_iter();
            each.map(|candidate| cause(&candidate, number, &z, own.as_ref(), confidence))
                .collect::<Vec<_>>()
        })
        .collect()
}

fn cause(
    candidate: &Candidate,
    choice: usize,
    z: &[f64],
    covariance: Option<&DMatrix<f64>>,
    confidence: f64,
) -> EstimatedCause {
    let parameters = figures(candidate, z, covariance);
    EstimatedCause {
        name: candidate.effect.name(),
        confidence,
        direction: candidate.location.direction().map(|direction| direction.name()),
        directions: match candidate.location {
            Location::Axes(a, b) => Some([direction_of(a).name(), direction_of(b).name()]),
            _ => None,
        },
        channel: candidate.location.channel().map(String::from),
        parameters,
        extension: candidate.table(z).unwrap_or_default(),
        choice,
        moved: covariance.map_or_else(Vec::new, |covariance| moved(candidate, z, covariance)),
    }
}

/// Parameters with their 90 % intervals, to first order in the coordinates.
fn figures(
    candidate: &Candidate,
    z: &[f64],
    covariance: Option<&DMatrix<f64>>,
) -> BTreeMap<&'static str, Figure> {
    let center = candidate.parameters(z);
    let gradient = |parameter: usize, coordinate: usize| {
        let step = 1e-4;
        let at = |step: f64| {
            let mut moved = z.to_vec();
            moved[coordinate] += step;
            candidate.parameters(&moved)[parameter].1
        };
        (at(step) - at(-step)) / (2.0 * step)
    };
    let figure = |(index, (key, value)): (usize, &(&'static str, f64))| {
        let slopes: Vec<f64> = (0..z.len())
            .map(|coordinate| gradient(index, coordinate))
            .collect();
        let variance = covariance.map_or(0.0, |covariance| {
            let slopes = nalgebra::DVector::from_column_slice(&slopes);
            slopes.dot(&(covariance * &slopes))
        });
        let half = NINETY_PERCENT * variance.max(0.0).sqrt();
        (
            *key,
            Figure {
                value: *value,
                ci90: [value - half, value + half],
            },
        )
    };
    center.iter().enumerate().map(figure).collect()
}

/// The table of the effect at both ends of the 90 % interval along each principal direction of its coordinates.
fn moved(candidate: &Candidate, z: &[f64], covariance: &DMatrix<f64>) -> Vec<[toml::Table; 2]> {
    let Ok(principal) = of_symmetric(covariance.clone()) else {
        return Vec::new();
    };
    let along = |direction: usize, sign: f64| {
        let size = sign * NINETY_PERCENT * principal.eigenvalues[direction].max(0.0).sqrt();
        let moved: Vec<f64> = z
            .iter()
            .zip(principal.eigenvectors.column(direction).iter())
            .zip(&candidate.coordinates)
            .map(|((z, along), coordinate)| (z + size * along).max(coordinate.lower))
            .collect();
        candidate
            .table(&moved)
            .or_else(|| candidate.table(z))
            .unwrap_or_default()
    };
    (0..z.len())
        .map(|direction| [along(direction, -1.0), along(direction, 1.0)])
        .collect()
}
