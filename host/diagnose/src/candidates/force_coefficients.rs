//! The cutting coefficients K_tc, K_rc, K_ac of the material differ from those of the case.
//!
//! Shows: a change of the cutting force in proportion to the chip thickness, and changed chatter limits. Does not show:
//! a change of the force at vanishing chip thickness. In the steady state of a stable linear cut without measured
//! force, one factor on all cutting and edge coefficients is equivalent to one gain of all channels of motion. Fit:
//! linear in each coefficient. Source: Altintas, Manufacturing Automation (2012), ch. 2.

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
    // The chip resists the motion of the tooth: the tangential coefficient is positive.
    can_be: |tangential| tangential > 0.0,
};
