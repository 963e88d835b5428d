//! A spring or damper along one direction whose force follows a law of its own: f_r += law(x, v).

use super::place::{along, axis_of};
use super::{Effect, EffectError};
use crate::structure::{Direction, Structure};
use crate::{At, Branch, Slopes, Term};

/// f_r, N, from up to two coefficients, the displacement x, m, and the velocity v, m/s.
pub(super) type Law = fn([f64; 2], f64, f64) -> f64;

/// A force that depends on displacement and velocity along one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalForce {
    /// The effect's name.
    pub(super) name: &'static str,
    /// What the law takes; a law of one coefficient leaves the second at 0.
    pub(super) coefficients: [f64; 2],
    pub(super) law: Law,
    /// ∂f_r/∂x and ∂f_r/∂v of the law.
    pub(super) slopes: fn([f64; 2], f64, f64) -> [f64; 2],
    /// Where it acts; `None` for the only direction of a structure.
    pub(super) direction: Option<Direction>,
}

#[derive(Debug)]
struct Force {
    coefficients: [f64; 2],
    law: Law,
    slopes: fn([f64; 2], f64, f64) -> [f64; 2],
    axis: usize,
}

impl Effect for LocalForce {
    fn name(&self) -> &'static str {
        self.name
    }

    fn terms(&self, structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        Ok(vec![Box::new(Force {
            coefficients: self.coefficients,
            law: self.law,
            slopes: self.slopes,
            axis: axis_of(structure, self.direction, self.name)?,
        })])
    }
}

impl Term for Force {
    fn restoring_n(&self, _: Branch, at: &At, _: &[f64]) -> [f64; 3] {
        let force = (self.law)(self.coefficients, at.x[self.axis], at.v[self.axis]);
        along(self.axis, force)
    }

    fn slopes(&self, at: &At) -> Option<Slopes> {
        let [by_x, by_v] = (self.slopes)(self.coefficients, at.x[self.axis], at.v[self.axis]);
        let mut slopes = Slopes::default();
        slopes.stiffness[self.axis][self.axis] = by_x;
        slopes.damping[self.axis][self.axis] = by_v;
        Some(slopes)
    }
}
