//! Play: a share s of the spring does not act within a gap of total width g,
//! f_r += s·k·(d(x) − x) with d(x) = 0 for |x| ≤ g/2 and x ∓ g/2 beyond; k is the stiffness along the direction.

use std::sync::Arc;

use super::place::{along, axis_of, static_stiffness};
use super::{Effect, EffectError, Kind};
use crate::structure::{Direction, Structure};
use crate::{At, Branch, Term};

pub(super) const KIND: Kind = Kind {
    name: "backlash",
    keys: "gap_mm, stiffness_fraction and direction, or gap_mm, contact_mm and before",
    build: |parameters| {
        let gap_mm = parameters.main("gap_mm")?;
        if gap_mm < 0.0 {
            return Err(EffectError::Value {
                effect: "backlash".into(),
                found: gap_mm.to_string(),
                needed: "a gap of 0 or more",
            });
        }
        let fraction = parameters.number(
            "stiffness_fraction",
            |share| share > 0.0 && share <= 1.0,
            "a share above 0 and up to 1",
        )?;
        Ok(Arc::new(Backlash {
            half_gap_m: 0.5e-3 * gap_mm,
            fraction: fraction.unwrap_or(1.0),
            direction: parameters.direction("direction")?,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct Backlash {
    half_gap_m: f64,
    fraction: f64,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct Play {
    half_gap_m: f64,
    stiffness: f64,
    axis: usize,
}

const WITHIN: Branch = 0;
const ABOVE: Branch = 1;
const BELOW: Branch = 2;

impl Effect for Backlash {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn terms(&self, structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        let axis = axis_of(structure, self.direction, KIND.name)?;
        let stiffness = static_stiffness(structure, KIND.name)?[(axis, axis)];
        Ok(vec![Box::new(Play {
            half_gap_m: self.half_gap_m,
            stiffness: self.fraction * stiffness,
            axis,
        })])
    }
}

impl Term for Play {
    fn restoring_n(&self, branch: Branch, at: &At, _: &[f64]) -> [f64; 3] {
        let missing = match branch {
            ABOVE => self.half_gap_m,
            BELOW => -self.half_gap_m,
            _ => at.x[self.axis],
        };
        along(self.axis, -self.stiffness * missing)
    }

    fn margin(&self, branch: Branch, at: &At, _: &[f64], _: f64) -> f64 {
        let x = at.x[self.axis];
        match branch {
            ABOVE => x - self.half_gap_m,
            BELOW => -x - self.half_gap_m,
            _ => self.half_gap_m - x.abs(),
        }
    }

    fn next(&self, before: Option<Branch>, at: &At, _: &[f64], _: f64) -> Branch {
        let x = at.x[self.axis];
        match before {
            None if x > self.half_gap_m => ABOVE,
            None if x < -self.half_gap_m => BELOW,
            // The edge is reached: it goes on to the other side of it.
            Some(WITHIN) if x > 0.0 => ABOVE,
            Some(WITHIN) => BELOW,
            _ => WITHIN,
        }
    }
}
