//! Bouc–Wen hysteresis along an axis: f_r += k_h·(z − x), ż = v·(1 − |z/z_y|ⁿ(γ·sgn(vz) + β)), β = 1 − γ.
//!
//! Shows: loops of force over displacement that do not depend on speed; with rising amplitude, stiffness that falls and
//! damping that first rises and then falls. Does not show: even harmonics. At large slip it is equivalent to friction
//! and reduced stiffness. Fit: linear in k_h; z_y, n and γ are nonlinear parameters. Source: Wen, J. Eng. Mech. Div.
//! ASCE 102 (1976).

use super::restoring::{Restoring, largest_m, logarithmic, plain, smallest_m};
use quietcut_model::effects::EffectName;

pub(super) const CAUSE: Restoring = Restoring {
    nonlinear_parameters: &["yield_m", "exponent", "gamma"],
    nonlinear_grid: |study, axis| {
        let last = 2.0 * largest_m(study, axis);
        let first = (0.2 * smallest_m(study, axis)).min(0.1 * last);
        logarithmic(first, last, 7)
            .into_iter()
            .flat_map(|yield_m| [1.0, 2.0].map(|exponent| vec![yield_m, exponent, 0.5]))
            .collect()
    },
    bounds: |study, axis| {
        vec![
            [0.02 * smallest_m(study, axis), 8.0 * largest_m(study, axis)],
            [1.0, 6.0],
            [0.0, 1.0],
        ]
    },
    physical: |k| k[0] > 0.0,
    ..plain(EffectName::Hysteresis, &["hysteretic_stiffness_n_per_m"])
};
