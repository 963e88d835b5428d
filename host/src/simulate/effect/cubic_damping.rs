//! Damping that grows with velocity: f_r += c3·v³.

use std::sync::Arc;

use super::place::{along, axis_of};
use super::{Effect, EffectError, Kind};
use crate::simulate::{At, Branch, Term};
use crate::structure::{Direction, Structure};

pub(super) const KIND: Kind = Kind {
    name: "cubic-damping",
    keys: "c3_ns3_per_m3 and direction",
    build: |parameters| {
        Ok(Arc::new(CubicDamping {
            coefficient: parameters.main("c3_ns3_per_m3")?,
            direction: parameters.direction("direction")?,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct CubicDamping {
    coefficient: f64,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct Force {
    coefficient: f64,
    axis: usize,
}

impl Effect for CubicDamping {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn terms(&self, structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        let axis = axis_of(structure, self.direction, KIND.name)?;
        Ok(vec![Box::new(Force {
            coefficient: self.coefficient,
            axis,
        })])
    }
}

impl Term for Force {
    fn restoring_n(&self, _: Branch, at: &At, _: &[f64]) -> [f64; 3] {
        along(self.axis, self.coefficient * at.v[self.axis].powi(3))
    }
}
