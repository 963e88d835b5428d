//! Long records of random forces, of blows and of cuts: their beginnings are searched, and what is found there is held against the rest.
//!
//! A search computes its records hundreds of times, and a random excitation, some blows or a cut at one speed tell in their first
//! seconds what they tell in a minute; what changes over the minute does not show there. So the answer holds only if it leaves as little of
//! the rest as of the beginnings; and what it gains is told of the rest alone, which nothing was fitted to.

use crate::baseline::Baseline;
use crate::conclusion::answer::{Diagnosis, Gain, Outcome, Quality};
use crate::conclusion::conclude;
use crate::criteria::{NOISE_TOLERANCE, UNEXPLAINED_OF_RESPONSE, WORTH_SHORTENING};
use crate::fit::regression::{Regression, Subset};
use crate::progress::{Options, Stage};
use crate::records::study::Study;
use quietcut_model::case::Case;
use quietcut_recording::{Kind, Recording};

/// Samples of all records together that are searched.
const SEARCHED: usize = 32_768;
/// Periods of the slowest mode that the beginning of each record must hold.
const PERIODS: f64 = 60.0;
/// Turns of the spindle that the beginning of a cut must hold.
const TURNS: f64 = 24.0;

/// The beginnings of records, all of them of random forces, of blows or of cuts at one speed, and what comes after them; `None` where they are
/// too short to be shortened.
fn beginnings(case: &Case, recordings: &[Recording]) -> Option<[Vec<Recording>; 2]> {
    let lowest_hz = Baseline::new(case).ok()?.lowest_hz()?;
    let all: usize = recordings.iter().map(Recording::len).sum();
    let (shortened, rest): (Vec<Recording>, Vec<Recording>) = recordings
        .iter()
        .map(|recording| {
            let turns_s = turns_s(recording)?;
            let samples = |seconds: f64| (seconds * recording.sample_rate_hz).ceil() as usize;
            // What a cut left from its entry on is past after as many turns.
            let from = samples(turns_s);
            let least = samples((PERIODS / lowest_hz).max(turns_s));
            let count = (SEARCHED / recordings.len()).max(least);
            let to = (from + count).min(recording.len());
            let from = to.saturating_sub(count);
            Some((recording.part(from..to), recording.part(to..recording.len())))
        })
        .collect::<Option<_>>()?;
    let left: usize = shortened.iter().map(Recording::len).sum();
    ((left as f64) < WORTH_SHORTENING * all as f64).then_some([shortened, rest])
}

/// How long the turns take that the beginning of a record must hold: none of a shaker or a hammer; `None` of what is not shortened.
fn turns_s(recording: &Recording) -> Option<f64> {
    match (recording.sidecar.kind, &recording.sidecar.cut) {
        (Some(Kind::Shaker | Kind::Hammer), _) => Some(0.0),
        (Some(Kind::Cutting), Some(cut)) if cut.last_rpm.is_none() => Some(60.0 * TURNS / cut.spindle_rpm?),
        _ => None,
    }
}

/// What the beginnings of the records tell, where that holds for all of them; `None` where it does not, or where they are short.
pub(crate) fn concluded(
    case: &Case,
    recordings: &[Recording],
    options: &Options,
    watch: &dyn Fn(Stage),
) -> Option<Diagnosis> {
    let [beginnings, rest] = beginnings(case, recordings)?;
    let study = Study::new(case, &beginnings).ok()?;
    let mut diagnosis = conclude::conclude(&study, &beginnings, options, watch);
    drop(study);
    watch(Stage::Records);
    let believed = Residual::of(case, &rest)?;
    let searched_s = beginnings
        .iter()
        .map(|record| record.len() as f64 / record.sample_rate_hz);
    diagnosis.warnings.push(format!(
        "causes were sought in {:.1} s near the start of each record, and what was found was held against the rest",
        searched_s.fold(0.0, f64::max)
    ));
    let extended = match diagnosis.outcome {
        // More of the same explains nothing.
        Outcome::Unexplained => return Some(diagnosis),
        Outcome::None => case.clone(),
        _ => diagnosis.extended(case)?,
    };
    let explained = Residual::of(&extended, &rest)?;
    let beyond = explained.energy - explained.count;
    if beyond > NOISE_TOLERANCE * explained.count
        && beyond > UNEXPLAINED_OF_RESPONSE * (believed.energy - believed.count)
    {
        return None;
    }
    // Nothing was fitted to any of the rest.
    let quality = |missed: f64| Quality {
        nrmse_heldout: missed,
        nrmse_whole: missed,
    };
    diagnosis.baseline = quality(believed.missed);
    if diagnosis.outcome != Outcome::None {
        diagnosis.extended = Some(quality(explained.missed));
        diagnosis.gain = Some(Gain::new(believed.energy, explained.energy, explained.count));
    }
    Some(diagnosis)
}

/// What a case leaves of records.
struct Residual {
    /// In units of the noise.
    energy: f64,
    /// Numbers that were compared.
    count: f64,
    /// Residual over signal.
    missed: f64,
}

impl Residual {
    fn of(case: &Case, recordings: &[Recording]) -> Option<Self> {
        let study = Study::new(case, recordings).ok()?;
        let regression = Regression::new(&study);
        Some(Self {
            energy: regression.residual(Subset::Whole),
            count: regression.count(Subset::Whole) as f64,
            missed: regression.missed(&study, Subset::Whole),
        })
    }
}
