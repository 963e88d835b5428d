//! Cubic spring f_r += k3·x³ along an axis.
//!
//! Shows: a natural frequency that changes as the square of the amplitude; odd harmonics, the third the largest; both
//! at two or more levels of excitation, or in a free decay. Does not show: even harmonics, an offset, or damping that
//! depends on amplitude. A softening-hardening spring at amplitudes far below its least stiffness cannot be told from
//! it. Fit: linear in k3. Source: Worden and Tomlinson, Nonlinearity in Structural Dynamics (2001), ch. 2; Kerschen et
//! al., MSSP 20 (2006).

use super::restoring::{Restoring, plain};
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = Restoring {
    each: true,
    ..plain(EffectName::CubicStiffness, &["k3_n_per_m3"])
};
