//! A potential shared by two directions: ½·k_xxyy·x²y² or k_xxy·x²y. Seen where both move.

use super::{Restoring, plain};

pub(super) const QUARTIC: Restoring = Restoring {
    axes: 2,
    ..plain("mode-coupling", &["kxyy_n_per_m3"])
};

pub(super) const CUBIC: Restoring = Restoring {
    axes: 2,
    ..plain("mode-coupling", &["kxxy_n_per_m2"])
};
