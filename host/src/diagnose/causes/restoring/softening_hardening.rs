//! f_r += k3·x³ + k5·x⁵ with k3 < 0 < k5. Below its turn, x² = −k3/(2·k5), it is a cubic spring.

use super::{Restoring, plain};

pub(super) const CAUSE: Restoring = Restoring {
    physical: |k| k[0] < 0.0 && k[1] > 0.0,
    ..plain("softening-hardening", &["k3_n_per_m3", "k5_n_per_m5"])
};
