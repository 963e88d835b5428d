//! Long records of random forces, impacts and cuts: causes are searched in the first part of each record, and the rest
//! validates the result.
//!
//! A search predicts its records hundreds of times. The first seconds of a random excitation, of impacts or of a cut at
//! one speed contain nearly the information of a minute, except on changes over the minute. Therefore the extended case
//! (the case itself if no cause was found) is accepted only if its residual energy in the rest is near that of the
//! noise, or exceeds it by a small share of the baseline's excess. The gain is computed from the rest alone, to which
//! no parameter of a cause was fitted.

use crate::baseline::Baseline;
use crate::conclusion::answer::{Diagnosis, Gain, Outcome, Quality};
use crate::conclusion::conclude;
use crate::conclusion::prediction_error::prediction_error;
use crate::criteria::{NOISE_TOLERANCE, SHORTENED_SHARE, UNEXPLAINED_OF_RESPONSE};
use crate::error::DiagnoseError;
use crate::fit::regression::{Regression, Subset};
use crate::progress::{Options, Stage};
use crate::records::study::Study;
use quietcut_model::case::Case;
use quietcut_recording::{Recording, TestKind};

/// Number of samples in the first parts of all records together, in which causes are searched; `PERIODS` and
/// `REVOLUTIONS` may require more.
const SEARCHED: usize = 32_768;
/// Smallest length of the first part of a record, in which causes are searched, in periods of the lowest natural
/// frequency of the baseline.
const PERIODS: f64 = 60.0;
/// Smallest length of the first part of a recorded cut, in which causes are searched, in revolutions of the spindle. As
/// many revolutions are left out before it if the record is long enough.
const REVOLUTIONS: f64 = 24.0;

/// The first part and the rest of each record, if all records are of random forces, of impacts or of cuts at one speed;
/// otherwise `None`. Also `None` if the case has no baseline model with an oscillating mode, if the sidecar of a cut
/// gives no spindle speed, or if the first parts would hold at least [`SHORTENED_SHARE`] of all samples.
fn beginnings(case: &Case, recordings: &[Recording]) -> Option<[Vec<Recording>; 2]> {
    // A case without baseline model is not reported here: it is refused when the whole records are prepared.
    let lowest_hz = Baseline::new(case).ok()?.lowest_hz()?;
    let all: usize = recordings.iter().map(Recording::len).sum();
    let (shortened, rest): (Vec<Recording>, Vec<Recording>) = recordings
        .iter()
        .map(|recording| {
            let revolutions_s = revolutions_s(recording)?;
            let samples = |seconds: f64| (seconds * recording.sample_rate_hz).ceil() as usize;
            // The first part of a cut begins after the transient of the tool's entry, for which `REVOLUTIONS`
            // revolutions are left out if the record is long enough.
            let from = samples(revolutions_s);
            let least = samples((PERIODS / lowest_hz).max(revolutions_s));
            let count = (SEARCHED / recordings.len()).max(least);
            let to = (from + count).min(recording.len());
            let from = to.saturating_sub(count);
            Some((recording.part(from..to), recording.part(to..recording.len())))
        })
        .collect::<Option<_>>()?;
    let left: usize = shortened.iter().map(Recording::len).sum();
    ((left as f64) < SHORTENED_SHARE * all as f64).then_some([shortened, rest])
}

/// Smallest duration of the first part of a recorded cut, in which causes are searched, s; zero for shaker and hammer;
/// `None` for tests whose recordings are not divided.
fn revolutions_s(recording: &Recording) -> Option<f64> {
    match (recording.sidecar.kind, &recording.sidecar.cut) {
        (Some(TestKind::Shaker | TestKind::Hammer), _) => Some(0.0),
        (Some(TestKind::Cutting), Some(cut)) if cut.last_rpm.is_none() => {
            Some(60.0 * REVOLUTIONS / cut.spindle_rpm?)
        }
        _ => None,
    }
}

/// The answer from the first parts of the records, if it holds for the rest of them too or leaves the residual
/// unexplained; otherwise `None`, as for records that are not divided. The second value is a warning if the first parts
/// or the rest cannot be compared alone.
pub(crate) fn concluded(
    case: &Case,
    recordings: &[Recording],
    options: &Options,
    watch: &dyn Fn(Stage),
) -> (Option<Diagnosis>, Option<String>) {
    let Some(parts) = beginnings(case, recordings) else {
        return (None, None);
    };
    match validated(case, &parts, options, watch) {
        Ok(diagnosis) => (diagnosis, None),
        Err(error) => {
            let warning = format!(
                "causes were searched in the whole records, because a part cannot be compared alone: {error}"
            );
            (None, Some(warning))
        }
    }
}

/// The answer from the first parts of the records, if it holds for the rest of them too or leaves the residual
/// unexplained; otherwise `None`.
///
/// # Errors
/// A first part or a rest cannot be compared alone.
fn validated(
    case: &Case,
    [beginnings, rest]: &[Vec<Recording>; 2],
    options: &Options,
    watch: &dyn Fn(Stage),
) -> Result<Option<Diagnosis>, DiagnoseError> {
    let mut diagnosis = conclude::of_records(case, beginnings, options, watch)?;
    watch(Stage::Records);
    let baseline = Residual::of(case, rest)?;
    let searched_s = beginnings
        .iter()
        .map(|record| record.len() as f64 / record.sample_rate_hz);
    diagnosis.warnings.push(format!(
        "causes were searched in {:.1} s near the start of each record, and validated on the rest",
        searched_s.fold(0.0, f64::max)
    ));
    let extended = match diagnosis.outcome {
        // The answer is not validated: more samples would not make a known cause explain the residual.
        Outcome::Unexplained => return Ok(Some(diagnosis)),
        Outcome::None => case.clone(),
        _ => match diagnosis.extended(case) {
            Some(extended) => extended,
            None => return Ok(None),
        },
    };
    let extended_residual = Residual::of(&extended, rest)?;
    let beyond = extended_residual.energy - extended_residual.count;
    if beyond > NOISE_TOLERANCE * extended_residual.count
        && beyond > UNEXPLAINED_OF_RESPONSE * (baseline.energy - baseline.count)
    {
        return Ok(None);
    }
    // No parameter of a cause was fitted to the rest of the records: all of it is held out.
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
    Ok(Some(diagnosis))
}

/// Residual of a case in records to which no cause is fitted.
struct Residual {
    /// Residual energy χ² of all records, in units of the noise variance.
    energy: f64,
    /// Number of compared values of all records.
    count: f64,
    /// Prediction error (NRMSE) of the case on these records.
    nrmse: f64,
}

impl Residual {
    fn of(case: &Case, recordings: &[Recording]) -> Result<Self, DiagnoseError> {
        let study = Study::new(case, recordings)?;
        let regression = Regression::new(&study);
        Ok(Self {
            energy: regression.residual(Subset::Whole),
            count: regression.count(Subset::Whole) as f64,
            nrmse: prediction_error(&study, &regression).nrmse_whole,
        })
    }
}
