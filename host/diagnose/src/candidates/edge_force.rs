//! The edge coefficients K_te, K_re, K_ae of the material differ from those of the case.
//!
//! Shows: forces that do not depend on the chip thickness while a tooth is engaged. Does not show: any change with the
//! feed per tooth, whereas the part of the force by cutting coefficients is proportional to it. Fit: linear in each
//! coefficient. Source: Altintas, Manufacturing Automation (2012), ch. 2; Budak, Altintas and Armarego (1996).

use super::coefficients::Coefficients;
use quietcut_model::effects::EffectName;

pub(super) const EDGE_FORCE: Coefficients = Coefficients {
    effect: EffectName::EdgeForce,
    keys: ["kte_n_per_mm", "kre_n_per_mm", "kae_n_per_mm"],
    of: |material| {
        [
            &mut material.kte_n_per_mm,
            &mut material.kre_n_per_mm,
            &mut material.kae_n_per_mm,
        ]
    },
    // Step of a finite difference with respect to an edge coefficient, N/mm: the magnitude of the cutting coefficient
    // K_tc times the feed per tooth, but at least 1e-3 N/mm.
    step: |cutter| {
        (1e3 * cutter.feed_per_tooth_m * cutter.force.material().ktc_mpa)
            .abs()
            .max(1e-3)
    },
    can_be: |_| true,
};
