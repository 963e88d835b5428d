//! Dry friction f_r += fc·sign(v), sticking included; fc is the same in both directions of motion, or has one value for
//! each.
//!
//! Shows: damping that falls as 1/amplitude, sticking at low amplitudes, odd harmonics that decrease slowly with their
//! order. Does not show: a change of frequency while it slips, or an effect at large amplitudes. A Bouc–Wen loop that
//! is very stiff before it yields is equivalent. Fit: linear in fc along the measured motion, where f_r passes linearly
//! from −fc to fc while |v| is below the noise; sticking is represented by the simulation of the prediction-error fit.
//! Source: Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30 (1994).

use super::restoring::{Restoring, largest_m, plain};
use crate::records::domain::Domain;
use quietcut_model::effects::EffectName;

pub(super) const SYMMETRIC: Restoring = Restoring {
    physical: |fc| fc.iter().all(|fc| *fc > 0.0),
    ..plain(EffectName::CoulombFriction, &["fc_n"])
};

pub(super) const ASYMMETRIC: Restoring = Restoring {
    physical: |fc| fc.iter().all(|fc| *fc >= 0.0),
    ..plain(EffectName::CoulombFriction, &["fc_n", "fc_minus_n"])
};

/// Dry friction behind a backlash: after each reversal of the motion no force until the gap `play_mm` is crossed, then
/// friction.
pub(super) const BEHIND_BACKLASH: Restoring = Restoring {
    nonlinear_parameters: &["play_mm"],
    nonlinear_grid: |study, axis| {
        let most = 2e3 * largest_m(study, axis);
        [0.02, 0.04, 0.08, 0.16, 0.32, 0.5, 0.7]
            .map(|share| vec![share * most])
            .to_vec()
    },
    bounds: |study, axis| vec![[largest_m(study, axis), 1.9e3 * largest_m(study, axis)]],
    physical: |fc| fc.iter().all(|fc| *fc >= 0.0) && fc.iter().any(|fc| *fc > 0.0),
    behind_backlash: true,
    ..plain(EffectName::CoulombFriction, &["fc_n", "fc_minus_n"])
};

/// Dry friction behind a backlash whose contact closes gradually over `contact_mm`. It is a candidate only if all
/// records compare the measured force along a measured motion; for a structure driven by a force, hysteresis (Bouc–Wen)
/// describes the same loop.
pub(super) const BEHIND_SOFT_BACKLASH: Restoring = Restoring {
    nonlinear_parameters: &["play_mm", "contact_mm"],
    nonlinear_grid: |study, axis| {
        if !study.all_in(Domain::Force) {
            return Vec::new();
        }
        let most = 2e3 * largest_m(study, axis);
        [0.02, 0.04, 0.08, 0.16, 0.32]
            .into_iter()
            .flat_map(|play| [0.02, 0.06].map(|contact| vec![play * most, contact * most]))
            .collect()
    },
    bounds: |study, axis| {
        let largest_m = largest_m(study, axis);
        vec![[largest_m, 1.9e3 * largest_m], [largest_m, 1e3 * largest_m]]
    },
    ..BEHIND_BACKLASH
};
