//! Stiffness of the structure that changes with the time t since the start of the recording: K·(1 + r·t), or K·(1 +
//! a·(1 − e^(−t/T))).
//!
//! Shows: natural frequencies that change along the record at constant amplitude, all by the same factor. Does not
//! show: harmonics, or a dependence on amplitude. If the vibration level only rises or only falls along the records, a
//! stiffness that depends on amplitude cannot be told from drift. Fit: linear in r or a; T is a nonlinear parameter.
//! Source: structures with time-dependent parameters as in Poulimenos and Fassois, MSSP 20 (2006).

use super::restoring::{Restoring, logarithmic, longest_s, plain};
use quietcut_model::effects::EffectName;

pub(super) const RATE: Restoring = Restoring {
    everywhere: true,
    ..plain(EffectName::Drift, &["relative_rate_per_s"])
};

pub(super) const SETTLING: Restoring = Restoring {
    nonlinear_parameters: &["time_constant_s"],
    nonlinear_grid: |study, _| {
        let length = longest_s(study);
        logarithmic(0.05 * length, length, 5)
            .into_iter()
            .map(|t| vec![t])
            .collect()
    },
    everywhere: true,
    // A relative change a beyond ±1, with which the stiffness would more than double or become negative, is no drift.
    physical: |change| change.iter().all(|change| change.abs() <= 1.0),
    bounds: |study, _| vec![[0.05 * longest_s(study), 2.0 * longest_s(study)]],
    ..plain(EffectName::Drift, &["relative_change"])
};
