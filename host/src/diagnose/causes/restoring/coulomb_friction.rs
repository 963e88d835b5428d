//! f_r += fc·sign(v), with another force for each way. Seen at low levels: sticking, and damping that falls with amplitude.

use super::{Restoring, plain};

pub(super) const CAUSE: Restoring = Restoring {
    physical: |fc| fc.iter().all(|fc| *fc >= 0.0),
    ..plain("coulomb-friction", &["fc_n", "fc_minus_n"])
};
