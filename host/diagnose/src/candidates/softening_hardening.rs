//! Softening-hardening spring f_r += k3·x³ + k5·x⁵ along an axis, with k3 < 0 < k5.
//!
//! Shows: a natural frequency that falls with amplitude and then rises; odd harmonics up to the fifth. Does not show:
//! any difference from a cubic spring at amplitudes far below the minimum of f_r/x at x² = −k3/(2·k5). Two stiffness
//! regimes with a sharp transition are backlash, or stay unexplained. Fit: linear in k3 and k5. Source: Nayfeh and
//! Mook, Nonlinear Oscillations (1979), ch. 4 (the quintic term of the Duffing oscillator).

use super::restoring::{Restoring, plain};
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = Restoring {
    physical: |k| k[0] < 0.0 && k[1] > 0.0,
    ..plain(EffectName::SofteningHardening, &["k3_n_per_m3", "k5_n_per_m5"])
};
