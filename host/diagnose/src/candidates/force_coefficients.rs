//! The cutting coefficients K_tc, K_rc, K_ac differ from those of the case.
//!
//! Shows: forces in proportion to the chip, and with them the chatter limits. Does not show: force at a vanishing chip. Without measured
//! force all coefficients by one factor are a gain of all channels.
//! Fit: linear in each. Source: Altintas, Manufacturing Automation (2012), ch. 2.

use super::coefficients::Coefficients;
use quietcut_model::effects::EffectName;

pub(super) const FORCE_COEFFICIENTS: Coefficients = Coefficients {
    effect: EffectName::ForceCoefficients,
    keys: ["ktc_mpa", "krc_mpa", "kac_mpa"],
    of: |material| {
        [
            &mut material.ktc_mpa,
            &mut material.krc_mpa,
            &mut material.kac_mpa,
        ]
    },
    step: |cutter| cutter.force.material().ktc_mpa.abs().max(1.0),
    // A chip pushes against the turning.
    can_be: |tangential| tangential > 0.0,
};
