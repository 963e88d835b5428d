//! Quintic spring f_r += k5·x⁵ along an axis.
//!
//! Shows: a natural frequency that changes as the fourth power of the amplitude; odd harmonics up to the fifth; both at
//! three or more levels of excitation, or in a free decay. Does not show: even harmonics, an offset, or damping that
//! depends on amplitude. At one level it cannot be told from a cubic spring; softening-hardening at amplitudes far
//! beyond its least stiffness cannot be told from it. Fit: linear in k5. Source: Nayfeh and Mook, Nonlinear
//! Oscillations (1979), ch. 4.

use super::restoring::{Restoring, plain};
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = Restoring {
    each: true,
    ..plain(EffectName::QuinticStiffness, &["k5_n_per_m5"])
};
