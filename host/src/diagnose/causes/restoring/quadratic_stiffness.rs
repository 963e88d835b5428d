//! f_r += k2·x². Seen as a second harmonic and an offset.

use super::{Restoring, plain};

pub(super) const CAUSE: Restoring = plain("quadratic-stiffness", &["k2_n_per_m2"]);
