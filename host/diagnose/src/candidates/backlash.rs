//! A share s of the spring along an axis does not act within a gap of total width g: f_r += s·k·(d(x) − x), with the
//! static stiffness k and d(x) = 0 for |x| ≤ g/2, x ∓ g/2 beyond.
//!
//! Shows: at amplitudes above half the gap, a stiffness that rises with amplitude towards that of the case; odd
//! harmonics. Does not show: a change of damping; at amplitudes within the gap, any effect other than a reduced
//! stiffness. Fit: linear in s for each gap; the gap g is a nonlinear parameter. Source: Nordin and Gutman, Automatica
//! 38 (2002).

use super::restoring::{Restoring, largest_m, logarithmic, plain, smallest_m};
use crate::criteria::LARGEST_SPRING_SHARE;
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = Restoring {
    nonlinear_parameters: &["gap_mm"],
    nonlinear_grid: |study, axis| {
        let last = 1.9 * largest_m(study, axis);
        let first = (0.3 * smallest_m(study, axis)).min(0.1 * last);
        logarithmic(1e3 * first, 1e3 * last, 12)
            .into_iter()
            .map(|gap| vec![gap])
            .collect()
    },
    bounds: |study, axis| vec![[1.0 * smallest_m(study, axis), 2e3 * largest_m(study, axis)]],
    physical: |share| share[0] > 0.0 && share[0] <= LARGEST_SPRING_SHARE,
    ..plain(EffectName::Backlash, &["stiffness_fraction"])
};
