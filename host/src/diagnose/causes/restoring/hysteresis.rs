//! Bouc–Wen: f_r += k_h·(z − x), ż = v·(1 − |z/z_y|ⁿ(γ·sgn(vz) + β)). Seen as loops that do not depend on speed.

use super::{Restoring, largest_m, logarithmic, plain, smallest_m};

pub(super) const CAUSE: Restoring = Restoring {
    shape: &["yield_m", "exponent", "gamma"],
    shapes: |scene, axis| {
        let last = 2.0 * largest_m(scene, axis);
        let first = (0.2 * smallest_m(scene, axis)).min(0.1 * last);
        logarithmic(first, last, 7)
            .into_iter()
            .flat_map(|yield_m| [1.0, 2.0].map(|exponent| vec![yield_m, exponent, 0.5]))
            .collect()
    },
    bounds: |scene, axis| {
        vec![
            [0.02 * smallest_m(scene, axis), 8.0 * largest_m(scene, axis)],
            [1.0, 6.0],
            [0.0, 1.0],
        ]
    },
    physical: |k| k[0] > 0.0,
    ..plain("hysteresis", &["hysteretic_stiffness_n_per_m"])
};
