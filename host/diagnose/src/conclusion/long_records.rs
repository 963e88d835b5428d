//! Long records of random forces, impacts and cuts: the search uses their beginnings, and the rest validates the result.
//!
//! A search predicts its records hundreds of times. The first seconds of a random excitation, of impacts or of a cut at one speed carry
//! nearly the information of a minute, except on changes over the minute. So the answer counts only if its residual is as small on the rest
//! as on the beginnings. The gain is stated for the rest alone, to which nothing was fitted.

use crate::baseline::Baseline;
use crate::conclusion::answer::{Diagnosis, Gain, Outcome, Quality};
use crate::conclusion::conclude;
use crate::criteria::{NOISE_TOLERANCE, UNEXPLAINED_OF_RESPONSE, WORTH_SHORTENING};
use crate::fit::regression::{Regression, Subset};
use crate::progress::{Options, Stage};
use crate::records::study::Study;
use quietcut_model::case::Case;
use quietcut_recording::{Recording, TestKind};

/// Number of samples of all records together that are searched.
const SEARCHED: usize = 32_768;
/// Least number of periods of the slowest mode in the beginning of each record.
const PERIODS: f64 = 60.0;
/// Least number of revolutions in the beginning of a cut.
const TURNS: f64 = 24.0;

/// The beginnings of the records and the rest of each, if all are of random forces, of impacts or of cuts at one speed; `None` if they are
/// too short.
fn beginnings(case: &Case, recordings: &[Recording]) -> Option<[Vec<Recording>; 2]> {
    let lowest_hz = Baseline::new(case).ok()?.lowest_hz()?;
    let all: usize = recordings.iter().map(Recording::len).sum();
    let (shortened, rest): (Vec<Recording>, Vec<Recording>) = recordings
        .iter()
        .map(|recording| {
            let turns_s = turns_s(recording)?;
            let samples = |seconds: f64| (seconds * recording.sample_rate_hz).ceil() as usize;
            // After this many revolutions, the transient of the entry has decayed.
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

/// Least duration of the beginning of a cut, s; zero for shaker and hammer; `None` for tests that are not shortened.
fn turns_s(recording: &Recording) -> Option<f64> {
    match (recording.sidecar.kind, &recording.sidecar.cut) {
        (Some(TestKind::Shaker | TestKind::Hammer), _) => Some(0.0),
        (Some(TestKind::Cutting), Some(cut)) if cut.last_rpm.is_none() => {
            Some(60.0 * TURNS / cut.spindle_rpm?)
        }
        _ => None,
    }
}

/// The answer from the beginnings of the records, if it holds for all of them; `None` if not, or if the records are short.
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
    let baseline = Residual::of(case, &rest)?;
    let searched_s = beginnings
        .iter()
        .map(|record| record.len() as f64 / record.sample_rate_hz);
    diagnosis.warnings.push(format!(
        "causes were searched in {:.1} s near the start of each record, and validated on the rest",
        searched_s.fold(0.0, f64::max)
    ));
    let extended = match diagnosis.outcome {
        // Further samples cannot explain it.
        Outcome::Unexplained => return Some(diagnosis),
        Outcome::None => case.clone(),
        _ => diagnosis.extended(case)?,
    };
    let extended_residual = Residual::of(&extended, &rest)?;
    let beyond = extended_residual.energy - extended_residual.count;
    if beyond > NOISE_TOLERANCE * extended_residual.count
        && beyond > UNEXPLAINED_OF_RESPONSE * (baseline.energy - baseline.count)
    {
        return None;
    }
    // Nothing was fitted to the rest.
    let quality = |nrmse: f64| Quality {
        nrmse_heldout: nrmse,
        nrmse_whole: nrmse,
    };
    diagnosis.baseline = quality(baseline.nrmse);
    if diagnosis.outcome != Outcome::None {
        diagnosis.extended = Some(quality(extended_residual.nrmse));
        diagnosis.gain = Some(Gain::new(
            baseline.energy,
            extended_residual.energy,
            extended_residual.count,
        ));
    }
    Some(diagnosis)
}

/// Residual of a case on records.
struct Residual {
    /// χ².
    energy: f64,
    /// Number of compared values.
    count: f64,
    /// NRMSE.
    nrmse: f64,
}

impl Residual {
    fn of(case: &Case, recordings: &[Recording]) -> Option<Self> {
        let study = Study::new(case, recordings).ok()?;
        let regression = Regression::new(&study);
        Some(Self {
            energy: regression.residual(Subset::Whole),
            count: regression.count(Subset::Whole) as f64,
            nrmse: regression.nrmse(&study, Subset::Whole),
        })
    }
}
