//! A spring that softens and then hardens: f_r += k3·x³ + k5·x⁵ with k3 < 0 < k5; it turns at x² = −k3/(2·k5).

use std::sync::Arc;

use super::place::{along, axis_of};
use super::{Effect, EffectError, Kind};
use crate::simulate::{At, Branch, Term};
use crate::structure::{Direction, Structure};

pub(super) const KIND: Kind = Kind {
    name: "softening-hardening",
    keys: "k3_n_per_m3, k5_n_per_m5 and direction",
    build: |parameters| {
        Ok(Arc::new(SofteningHardening {
            k3: parameters.main("k3_n_per_m3")?,
            k5: parameters.needed("k5_n_per_m5")?,
            direction: parameters.direction("direction")?,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct SofteningHardening {
    k3: f64,
    k5: f64,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct Spring {
    k3: f64,
    k5: f64,
    axis: usize,
}

impl Effect for SofteningHardening {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn terms(&self, structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        let axis = axis_of(structure, self.direction, KIND.name)?;
        Ok(vec![Box::new(Spring {
            k3: self.k3,
            k5: self.k5,
            axis,
        })])
    }
}

impl Term for Spring {
    fn restoring_n(&self, _: Branch, at: &At, _: &[f64]) -> [f64; 3] {
        let x = at.x[self.axis];
        along(self.axis, x * x * x * (self.k3 + self.k5 * x * x))
    }
}
