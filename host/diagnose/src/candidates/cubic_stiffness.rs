//! f_r += k3·x³.
//!
//! Shows: the natural frequency moves with amplitude, as x²; odd harmonics, the third first; at two levels and more, or in a decay.
//! Does not show: even harmonics, an offset, or a damping that depends on amplitude. Below the turn of a softening-hardening spring
//! nothing tells the two apart.
//! Fit: linear in k3. Source: Worden and Tomlinson, Nonlinearity in Structural Dynamics (2001), ch. 2; Kerschen et al., MSSP 20 (2006).

use super::restoring::{Restoring, plain};
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = Restoring {
    each: true,
    ..plain(EffectName::CubicStiffness, &["k3_n_per_m3"])
};
