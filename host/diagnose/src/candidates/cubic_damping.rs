//! Cubic damping f_r += c3·v³ along an axis.
//!
//! Shows: damping that grows as the square of the velocity amplitude; a third harmonic in phase with the velocity; both
//! at two or more levels of excitation, or in a free decay. Does not show: a change of frequency. At one level of
//! excitation it is equivalent to linear damping. Fit: linear in c3. Source: Worden and Tomlinson, Nonlinearity in
//! Structural Dynamics (2001), ch. 2.

use super::restoring::{Restoring, plain};
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = Restoring {
    each: true,
    ..plain(EffectName::CubicDamping, &["c3_ns3_per_m3"])
};
