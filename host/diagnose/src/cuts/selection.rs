//! Which further effects explain the orders of cuts.

use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::candidate::Candidate;
use super::candidates;
use super::fit::{Fit, REACH, Start, fit};
use super::record::ReducedCut;
use super::space::Space;
use crate::baseline::Baseline;
use quietcut_model::effects::{Class, EffectName};

/// Number of candidates that are fitted, of those that the baseline's derivatives rank first.
const FITTED: usize = 8;
/// Number of starts of a candidate that are compared with the records, of those that the derivatives rank first.
const COMPARED: usize = 4;
/// Difference in the logarithm of the probability from the first candidate from which on no fit need be exact: it does
/// not change an answer.
const OUT_OF_REACH: f64 = 30.0;
/// Largest number of effects.
const EFFECTS: usize = 3;
/// Least gain of a further effect in the logarithm of its probability: odds of 100, so that one of 100 sets of
/// records in which nothing is hidden shows an effect, and of 20 000 where what is known explains the records within
/// their noise already.
const LEAST_GAIN: f64 = 4.6;
const LEAST_GAIN_BEYOND_NOISE: f64 = 10.0;

/// A set of effects, fitted.
pub(crate) struct Explanation<'a> {
    pub space: Space<'a>,
    pub fit: Fit,
    /// Logarithm of the marginal likelihood and the probability of the set before the records are seen.
    pub evidence: f64,
}

/// The explanations of a study.
pub(crate) struct Explanations<'a> {
    /// The baseline as its case has it; `None` if the case states no uncertainty.
    pub written: Option<Explanation<'a>>,
    /// The baseline within its uncertainty.
    pub baseline: Explanation<'a>,
    /// The sets of the last number of effects that gained, by descending evidence.
    pub ranked: Vec<Explanation<'a>>,
}

/// Explains the records by ever larger sets of effects, as long as a further one gains.
pub(crate) fn explain<'a>(baseline: &'a Baseline<'a>, records: &[ReducedCut]) -> Option<Explanations<'a>> {
    let space = Space::new(baseline, records);
    let fitted = from_zero(&space, records)?;
    let all = candidates::all(baseline, records, &fitted);
    let written = baseline
        .case
        .is_uncertain()
        .then(|| as_written(baseline, records))
        .flatten();
    let mut first = Explanations {
        written,
        baseline: Explanation {
            evidence: fitted.evidence(),
            space,
            fit: fitted,
        },
        ranked: Vec::new(),
    };
    for _ in 0..EFFECTS {
        let best = first.ranked.first().unwrap_or(&first.baseline);
        let next = extended(best, &all, records);
        let gained = next
            .first()
            .map_or(f64::NEG_INFINITY, |next| next.evidence - best.evidence);
        let is_further = !best.space.candidates.is_empty() && best.fit.is_enough();
        if gained
            < if is_further {
                LEAST_GAIN_BEYOND_NOISE
            } else {
                LEAST_GAIN
            }
        {
            break;
        }
        first.ranked = next;
    }
    while let Some(fewer) = first.ranked.first().and_then(|best| reduced(best, &all, records)) {
        first.ranked = vec![fewer];
    }
    Some(first)
}

/// The baseline with the parameters that its case has; with those within their assumed uncertainty if the case states none.
pub(crate) fn as_written<'a>(baseline: &'a Baseline<'a>, records: &[ReducedCut]) -> Option<Explanation<'a>> {
    let space = Space::new(baseline, records);
    let space = match baseline.case.is_uncertain() {
        true => space.as_written(),
        false => space,
    };
    let fit = from_zero(&space, records)?;
    Some(Explanation {
        evidence: fit.evidence(),
        space,
        fit,
    })
}

/// The fit of a space from the baseline as it is; `None` if that has no orbit.
fn from_zero(space: &Space<'_>, records: &[ReducedCut]) -> Option<Fit> {
    let start = Start::new(space, records, vec![0.0; space.variables.len()], None)?;
    Some(fit(space, records, start, None, f64::INFINITY))
}

/// The best set without one of its effects, if that effect does not gain beside the others: a later effect may have taken
/// its place.
fn reduced<'a>(best: &Explanation<'a>, all: &[Candidate], records: &[ReducedCut]) -> Option<Explanation<'a>> {
    if best.space.candidates.len() < 2 {
        return None;
    }
    let prior = priors(all);
    let without = |number: usize| {
        let (space, start) = best.space.without(number, &best.fit.z);
        let start = Start::new(&space, records, start, Some(&best.fit))?;
        let fitted = fit(&space, records, start, Some(&best.fit), f64::INFINITY);
        let known: f64 = space
            .candidates
            .iter()
            .filter_map(|candidate| {
                let place = all.iter().position(|other| is_same(other, candidate))?;
                Some(prior[place])
            })
            .sum();
        Some(Explanation {
            evidence: known + fitted.evidence(),
            space,
            fit: fitted,
        })
    };
    (0..best.space.candidates.len())
        .filter_map(without)
        .max_by(|a, b| a.evidence.total_cmp(&b.evidence))
        .filter(|fewer| fewer.evidence > best.evidence - LEAST_GAIN)
}

/// Sets with one more effect than `best`, by descending evidence.
///
/// All candidates are scored from the derivatives of `best`, and the first few are fitted.
fn extended<'a>(best: &Explanation<'a>, all: &[Candidate], records: &[ReducedCut]) -> Vec<Explanation<'a>> {
    let prior = priors(all);
    let Some(case) = best.space.case(&best.fit.z) else {
        return Vec::new();
    };
    let starts = all
        .par_iter()
        .enumerate()
        .filter(|(_, candidate)| {
            !best
                .space
                .candidates
                .iter()
                .any(|known| is_same(known, candidate) || share_a_term(known, candidate))
        })
        .flat_map_iter(|(index, candidate)| {
            candidate
                .starts(&case)
                .into_iter()
                .map(move |start| (index, start))
        });
    let mut scored: Vec<Scored> = starts
        .filter_map(|(index, start)| {
            let (gain, end) = score(best, &all[index], &start, records)?;
            let gain = gain + prior[index];
            (gain > 0.0).then_some(Scored {
                index,
                gain,
                at: start,
                start: end,
            })
        })
        .collect();
    scored.sort_by(|a, b| b.gain.total_cmp(&a.gain).then(a.index.cmp(&b.index)));
    let mut ranked: Vec<Vec<Scored>> = Vec::new();
    for scored in scored {
        match ranked.iter_mut().find(|known| known[0].index == scored.index) {
            Some(known) => known.push(scored),
            None => ranked.push(vec![scored]),
        }
    }
    for (place, scored) in ranked.iter().enumerate() {
        let candidate = &all[scored[0].index];
        let Scored { gain, start, .. } = &scored[0];
        tracing::debug!(
            place,
            gain,
            ?start,
            "ranked: {} {}",
            candidate.effect.name(),
            candidate.location
        );
    }
    ranked.truncate(FITTED);
    let fitted = |starts: Vec<Scored>, useful: f64| {
        let index = starts[0].index;
        let candidate = &all[index];
        let space = best.space.with(candidate);
        // The first of the ranking is fitted from two starts.
        let count = if useful.is_finite() { 1 } else { 2 };
        let found = nearest_starts(best, &space, records, starts, count)
            .into_iter()
            .map(|start| fit(&space, records, start, Some(&best.fit), useful))
            .max_by(|a, b| a.evidence().total_cmp(&b.evidence()));
        tracing::debug!(
            gain = found.as_ref().map(|found| found.evidence() - best.fit.evidence() + prior[index]),
            left = found.as_ref().map(|found| found.left / found.residual.len() as f64),
            z = ?found.as_ref().map(|found| &found.z[best.fit.z.len()..]),
            "fitted: {} {}",
            candidate.effect.name(),
            candidate.location
        );
        let found = found?;
        Some(Explanation {
            evidence: prior_of(best) + found.evidence() + prior[index],
            space,
            fit: found,
        })
    };
    // The first of the ranking tells which of the others are worth an exact fit; where nothing ranks a candidate, so does
    // the next.
    let is_ranked = |starts: &Vec<Scored>| starts[0].gain.is_finite();
    let first = ranked
        .iter()
        .position(is_ranked)
        .map_or(ranked.len(), |first| first + 1);
    let others = ranked.split_off(first);
    let mut found: Vec<Explanation<'a>> = ranked
        .into_par_iter()
        .filter_map(|starts| fitted(starts, f64::INFINITY))
        .collect();
    let least = found
        .iter()
        .map(|set| set.fit.cost())
        .fold(f64::INFINITY, f64::min);
    let useful = least + 2.0 * OUT_OF_REACH;
    found.par_extend(others.into_par_iter().filter_map(|starts| fitted(starts, useful)));
    found.retain(|set| !hides_softening_hardening(set));
    found.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    found
}

/// Of the starts of a candidate those from which its fits begin, at most `count`: where the derivatives do not tell which
/// shape is best, the records are compared with the first [`COMPARED`] of their ranking.
fn nearest_starts(
    best: &Explanation<'_>,
    space: &Space<'_>,
    records: &[ReducedCut],
    mut starts: Vec<Scored>,
    count: usize,
) -> Vec<Start> {
    starts.truncate(COMPARED);
    let mut compared: Vec<(f64, Start)> = starts
        .par_iter()
        .filter_map(|scored| nearest_start(best, space, records, scored))
        .collect();
    compared.sort_by(|a, b| a.0.total_cmp(&b.0));
    compared.truncate(count);
    compared.into_iter().map(|(_, start)| start).collect()
}

/// The start of a fit, with its sum of squares. Where derivatives reach too far, the records agree less than without the
/// effect, or there is no orbit near that of `best`: the start is then nearer.
fn nearest_start(
    best: &Explanation<'_>,
    space: &Space<'_>,
    records: &[ReducedCut],
    scored: &Scored,
) -> Option<(f64, Start)> {
    let at = |halvings: i32| -> Vec<f64> {
        let share = 0.5_f64.powi(halvings);
        let near = scored.at.iter().zip(&scored.start);
        let start = near.map(|(at, start)| at + share * (start - at));
        best.fit.z.iter().copied().chain(start).collect()
    };
    let mut nearest: Option<(f64, Start)> = None;
    for z in (0..NEARER_STARTS).map(at) {
        let Some(start) = Start::new(space, records, z, Some(&best.fit)) else {
            continue;
        };
        let cost = start.cost();
        if nearest.as_ref().is_none_or(|(least, _)| cost < *least) {
            nearest = Some((cost, start));
        }
        if cost < best.fit.cost() {
            break;
        }
    }
    nearest
}

/// A candidate with the gain in evidence that the derivatives predict, and the coordinates where its fit begins.
struct Scored {
    index: usize,
    gain: f64,
    /// Coordinates at which the derivatives are taken.
    at: Vec<f64>,
    start: Vec<f64>,
}

/// What the effects of an explanation cost before the records are seen.
fn prior_of(best: &Explanation<'_>) -> f64 {
    best.evidence - best.fit.evidence()
}

/// True if two candidates are the same effect at the same place.
fn is_same(one: &Candidate, other: &Candidate) -> bool {
    one.effect == other.effect && one.location == other.location
}

/// True if two restoring forces at one place share a term of the equation, as softening-hardening and a cubic spring.
fn share_a_term(one: &Candidate, other: &Candidate) -> bool {
    let spec = one.effect.spec();
    let is_force = matches!(spec.class, Class::RestoringForce(_));
    is_force && spec.shares_term_with.contains(&other.effect) && one.location == other.location
}

/// True if a set has a cubic and a quintic spring with k3 < 0 < k5 at one place: softening-hardening.
fn hides_softening_hardening(set: &Explanation<'_>) -> bool {
    let found = |effect: EffectName, sign: f64| {
        let all = set.space.candidates.iter().enumerate();
        all.filter(move |(number, candidate)| {
            let parameters = || candidate.parameters(&set.space.coordinates(*number, &set.fit.z));
            candidate.effect == effect && parameters().iter().all(|(_, value)| sign * value > 0.0)
        })
    };
    found(EffectName::CubicStiffness, -1.0).any(|(_, cubic)| {
        found(EffectName::QuinticStiffness, 1.0).any(|(_, quintic)| cubic.location == quintic.location)
    })
}

/// Logarithm of the probability of each candidate before the records are seen: equal for all names, divided over the
/// forms and places of a name.
fn priors(all: &[Candidate]) -> Vec<f64> {
    let mut names: Vec<&str> = all.iter().map(|candidate| candidate.effect.name()).collect();
    names.sort_unstable();
    names.dedup();
    let of = |candidate: &Candidate| {
        let places = all
            .iter()
            .filter(|other| other.effect == candidate.effect)
            .count();
        -((names.len() * places) as f64).ln()
    };
    all.iter().map(of).collect()
}

/// Gain in evidence of a candidate to first order, and its coordinates; `None` if it has no derivative.
fn score(
    best: &Explanation<'_>,
    candidate: &Candidate,
    start: &[f64],
    records: &[ReducedCut],
) -> Option<(f64, Vec<f64>)> {
    let columns = best.fit.columns_of(&best.space, candidate, start, records)?;
    if start.is_empty() {
        // Present or absent: only its fit can tell.
        return Some((f64::INFINITY, Vec::new()));
    }
    let factor = Cholesky::new(best.fit.information.clone())?;
    // Of the residual r and the columns c, what the variables of the known explanation cannot take up.
    let mixed = best.fit.jacobian.tr_mul(&columns);
    let gradient = columns.tr_mul(&best.fit.residual)
        - mixed.tr_mul(&factor.solve(&(best.fit.jacobian.tr_mul(&best.fit.residual) - position(best))));
    let start_z = DVector::from_column_slice(start);
    // What the records do not move stays at its start: the shape of an effect that is faint.
    let gradient = DVector::from_iterator(
        start.len(),
        (0..start.len()).map(|index| {
            if columns.column(index).amax() == 0.0 {
                0.0
            } else {
                gradient[index] - start_z[index]
            }
        }),
    );
    let own = columns.tr_mul(&columns) - mixed.tr_mul(&factor.solve(&mixed));
    let information: DMatrix<f64> = own + DMatrix::identity(start.len(), start.len());
    let own_factor = Cholesky::new(information)?;
    let change = own_factor.solve(&gradient);
    let determinant: f64 = own_factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
    let z: Vec<f64> = start
        .iter()
        .zip(change.iter())
        .zip(&candidate.coordinates)
        .map(|((start, change), coordinate)| (start + change).clamp(coordinate.lower.max(-REACH), REACH))
        .collect();
    // A coordinate that the records do not move may lie on its bound.
    let inside = z
        .iter()
        .zip(change.iter())
        .zip(&candidate.coordinates)
        .all(|((z, change), coordinate)| *z > coordinate.lower || *change == 0.0);
    let gain = 0.5 * (gradient.dot(&change) - start_z.norm_squared()) - determinant;
    let z = if inside {
        z
    } else {
        start.iter().map(|z| z.max(1e-2)).collect()
    };
    Some((if inside { gain } else { gain.min(0.0) - determinant }, z))
}

/// Number of starts of a fit, each half as far from where derivatives are taken as that before.
const NEARER_STARTS: i32 = 6;

fn position(best: &Explanation<'_>) -> DVector<f64> {
    DVector::from_column_slice(&best.fit.z)
}
