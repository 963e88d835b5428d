//! `--method linearity`: tests of the linearity of a structure.

use std::path::PathBuf;

use super::Error;
use super::answer::{IdentifyOutput, Linearity, SweepPair, TonesLinearity};
use super::args::Args;
use super::force_and_motion::force_and_motion;
use super::methods::settling;
use crate::identify::dwell::Dwell;
use crate::identify::homogeneity::regions;
use crate::identify::linearity::verdict;
use crate::identify::reciprocity;
use crate::identify::steady::{steady, windows};
use crate::identify::sweep::{Spectra, compare};
use crate::recording::{Quantity, Recording, TestKind};
use crate::structure::Direction;

/// Tests a structure for linearity from steady sine responses (force levels, harmonics, reciprocity) and from sines
/// with increasing force (homogeneity), and compares pairs of sine sweeps.
pub(super) fn linearity(args: &Args, recordings: &[Recording]) -> Result<IdentifyOutput, Error> {
    let harmonics = usize::from(args.harmonics).max(3);
    let of_kind = |kind| {
        recordings
            .iter()
            .filter(move |recording| recording.sidecar.kind == Some(kind))
    };
    let steps: Vec<Recording> = recordings
        .iter()
        .filter(|recording| !matches!(recording.sidecar.kind, Some(TestKind::Shaker | TestKind::Sweep)))
        .cloned()
        .collect();
    let taken = steady(&steps, harmonics, settling(args));
    let rising: Vec<Dwell> = of_kind(TestKind::Shaker)
        .flat_map(|tone| windows(tone, harmonics, PERIODS))
        .collect();
    let sweeps: Vec<&Recording> = of_kind(TestKind::Sweep).collect();
    let (pairs, mut refused) = compare_sweeps(&sweeps)?;
    let mut found = Linearity {
        sweeps: pairs,
        ..Linearity::default()
    };
    for direction in Direction::ALL {
        let driven = |dwell: &&Dwell| dwell.force().is_some_and(|force| force.direction == direction);
        let tones: Vec<Dwell> = taken
            .dwells
            .iter()
            .chain(&rising)
            .filter(driven)
            .cloned()
            .collect();
        if tones.is_empty() {
            continue;
        }
        match verdict(&tones) {
            Ok(verdict) => {
                let points: Vec<(f64, f64)> = rising.iter().filter(driven).filter_map(response).collect();
                let (regions, jumps_n) = if points.is_empty() {
                    (Vec::new(), Vec::new())
                } else {
                    regions(&points)
                };
                found.tones.push(TonesLinearity {
                    direction: direction.name(),
                    verdict,
                    regions,
                    jumps_n,
                });
            }
            Err(error) => refused.push(format!("force along {direction}: {error}")),
        }
    }
    for (index, i) in Direction::ALL.into_iter().enumerate() {
        for j in Direction::ALL.into_iter().skip(index + 1) {
            found
                .reciprocity
                .extend(reciprocity::compare(&taken.dwells, [i, j]));
        }
    }
    if found.tones.is_empty() && found.sweeps.is_empty() && found.reciprocity.is_empty() {
        return Err(Error::input(if refused.is_empty() {
            "no steady tones, and no two sweeps with a common band, were found".into()
        } else {
            refused.join("; ")
        }));
    }
    found.linear = found.tones.iter().all(|tones| tones.verdict.linear)
        && found.sweeps.iter().all(|sweeps| sweeps.comparison.same)
        && found.reciprocity.iter().all(|pair| pair.reciprocal);
    Ok(IdentifyOutput {
        dwells: Some(taken.dwells.len() + rising.len()),
        warnings: taken.warnings.into_iter().chain(refused).collect(),
        messages: sentences(&found),
        linearity: Some(found),
        ..IdentifyOutput::of("linearity", Vec::new(), Vec::new())
    })
}

/// Length of the analysis windows on a sine of constant frequency and increasing force, in periods of the sine: a
/// choice.
const PERIODS: f64 = 10.0;

fn response(dwell: &Dwell) -> Option<(f64, f64)> {
    let force = dwell.force()?;
    let motion = dwell
        .motions
        .iter()
        .find(|line| line.direction == force.direction)?;
    Some((force.amplitude(1), motion.amplitude(1)))
}

/// Compares every later sine sweep with the first sweep of the same force direction and motion quantity. The returned
/// texts name the pairs of sweeps that cannot be compared.
fn compare_sweeps(sweeps: &[&Recording]) -> Result<(Vec<SweepPair>, Vec<String>), Error> {
    let mut known: Vec<((Direction, Quantity), PathBuf, Spectra)> = Vec::new();
    let (mut found, mut refused) = (Vec::new(), Vec::new());
    for sweep in sweeps {
        let record = force_and_motion(sweep)?;
        let spectra = Spectra::new(&record.force, record.motion, sweep.sample_rate_hz);
        let place = (record.direction, record.quantity);
        match known.iter().find(|(other, ..)| *other == place) {
            Some((_, path, first)) => match compare(first, &spectra) {
                Some(comparison) => found.push(SweepPair {
                    recordings: [path.clone(), sweep.path.clone()],
                    comparison,
                }),
                None => refused.push(format!(
                    "sweeps {} and {}: their common band is too narrow to compare them",
                    path.display(),
                    sweep.path.display()
                )),
            },
            None => known.push((place, sweep.path.clone(), spectra)),
        }
    }
    Ok((found, refused))
}

fn sentences(found: &Linearity) -> Vec<String> {
    let mut messages = Vec::new();
    for TonesLinearity {
        direction,
        verdict,
        regions,
        jumps_n,
    } in &found.tones
    {
        messages.push(if verdict.linear {
            format!("{direction}: linear, the response is proportional to the force at every level")
        } else {
            let kinds: Vec<&str> = verdict.kinds.iter().map(|kind| kind.name()).collect();
            let kinds = if kinds.is_empty() {
                "of unknown kind".into()
            } else {
                kinds.join(" and ")
            };
            let change = 100.0 * verdict.level_dependence;
            format!("{direction}: not linear: {kinds}; F/X changes by up to {change:.1} % with the level")
        });
        if regions.len() > 1 {
            messages.push(format!(
                "{direction}: the response rises in {} regions, with {} jumps",
                regions.len(),
                jumps_n.len()
            ));
        }
    }
    for SweepPair {
        recordings,
        comparison,
    } in &found.sweeps
    {
        let verdict = if comparison.same {
            "agree"
        } else {
            "differ: not linear"
        };
        messages.push(format!(
            "sweeps {} and {} {verdict}, by up to {:.2} % of the peak",
            recordings[0].display(),
            recordings[1].display(),
            100.0 * comparison.largest_change
        ));
    }
    for pair in &found.reciprocity {
        let [i, j] = pair.directions;
        let verdict = if pair.reciprocal { "agree" } else { "differ" };
        messages.push(format!(
            "H_{i}{j} and H_{j}{i} {verdict}, by up to {:.2} % of the larger",
            100.0 * pair.largest_change
        ));
    }
    messages
}
