//! f_r += k3·x³.
//!
//! Shows: a natural frequency that changes as the square of the amplitude; odd harmonics, the third the largest; both at two or more
//! levels, or in a decay. Does not show: even harmonics, an offset, or damping that depends on amplitude. Below the minimum of its
//! stiffness, a softening-hardening spring cannot be told from it. Fit: linear in k3. Source: Worden and Tomlinson, Nonlinearity in
//! Structural Dynamics (2001), ch. 2; Kerschen et al., MSSP 20 (2006).

use super::restoring::{Restoring, plain};
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = Restoring {
    each: true,
    ..plain(EffectName::CubicStiffness, &["k3_n_per_m3"])
};
