//! Diagnosis of records that are all stable cuts.

use super::answer::answer;
use super::contradictions::contradiction;
use super::record::ReducedCut;
use super::selection::explain;
use crate::baseline::Baseline;
use crate::conclusion::answer::Diagnosis;
use crate::error::DiagnoseError;
use crate::motion::spindle_motion::{SpindleMotion, speed_modulation};
use crate::progress::Stage;
use quietcut_model::case::Case;
use quietcut_recording::{Recording, TestKind};

/// Amplitude of a spectral line that is no order over that of the largest order of its channel, from which on the cut
/// chatters: its motion is then not that of the forced orbit.
const CHATTER: f64 = 0.2;

/// Root mean square of a modulation of the speed over that of all its wander from which on it is the modulation, and
/// not one of the frequencies of a wandering speed.
const MODULATED: f64 = 0.8;

/// The diagnosis of records that are all cuts with a steady forced motion, which its orders explain; `None` for other
/// records: those in chatter, those whose speed is modulated, and those whose orders are left unexplained.
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
        let (Ok(record), Ok(motion)) = (
            ReducedCut::new(&baseline, recording),
            SpindleMotion::new(recording, None),
        ) else {
            return Ok(None);
        };
        records.push(record);
        motions.push(motion);
    }
    let is_modulated = speed_modulation(&motions.iter().collect::<Vec<_>>()).is_some_and(|modulation| {
        let wander = records
            .iter()
            .map(|record| record.orders.angle.speed_wander)
            .fold(0.0, f64::max);
        modulation.fluctuation.delta / 2.0_f64.sqrt() > MODULATED * wander
    });
    if is_modulated || records.iter().any(|record| record.chatters(CHATTER)) {
        return Ok(None);
    }
    watch(Stage::Causes(1));
    if let Some(error) = contradiction(&baseline, &records, recordings) {
        return Err(error);
    }
    let Some(explanations) = explain(&baseline, &records) else {
        return Ok(None);
    };
    watch(Stage::Answer);
    let diagnosis = answer(&explanations, &records, recordings);
    Ok((diagnosis.unexplained.fraction == 0.0).then_some(diagnosis))
}
