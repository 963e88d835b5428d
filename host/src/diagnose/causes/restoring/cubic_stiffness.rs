//! f_r += k3·x³. Seen at two levels and more, or in a decay: natural frequency moves with amplitude, odd harmonics.

use super::{Restoring, plain};

pub(super) const CAUSE: Restoring = Restoring {
    each: true,
    ..plain("cubic-stiffness", &["k3_n_per_m3"])
};
