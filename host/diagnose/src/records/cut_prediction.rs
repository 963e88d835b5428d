//! Predicts the channels of a recorded cut along the estimated motion of the tool.

use crate::baseline::Baseline;
use crate::criteria::CLOSED_LOOP_SETTLED;
use crate::error::DiagnoseError;
use crate::motion::recorded_cut::RecordedCut;
use crate::records::cutting::Cutting;
use crate::records::record::Record;
use crate::records::{amplification, checks, motion_estimate};
use crate::signal::noise::rms;
use quietcut_recording::{Quantity, Recording};

/// Number of iterations between the cutting force and the motion of a recorded cut: the force determines the motion,
/// and the motion determines the chip thickness and so the force.
const ROUNDS: usize = 4;
/// Largest number of iterations between cutting force and motion of a recorded cut if a candidate model supplies the
/// motion. They end earlier if, away from chatter, the motion is within [`CLOSED_LOOP_SETTLED`] of the closed-loop
/// prediction.
const ROUNDS_OF_A_MODEL: usize = 8;

/// Completes the record of a cut: predicts all channels with the baseline, and corrects the estimated motion by their
/// residual.
///
/// # Errors
/// The case and the recording do not describe one cut, or the size of a channel is that of a wrong unit.
pub(super) fn predicted(
    mut record: Record,
    baseline: &Baseline<'_>,
    recording: &Recording,
    amplifies: Option<bool>,
) -> Result<Record, DiagnoseError> {
    let with_force = record
        .channels
        .iter()
        .any(|channel| channel.pickup.quantity == Quantity::Force);
    let mut cutting = Cutting::new(
        baseline,
        recording,
        &record.motion,
        record.grid.finer(),
        with_force,
    )?;
    record.skipped = record
        .channels
        .iter()
        .map(|channel| cutting.skipped(channel))
        .collect();
    compare_without_ends(&mut record, &cutting.cut);
    record.prepare_decays(baseline);
    let slopes = cutting.mean_slopes();
    record.amplifies = amplifies.unwrap_or_else(|| amplification::amplifies(&record, &cutting.cut, &slopes));
    let rounds = if record.clean.is_some() {
        ROUNDS_OF_A_MODEL
    } else {
        ROUNDS
    };
    for round in 0..rounds {
        if round == 1 && record.amplifies {
            cutting.cut.let_miss(record.motion.peak_to_peak_m());
            compare_without_ends(&mut record, &cutting.cut);
        }
        if round > 0 {
            cutting.follow(&record.motion);
        }
        let mut force = record.cut_spectra(&cutting.force);
        record.force_n = std::array::from_fn(|axis| match &force[axis] {
            Some(spectrum) if baseline.axes.contains(&axis) => {
                record.grid.samples(&spectrum[..record.grid.bins()])
            }
            _ => Vec::new(),
        });
        let mut predicted = record.read_cut(&cutting.force);
        if round > 0 && !baseline.terms.is_empty() {
            let mut terms = [None, None, None];
            record.add_terms(baseline, &mut terms);
            for (index, predicted) in predicted.iter_mut().enumerate() {
                if record.channels[index].pickup.quantity != Quantity::Force {
                    let added = record.read_response(&terms, index);
                    predicted
                        .iter_mut()
                        .zip(added)
                        .for_each(|(sum, added)| *sum += added);
                }
            }
            record.add_terms(baseline, &mut force);
        }
        record.accept(predicted);
        if round == 0 && record.clean.is_none() {
            check_units(&record)?;
        }
        let off = record.distance_from_closed_loop();
        // In the first iteration the force is that of the feed alone, and not yet along the motion that a candidate
        // model supplies.
        let is_along = (round > 0 || record.clean.is_none()) && !record.amplifies;
        motion_estimate::learn(&mut record, baseline, &force, is_along.then_some(&slopes));
        if record.clean.is_some() && is_along && off < CLOSED_LOOP_SETTLED {
            break;
        }
    }
    // The regressors of causes are differences from the cutting force along the final motion, so that force is computed
    // here.
    cutting.follow(&record.motion);
    record.cut = Some(cutting);
    Ok(record)
}

/// Refuses a record with a channel whose size cannot be that of this cut. The prediction at this stage is that for a
/// tool that moves by the feed alone. Measured forces are close to those by the feed alone and are compared with them;
/// motion is only checked roughly, because regeneration may amplify it.
fn check_units(record: &Record) -> Result<(), DiagnoseError> {
    let mut forces = Vec::new();
    for (index, channel) in record.channels.iter().enumerate() {
        let mut response = record.decays.without(index, &channel.predicted);
        let mut measured = channel.measured.clone();
        // Skipped samples carry the measured value as prediction; both are set to zero so that they do not count in the
        // check of units.
        for &sample in &record.skipped[index] {
            (response[sample], measured[sample]) = (0.0, 0.0);
        }
        let range = record.compared.clone();
        let (response, measured) = (&response[range.clone()], &measured[range]);
        let name = &channel.pickup.name;
        checks::far_off(&record.path, name, response, measured)?;
        if channel.pickup.quantity == Quantity::Force && rms(response) > 0.0 {
            forces.push(checks::unit(&record.path, name, response, measured, 0.0));
        }
    }
    checks::unless_one_is_right(forces)
}

/// Excludes from the comparison the first revolutions of a record, whose chips depend on tooth passes before the
/// record, and, unless the record is short, as many samples at its end.
fn compare_without_ends(record: &mut Record, cut: &RecordedCut) {
    let (ends, count) = (cut.first_revolutions(), record.grid.count());
    record.compared = ends..if count > 4 * ends { count - ends } else { count };
}
