//! A spring or damper along one direction with a force law: f_r += law(x, v).

use num_complex::Complex64;

use super::location::{along, axis_of};
use super::{DescribingFunction, Effect, EffectError, EffectName, Harmonic};
use crate::structure::{Direction, Structure};
use crate::{MotionState, Regime, RestoringForce, Slopes};

/// Force law: f_r, N, from up to two coefficients, the displacement x, m, and the velocity v, m/s.
pub(super) type Law = fn([f64; 2], f64, f64) -> f64;

/// A force that depends on displacement and velocity along one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalForce {
    /// The effect.
    pub(super) id: EffectName,
    /// The coefficients of the force law along one direction, such as k3; the second is 0 if the law has only one.
    pub(super) coefficients: [f64; 2],
    pub(super) law: Law,
    /// Derivatives ∂f_r/∂x, N/m, and ∂f_r/∂v, N s/m, of the force law.
    pub(super) slopes: fn([f64; 2], f64, f64) -> [f64; 2],
    /// True if a derivative of the force law jumps at zero velocity, as the second derivative of c2·|v|·v does.
    pub(super) bends_at_rest: bool,
    /// Direction of the force; `None` means the only axis of the structure.
    pub(super) direction: Option<Direction>,
}

#[derive(Debug)]
struct ForceAlongAxis {
    coefficients: [f64; 2],
    law: Law,
    slopes: fn([f64; 2], f64, f64) -> [f64; 2],
    describing_function: Option<DescribingFunction>,
    bends_at_rest: bool,
    axis: usize,
}

/// Regime of positive velocity; also the only regime of a force with `bends_at_rest` false.
const FORWARD: Regime = 0;
const BACKWARD: Regime = 1;

impl Effect for LocalForce {
    fn id(&self) -> EffectName {
        self.id
    }

    fn restoring_forces(&self, structure: &Structure) -> Result<Vec<Box<dyn RestoringForce>>, EffectError> {
        Ok(vec![Box::new(ForceAlongAxis {
            coefficients: self.coefficients,
            law: self.law,
            slopes: self.slopes,
            describing_function: self.id.spec().describing_function,
            bends_at_rest: self.bends_at_rest,
            axis: axis_of(structure, self.direction, self.id.name())?,
        })])
    }
}

impl RestoringForce for ForceAlongAxis {
    fn restoring_n(&self, _: Regime, at: &MotionState, _: &[f64]) -> [f64; 3] {
        let force = (self.law)(self.coefficients, at.x[self.axis], at.v[self.axis]);
        along(self.axis, force)
    }

    fn slopes(&self, at: &MotionState) -> Option<Slopes> {
        let [by_x, by_v] = (self.slopes)(self.coefficients, at.x[self.axis], at.v[self.axis]);
        let mut slopes = Slopes::default();
        slopes.stiffness[self.axis][self.axis] = by_x;
        slopes.damping[self.axis][self.axis] = by_v;
        Some(slopes)
    }

    fn describing_function(&self, amplitude_m: f64, omega: f64) -> Option<Complex64> {
        let [first, second] = self.describing_function?(Harmonic::new(amplitude_m, omega));
        Some(self.coefficients[0] * first + self.coefficients[1] * second)
    }

    /// Ends a regime where the velocity changes its sign, if a derivative of the force law jumps there: an integration
    /// step over that jump has an error that the step's error estimate does not contain.
    fn margin(&self, regime: Regime, at: &MotionState, _: &[f64], _: f64) -> f64 {
        match regime {
            _ if !self.bends_at_rest => f64::INFINITY,
            BACKWARD => -at.v[self.axis],
            _ => at.v[self.axis],
        }
    }

    fn next(&self, before: Option<Regime>, at: &MotionState, _: &[f64], _: f64) -> Regime {
        match before {
            Some(FORWARD) => BACKWARD,
            None if self.bends_at_rest && at.v[self.axis] < 0.0 => BACKWARD,
            _ => FORWARD,
        }
    }
}
