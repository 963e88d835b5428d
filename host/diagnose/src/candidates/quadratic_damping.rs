//! Quadratic damping f_r += c2·|v|·v along an axis. Fit: linear in c2 along the measured motion.

use super::restoring::{Restoring, plain};
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = Restoring {
    each: true,
    ..plain(EffectName::QuadraticDamping, &["c2_ns2_per_m2"])
};
