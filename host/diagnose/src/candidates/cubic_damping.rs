//! f_r += c3·v³.
//!
//! Shows: damping that grows as v²; the third harmonic in phase with velocity; at two levels and more, or in a decay. Does not show: a
//! frequency that moves. At one level it is damping.
//! Fit: linear in c3. Source: Worden and Tomlinson, Nonlinearity in Structural Dynamics (2001), ch. 2.

use super::restoring::{Restoring, plain};
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = Restoring {
    each: true,
    ..plain(EffectName::CubicDamping, &["c3_ns3_per_m3"])
};
