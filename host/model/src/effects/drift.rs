//! Stiffness that moves with time: K → K·(1 + r·t), or K·(1 + a·(1 − e^(−t/T))).

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::place::{axis_of, static_stiffness};
use super::{Effect, EffectError, Kind};
use crate::structure::{Direction, Structure};
use crate::{At, Branch, Term};

pub(super) const KIND: Kind = Kind {
    name: "drift",
    keys: "relative_rate_per_s, or relative_change and time_constant_s, and direction (without it all of K)",
    build: |parameters| {
        let direction = parameters.direction("direction")?;
        let time_constant = parameters.positive("time_constant_s")?;
        let law = match (time_constant, parameters.finite("relative_change")?) {
            (Some(time_constant_s), Some(change)) => Law::Settles {
                change,
                time_constant_s,
            },
            (Some(time_constant_s), None) => Law::Settles {
                change: parameters.main("relative_change")?,
                time_constant_s,
            },
            (None, Some(_)) => {
                return Err(EffectError::Missing {
                    name: "drift".into(),
                    key: "time_constant_s beside relative_change",
                });
            }
            (None, None) => Law::Rate(parameters.rate("relative_rate_per_s")?),
        };
        Ok(Arc::new(Drift { law, direction }))
    },
};

#[derive(Clone, Copy, Debug)]
enum Law {
    Rate(f64),
    Settles { change: f64, time_constant_s: f64 },
}

impl Law {
    fn relative_change(self, t: f64) -> f64 {
        match self {
            Self::Rate(rate) => rate * t,
            Self::Settles {
                change,
                time_constant_s,
            } => -change * (-t / time_constant_s).exp_m1(),
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Drift {
    law: Law,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct Spring {
    law: Law,
    stiffness: Matrix3<f64>,
}

impl Effect for Drift {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn terms(&self, structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        let mut stiffness = static_stiffness(structure, KIND.name)?;
        if self.direction.is_some() {
            let axis = axis_of(structure, self.direction, KIND.name)?;
            let own = stiffness[(axis, axis)];
            stiffness.fill(0.0);
            stiffness[(axis, axis)] = own;
        }
        Ok(vec![Box::new(Spring {
            law: self.law,
            stiffness,
        })])
    }
}

impl Term for Spring {
    fn restoring_n(&self, _: Branch, at: &At, _: &[f64]) -> [f64; 3] {
        (self.stiffness * Vector3::from(at.x) * self.law.relative_change(at.t)).into()
    }
}
