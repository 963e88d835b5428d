//! Damping that grows with velocity: f_r += c3·v³.

use std::sync::Arc;

use super::Kind;
use super::local_force::LocalForce;

pub(super) const KIND: Kind = Kind {
    name: "cubic-damping",
    keys: "c3_ns3_per_m3 and direction",
    build: |parameters| {
        Ok(Arc::new(LocalForce {
            name: KIND.name,
            coefficients: [parameters.main("c3_ns3_per_m3")?, 0.0],
            law: |[c3, _], _, v| c3 * v.powi(3),
            slopes: |[c3, _], _, v| [0.0, 3.0 * c3 * v.powi(2)],
            direction: parameters.direction("direction")?,
        }))
    },
};
