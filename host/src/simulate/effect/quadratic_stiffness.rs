//! A spring that is stiffer to one side: f_r += k2·x².

use std::sync::Arc;

use super::place::{along, axis_of};
use super::{Effect, EffectError, Kind};
use crate::simulate::{At, Branch, Term};
use crate::structure::{Direction, Structure};

pub(super) const KIND: Kind = Kind {
    name: "quadratic-stiffness",
    keys: "k2_n_per_m2 and direction",
    build: |parameters| {
        Ok(Arc::new(QuadraticStiffness {
            coefficient: parameters.main("k2_n_per_m2")?,
            direction: parameters.direction("direction")?,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct QuadraticStiffness {
    coefficient: f64,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct Force {
    coefficient: f64,
    axis: usize,
}

impl Effect for QuadraticStiffness {
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
        along(self.axis, self.coefficient * at.x[self.axis].powi(2))
    }
}
