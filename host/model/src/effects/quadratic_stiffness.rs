//! A spring that is stiffer to one side: f_r += k2·x².

use std::sync::Arc;

use super::Kind;
use super::local_force::LocalForce;

pub(super) const KIND: Kind = Kind {
    name: "quadratic-stiffness",
    keys: "k2_n_per_m2 and direction",
    build: |parameters| {
        Ok(Arc::new(LocalForce {
            name: KIND.name,
            coefficients: [parameters.main("k2_n_per_m2")?, 0.0],
            law: |[k2, _], x, _| k2 * x.powi(2),
            slopes: |[k2, _], x, _| [2.0 * k2 * x, 0.0],
            direction: parameters.direction("direction")?,
        }))
    },
};
