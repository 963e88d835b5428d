//! Quadratic spring f_r += k2·x² along an axis.
//!
//! Shows: a second harmonic and an offset, both proportional to the square of the amplitude. Does not show: a change of
//! the natural frequency to first order in k2, or odd harmonics. A cubic spring under a static load has the same term.
//! Fit: linear in k2. Source: Worden and Tomlinson, Nonlinearity in Structural Dynamics (2001), ch. 2.

use super::restoring::{Restoring, plain};
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = plain(EffectName::QuadraticStiffness, &["k2_n_per_m2"]);
