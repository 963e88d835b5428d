//! The experiment that separates confounded candidate models.
//!
//! Every equivalent candidate model is simulated in all experiments ([`experiment`]). The readings of two models are
//! compared in units of the noise, after the parameters of one are fitted to the readings of the other
//! ([`separation`]). The proposal is the experiment with the least effort (that of additional sensors included) that
//! separates all models from each other or, if there is none, the one in which the smallest distance between two models
//! is largest. The distance follows A. C. Atkinson and V. V. Fedorov, The design of experiments for discriminating
//! between two rival models, Biometrika 62 (1975), T-optimality.

mod bench;
mod experiment;
mod reading;
mod separation;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use self::bench::Bench;
use self::experiment::{Experiment, experiments};
use self::reading::Sensors;
use self::separation::{Difference, Rival};
use crate::conclusion::answer::{Diagnosis, NextTest, label};
use crate::criteria::SEPARATING_DISTANCE;
use quietcut_model::case::Case;
use quietcut_recording::Recording;

/// An experiment with a set of sensors, and the distance between the candidate models that it separates least.
struct Proposal<'a> {
    experiment: &'a Experiment,
    sensors: Sensors,
    /// Distance between the two candidate models that the experiment separates least; `between` holds the indices of
    /// these two models.
    least: Difference,
    between: [usize; 2],
}

/// The experiment that separates the candidate models of `diagnosis`, or comes nearest to it; `None` if there are fewer
/// than two.
///
/// # Errors
/// The machine has no oscillating mode or its records no motion, or no experiment can be simulated with all candidate
/// models; the error is a sentence.
pub(super) fn next_test(
    case: &Case,
    recordings: &[Recording],
    diagnosis: &Diagnosis,
) -> Result<Option<NextTest>, String> {
    let explanations = &diagnosis.explanations;
    if explanations.len() < 2 {
        return Ok(None);
    }
    let bench = Bench::new(case, recordings, &diagnosis.views)?;
    let experiments = experiments(&bench);
    let rivals: Vec<Rival<'_>> = explanations.iter().map(|causes| Rival { causes }).collect();
    let by_experiment: Vec<Result<Vec<Proposal<'_>>, String>> = experiments
        .par_iter()
        .map(|experiment| proposals(&bench, experiment, &rivals))
        .collect();
    let reason = by_experiment
        .iter()
        .find_map(|proposals| proposals.as_ref().err().cloned());
    let proposals: Vec<Proposal<'_>> = by_experiment.into_iter().flatten().flatten().collect();
    let separates = |proposal: &&Proposal<'_>| proposal.least.squared >= SEPARATING_DISTANCE;
    let best = proposals
        .iter()
        .filter(separates)
        .min_by(|a, b| {
            let by_effort = a.effort().total_cmp(&b.effort());
            by_effort.then(b.least.squared.total_cmp(&a.least.squared))
        })
        .or_else(|| {
            proposals
                .iter()
                .max_by(|a, b| a.least.squared.total_cmp(&b.least.squared))
        });
    let Some(best) = best else {
        return Err(reason.unwrap_or_else(|| "there is no experiment for this machine".into()));
    };
    let [one, other] = best.between.map(|index| label(&explanations[index]));
    let mut why = best.why(&one, &other);
    if case.limits.is_none() && best.experiment.changes_speed(&bench) {
        why.push_str("; the case has no section [limits], and the spindle is assumed to reach this speed");
    }
    Ok(Some(best.experiment.described(
        best.sensors,
        best.least.squared.sqrt(),
        why,
    )))
}

/// Proposals of one experiment, one for each set of sensors.
///
/// # Errors
/// A candidate model cannot be simulated in the experiment; the error is a sentence.
fn proposals<'a>(
    bench: &Bench<'_>,
    experiment: &'a Experiment,
    rivals: &[Rival<'_>],
) -> Result<Vec<Proposal<'a>>, String> {
    let readings: Vec<_> = rivals
        .iter()
        .map(|rival| rival.simulated(bench, experiment))
        .collect::<Result<_, _>>()?;
    let pairs = (0..rivals.len()).flat_map(|one| (one + 1..rivals.len()).map(move |other| [one, other]));
    let pairs: Vec<[usize; 2]> = pairs.collect();
    let of_sensors = experiment.sensors().into_iter().filter_map(|sensors| {
        let (between, least) = pairs
            .iter()
            .map(|pair| {
                let [one, other] = pair.map(|index| &readings[index]);
                (*pair, separation::between(bench, one, other, sensors))
            })
            .min_by(|a, b| a.1.squared.total_cmp(&b.1.squared))?;
        Some(Proposal {
            experiment,
            sensors,
            least,
            between,
        })
    });
    Ok(of_sensors.collect())
}

impl Proposal<'_> {
    fn effort(&self) -> f64 {
        self.experiment.effort + self.sensors.effort()
    }

    fn why(&self, one: &str, other: &str) -> String {
        let Difference {
            squared,
            channel,
            times_noise,
        } = &self.least;
        let distance = squared.sqrt();
        if *squared >= SEPARATING_DISTANCE {
            format!(
                "separates {one} from {other}: {channel} would differ by {times_noise:.2} times its noise for any of their parameters; over the record this is a distance of {distance:.0} standard deviations"
            )
        } else {
            format!(
                "no available test separates {one} from {other} reliably; this one comes nearest, with a distance of {distance:.1} standard deviations of the required {:.1}",
                SEPARATING_DISTANCE.sqrt()
            )
        }
    }
}
