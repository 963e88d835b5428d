//! Predicts the channels of a test of the structure from its measured forces.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::baseline::Baseline;
use crate::records::motion_estimate;
use crate::records::record::Record;

/// Number of fixed-point iterations between the motion and the nonlinear restoring forces of the baseline. A linear
/// baseline needs one.
const ROUNDS: usize = 4;

/// Completes the record of a test of the structure: predicts all channels from the measured forces and the restoring
/// forces of the baseline along the motion, and corrects the motion by the residual.
pub(super) fn predicted(mut record: Record, baseline: &Baseline<'_>) -> Record {
    record.prepare_decays(baseline);
    let rounds = if baseline.terms.is_empty() { 1 } else { ROUNDS };
    let measured: [Option<Vec<Complex64>>; 3] = std::array::from_fn(|axis| {
        (!record.force_n[axis].is_empty()).then(|| record.grid.spectrum(&record.force_n[axis]))
    });
    for round in 0..rounds {
        let mut force = measured.clone();
        if round > 0 {
            record.add_terms(baseline, &mut force);
        }
        accept_response(&mut record, &force);
        motion_estimate::learn(&mut record, baseline, &force, None);
    }
    if rounds > 1 {
        let mut force = measured;
        record.add_terms(baseline, &mut force);
        accept_response(&mut record, &force);
    }
    record
}

/// Predicts every channel as its response to the force spectra `force` plus the best-fitting free decay.
fn accept_response(record: &mut Record, force: &[Option<Vec<Complex64>>; 3]) {
    let predicted: Vec<Vec<f64>> = (0..record.channels.len())
        .into_par_iter()
        .map(|channel| record.read_response(force, channel))
        .collect();
    record.accept(predicted);
}
