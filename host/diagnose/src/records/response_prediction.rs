//! Prediction of the channels of a test of the structure from its forces.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::baseline::Baseline;
use crate::records::motion_estimate;
use crate::records::record::Record;

/// Fixed-point iterations in which the motion and the nonlinear terms of the baseline settle. A linear baseline needs one.
const ROUNDS: usize = 4;

/// The record with the prediction of all channels from the forces and the terms of the baseline along the motion, and with the motion
/// that the residual corrects.
pub(super) fn predicted(mut record: Record, baseline: &Baseline<'_>) -> Record {
    record.prepare_decays(baseline);
    let rounds = if baseline.terms.is_empty() { 1 } else { ROUNDS };
    let outside: [Option<Vec<Complex64>>; 3] = std::array::from_fn(|axis| {
        (!record.force_n[axis].is_empty()).then(|| record.grid.spectrum(&record.force_n[axis]))
    });
    for round in 0..rounds {
        let mut force = outside.clone();
        if round > 0 {
            record.add_terms(baseline, &mut force);
        }
        accept_response(&mut record, &force);
        motion_estimate::learn(&mut record, baseline, &force, None);
    }
    if rounds > 1 {
        let mut force = outside;
        record.add_terms(baseline, &mut force);
        accept_response(&mut record, &force);
    }
    record
}

/// Predicts every channel as the response to `force` with the free decay that fits best.
fn accept_response(record: &mut Record, force: &[Option<Vec<Complex64>>; 3]) {
    let predicted: Vec<Vec<f64>> = (0..record.channels.len())
        .into_par_iter()
        .map(|channel| record.read_response(force, channel))
        .collect();
    record.accept(predicted);
}
