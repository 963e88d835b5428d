//! A cubic spring: f_r += k3·x³.

use std::sync::Arc;

use super::Kind;
use super::local_force::LocalForce;

pub(super) const KIND: Kind = Kind {
    name: "cubic-stiffness",
    keys: "k3_n_per_m3 and direction",
    build: |parameters| {
        Ok(Arc::new(LocalForce {
            name: KIND.name,
            coefficients: [parameters.main("k3_n_per_m3")?, 0.0],
            law: |[k3, _], x, _| k3 * x.powi(3),
            slopes: |[k3, _], x, _| [3.0 * k3 * x.powi(2), 0.0],
            direction: parameters.direction("direction")?,
        }))
    },
};
