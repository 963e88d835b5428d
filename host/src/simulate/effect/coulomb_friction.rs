//! Dry friction: f_r += fc·sign(v); at rest it holds whatever is within ±fc.

use std::sync::Arc;

use super::place::{along, axis_of};
use super::{Effect, EffectError, Kind};
use crate::simulate::{At, Branch, Term};
use crate::structure::{Direction, Structure};

pub(super) const KIND: Kind = Kind {
    name: "coulomb-friction",
    keys: "fc_n, fc_minus_n (against negative velocity, where it differs) and direction",
    build: |parameters| {
        let plus_n = parameters.main("fc_n")?;
        let minus_n = parameters.finite("fc_minus_n")?.unwrap_or(plus_n);
        if plus_n < 0.0 || minus_n < 0.0 {
            return Err(EffectError::Value {
                effect: "coulomb-friction".into(),
                found: plus_n.min(minus_n).to_string(),
                needed: "a force of 0 or more",
            });
        }
        Ok(Arc::new(CoulombFriction {
            plus_n,
            minus_n,
            direction: parameters.direction("direction")?,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct CoulombFriction {
    plus_n: f64,
    minus_n: f64,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct Friction {
    plus_n: f64,
    minus_n: f64,
    axis: usize,
}

const STICKS: Branch = 0;
const FORWARD: Branch = 1;
const BACKWARD: Branch = 2;

impl Effect for CoulombFriction {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn terms(&self, structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        let axis = axis_of(structure, self.direction, KIND.name)?;
        Ok(vec![Box::new(Friction {
            plus_n: self.plus_n,
            minus_n: self.minus_n,
            axis,
        })])
    }
}

impl Term for Friction {
    fn restoring_n(&self, branch: Branch, _: &At, _: &[f64]) -> [f64; 3] {
        let force = match branch {
            FORWARD => self.plus_n,
            BACKWARD => -self.minus_n,
            _ => 0.0,
        };
        along(self.axis, force)
    }

    fn holds(&self) -> Option<usize> {
        Some(self.axis)
    }

    fn locked(&self, branch: Branch) -> bool {
        branch == STICKS
    }

    fn margin(&self, branch: Branch, at: &At, _: &[f64], holding_n: f64) -> f64 {
        match branch {
            FORWARD => at.v[self.axis],
            BACKWARD => -at.v[self.axis],
            _ => (self.plus_n - holding_n).min(self.minus_n + holding_n),
        }
    }

    fn next(&self, before: Option<Branch>, at: &At, _: &[f64], holding_n: f64) -> Branch {
        let moving = before.is_none() && at.v[self.axis] != 0.0;
        // A hair beyond the limit still counts as held: the end of sticking is found there to rounding only.
        let beyond = if before == Some(STICKS) { -1e-9 } else { 0.0 };
        if moving {
            if at.v[self.axis] > 0.0 { FORWARD } else { BACKWARD }
        } else if holding_n > self.plus_n * (1.0 + beyond) {
            FORWARD
        } else if holding_n < -self.minus_n * (1.0 + beyond) {
            BACKWARD
        } else {
            STICKS
        }
    }
}
