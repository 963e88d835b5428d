//! A potential shared by two axes: ½·k_xxyy·x²y² or k_xxy·x²y, with x and y the displacements along the first and the
//! second axis. The restoring force along each axis is the derivative of the potential.
//!
//! Shows, if the tool moves along both axes: response at sums and differences of multiples of their frequencies; a
//! stiffness along one axis that changes with the amplitude along the other. Does not show: with x²y², anything while
//! one axis is at rest; with x²y, anything while x is at rest. Fit: linear in the coefficient. Source: Nayfeh and Mook,
//! Nonlinear Oscillations (1979), ch. 6.

use super::restoring::{Restoring, plain};
use quietcut_model::effects::EffectName;

pub(super) const QUARTIC: Restoring = Restoring {
    axes: 2,
    is_symmetric: true,
    ..plain(EffectName::ModeCoupling, &["kxyy_n_per_m3"])
};

pub(super) const CUBIC: Restoring = Restoring {
    axes: 2,
    ..plain(EffectName::ModeCoupling, &["kxxy_n_per_m2"])
};
