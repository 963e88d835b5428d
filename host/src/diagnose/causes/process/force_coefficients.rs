//! The cutting coefficients K_tc, K_rc, K_ac differ from those of the case.

use super::coefficients::Coefficients;

pub(super) const FORCE_COEFFICIENTS: Coefficients = Coefficients {
    name: "force-coefficients",
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
