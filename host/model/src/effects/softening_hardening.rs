//! A spring that softens and then hardens: f_r += k3·x³ + k5·x⁵ with k3 < 0 < k5; it turns at x² = −k3/(2·k5).

use std::sync::Arc;

use super::Kind;
use super::local_force::LocalForce;

pub(super) const KIND: Kind = Kind {
    name: "softening-hardening",
    keys: "k3_n_per_m3, k5_n_per_m5 and direction",
    build: |parameters| {
        Ok(Arc::new(LocalForce {
            name: KIND.name,
            coefficients: [parameters.main("k3_n_per_m3")?, parameters.needed("k5_n_per_m5")?],
            law: |[k3, k5], x, _| x * x * x * (k3 + k5 * x * x),
            slopes: |[k3, k5], x, _| [x * x * (3.0 * k3 + 5.0 * k5 * x * x), 0.0],
            direction: parameters.direction("direction")?,
        }))
    },
};
