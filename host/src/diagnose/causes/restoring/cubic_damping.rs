//! f_r += c3·v³. Seen at two levels and more, or in a decay; at one level it is damping.

use super::{Restoring, plain};

pub(super) const CAUSE: Restoring = Restoring {
    each: true,
    ..plain("cubic-damping", &["c3_ns3_per_m3"])
};
