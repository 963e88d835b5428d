//! Diagnosis of records that are all stable cuts.

use super::answer::{answer, quality};
use super::contradictions::{contradiction, unit_of_gain};
use super::record::ReducedCut;
use super::selection::{as_written, explain};
use crate::baseline::Baseline;
use crate::conclusion::answer::{Diagnosis, Outcome, Quality};
use crate::error::DiagnoseError;
use crate::motion::spindle_motion::{SpindleMotion, speed_modulation};
use crate::progress::Stage;
use quietcut_model::case::Case;
use quietcut_recording::{Recording, TestKind};

/// Amplitude of a spectral line that is no order over that of the largest order of its channel, and its displacement over
/// the feed per tooth, from which on the cut chatters: its motion is then not that of the forced orbit. Chatter grows until
/// teeth leave the surface or nonlinear forces bound it; a mode that the scatter of tooth forces drives stays far below.
const CHATTER: [f64; 2] = [0.2, 0.05];

/// Root mean square of a modulation of the speed over that of all its wander from which on it is the modulation, and
/// not one of the frequencies of a wandering speed.
const MODULATED: f64 = 0.8;
/// The same of a modulation of fewer periods than [`FEW_PERIODS`] over the longest record: a speed that wanders looks like one, but for
/// what it has of higher frequencies.
const MODULATED_SLOWLY: f64 = 0.99;
const FEW_PERIODS: f64 = 3.0;

/// The diagnosis of records that are all cuts with a steady forced motion; `None` for other records: those in chatter, and those
/// whose speed is modulated.
///
/// # Errors
/// The case cannot be simulated, or contradicts a record.
pub(crate) fn diagnosed(
    case: &Case,
    recordings: &[Recording],
    watch: &dyn Fn(Stage),
) -> Result<Option<Diagnosis>, DiagnoseError> {
    let are_cuts = recordings
        .iter()
        .all(|recording| recording.sidecar.kind == Some(TestKind::Cutting));
    if !are_cuts || recordings.is_empty() {
        return Ok(None);
    }
    let baseline = Baseline::new(case)?;
    let mut records = Vec::with_capacity(recordings.len());
    let mut motions = Vec::with_capacity(recordings.len());
    for recording in recordings {
        let record = match (ReducedCut::new(&baseline, recording), recording.channel("tacho")) {
            (Ok(record), _) => record,
            (Err(error), Some(_)) => {
                tracing::debug!(%error, "a cut cannot be reduced");
                return Ok(None);
            }
            // No other way reads a cut without tachometer.
            (Err(error), None) => return Err(error),
        };
        records.push(record);
        motions.extend(SpindleMotion::new(recording, None).ok());
    }
    let is_modulated = speed_modulation(&motions.iter().collect::<Vec<_>>()).is_some_and(|modulation| {
        let wander = records
            .iter()
            .map(|record| record.orders.angle.speed_wander)
            .fold(0.0, f64::max);
        let longest_s = recordings
            .iter()
            .map(|recording| recording.len() as f64 / recording.sample_rate_hz)
            .fold(0.0, f64::max);
        let least = if modulation.fluctuation.frequency_hz * longest_s < FEW_PERIODS {
            MODULATED_SLOWLY
        } else {
            MODULATED
        };
        modulation.fluctuation.delta / 2.0_f64.sqrt() > least * wander
    });
    let chatters = records.iter().any(|record| record.chatters(CHATTER));
    if is_modulated || chatters {
        tracing::debug!(is_modulated, chatters, "no steady forced motion");
        return Ok(None);
    }
    watch(Stage::Causes(1));
    if let Some(error) = contradiction(&baseline, &records, recordings) {
        return Err(error);
    }
    let Some(explanations) = explain(&baseline, &records) else {
        tracing::debug!("the baseline has no orbit");
        return Ok(None);
    };
    watch(Stage::Answer);
    let mut diagnosis = answer(&explanations, &records, recordings);
    if diagnosis.outcome == Outcome::Cause
        && let Some(error) = unit_of_gain(&diagnosis.causes, recordings)
    {
        return Err(error);
    }
    if let Some(extended) = diagnosis.extended(case) {
        match prediction_error_of(&extended, recordings) {
            Ok(error) => diagnosis.extended = error.or(diagnosis.extended),
            Err(error) => diagnosis.warnings.push(format!(
                "the extended case cannot be compared with the records: {error}"
            )),
        }
    }
    Ok(Some(diagnosis))
}

/// Prediction error of a case as it is written: what a diagnosis of it prints of its baseline. `None` if it has no orbit.
///
/// # Errors
/// The case cannot be simulated, or a recording cannot be compared.
fn prediction_error_of(case: &Case, recordings: &[Recording]) -> Result<Option<Quality>, DiagnoseError> {
    let baseline = Baseline::new(case)?;
    let records = recordings
        .iter()
        .map(|recording| ReducedCut::new(&baseline, recording))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(as_written(&baseline, &records).map(|written| quality(&written, &records)))
}
