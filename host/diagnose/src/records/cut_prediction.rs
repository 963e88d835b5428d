//! Prediction of the channels of a cut along its motion.

use crate::baseline::Baseline;
use crate::criteria::CLOSED_LOOP_SETTLED;
use crate::error::DiagnoseError;
use crate::motion::recorded_cut::RecordedCut;
use crate::records::cutting::Cutting;
use crate::records::record::Record;
use crate::records::{amplification, checks, motion_estimate};
use crate::signal::noise::rms;
use quietcut_recording::{Quantity, Recording};

/// Rounds in which force and motion settle: the motion comes from the force, the chip from the motion.
const ROUNDS: usize = 4;
/// The same along the motion of a model, at most: until the motion is off the closed loop by no more than this, in units of the noise.
const ROUNDS_OF_A_MODEL: usize = 8;

/// Predicts all channels of a cut, and learns the motion from what is left.
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
            cutting.cut.let_jump(record.motion.swing_m());
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
        let off = record.off_the_closed_loop();
        // The first force along the motion of a model is that of the measured one still.
        let is_along = (round > 0 || record.clean.is_none()) && !record.amplifies;
        motion_estimate::learn(&mut record, baseline, &force, is_along.then_some(&slopes));
        if record.clean.is_some() && is_along && off < CLOSED_LOOP_SETTLED {
            break;
        }
    }
    // What the causes add is measured from the force along the motion as it is known now.
    cutting.follow(&record.motion);
    record.cut = Some(cutting);
    Ok(record)
}

/// Refuses channels whose size cannot be that of this cut. What is predicted first is along no motion at all: forces are about
/// those of the chips as they are fed; the motion may be larger by far where regeneration amplifies it.
fn check_units(record: &Record) -> Result<(), DiagnoseError> {
    let mut forces = Vec::new();
    for (index, channel) in record.channels.iter().enumerate() {
        let mut response = record.decays.without(index, &channel.predicted);
        let mut measured = channel.measured.clone();
        // There it is as measured.
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

/// Compares what comes after the first turn, and of all but short records what comes before the last.
fn compare_without_ends(record: &mut Record, cut: &RecordedCut) {
    let (turn, count) = (cut.first_turn(), record.grid.count());
    record.compared = turn..if count > 4 * turn { count - turn } else { count };
}
