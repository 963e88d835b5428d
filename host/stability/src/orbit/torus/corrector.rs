//! Newton's method for a torus on a hyperplane of its unknowns, with the tangent of the branch of tori.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

use super::circle::Circle;
use super::motion::Motion;
use super::period::Steps;
use crate::orbit::forced::ForcedProblem;

/// Size of a Newton step, in units of the branch, below which the iteration stops. A choice: far below the error of the
/// steps in time.
const SETTLED: f64 = 1e-8;

/// Largest number of Newton steps. A choice: three to six suffice unless many teeth leave the surface within one step.
const NEWTON_STEPS_MAX: usize = 10;

/// Largest Newton step, in units of the branch; a longer one is shortened. A choice: a step so long is no correction.
const STEP_MAX: f64 = 0.5;

/// A torus: the states at the start of the tooth period, n × angles, the rotation ρ per tooth period, rad, and the axial
/// depth, m.
#[derive(Clone, Debug)]
pub(super) struct Torus {
    pub(super) states: DMatrix<f64>,
    pub(super) rotation: f64,
    pub(super) depth_m: f64,
}

/// A torus with the tangent of the branch.
#[derive(Clone, Debug)]
pub(super) struct Corrected {
    pub(super) torus: Torus,
    /// Unit tangent: changes of the unknowns, each divided by its unit.
    pub(super) along: DVector<f64>,
    pub(super) smallest_chip_m: f64,
    pub(super) newton_steps: usize,
}

/// Newton's method on one circle.
pub(super) struct Corrector<'a> {
    pub(super) problem: &'a ForcedProblem,
    pub(super) steps: &'a Steps,
    pub(super) circle: Circle,
    /// Unit of the state: the norm over all angles is divided by this and by the root of their number.
    pub(super) state_unit: f64,
    /// Unit of the depth, m.
    pub(super) depth_unit_m: f64,
}

impl Torus {
    /// The same torus at the angles of another circle.
    pub(super) fn onto(&self, from: Circle, to: Circle) -> Self {
        Self {
            states: &self.states * from.onto(to).transpose(),
            ..*self
        }
    }
}

impl Corrector<'_> {
    /// Number of unknowns.
    pub(super) fn size(&self) -> usize {
        self.problem.order() * self.circle.angles + 2
    }

    /// Unit of each unknown.
    pub(super) fn units(&self) -> DVector<f64> {
        let size = self.size();
        let state = self.state_unit * (self.circle.angles as f64).sqrt();
        let mut units = DVector::from_element(size, state);
        units[size - 2] = PI;
        units[size - 1] = self.depth_unit_m;
        units
    }

    /// The torus a length further along a direction.
    pub(super) fn moved(&self, torus: &Torus, along: &DVector<f64>, length: f64) -> Torus {
        let change = along.component_mul(&self.units()) * length;
        let states = torus.states.len();
        Torus {
            states: &torus.states
                + DMatrix::from_column_slice(
                    torus.states.nrows(),
                    torus.states.ncols(),
                    &change.as_slice()[..states],
                ),
            rotation: torus.rotation + change[states],
            depth_m: torus.depth_m + change[states + 1],
        }
    }

    /// Row of the condition that fixes the origin of the angle: ⟨∂x_ref/∂θ, x⟩ = 0.
    fn phase(&self, reference: &DMatrix<f64>) -> DVector<f64> {
        let [_, by_angle] = self.circle.shift(0.0);
        let slope = reference * by_angle.transpose();
        DVector::from_column_slice(slope.as_slice()).normalize()
    }

    /// Residual of x(T, θ) = x(0, θ + ρ), in units of the state, and its derivatives with respect to the unknowns in
    /// their units; and the smallest chip thickness, m.
    pub(super) fn residual(&self, torus: &Torus) -> (DVector<f64>, DMatrix<f64>, f64) {
        let motion = Motion::new(self.problem, self.circle, torus.rotation, torus.depth_m);
        let integrated = self.steps.integrate(&motion, &torus.states);
        let [shift, by_shift] = self.circle.shift(torus.rotation);
        let (order, states) = (self.problem.order(), torus.states.len());
        let residual = &integrated.end - &torus.states * shift.transpose();
        let mut by = integrated.by;
        for (row, column) in
            (0..self.circle.angles).flat_map(|i| (0..self.circle.angles).map(move |j| (i, j)))
        {
            for state in 0..order {
                by[(row * order + state, column * order + state)] -= shift[(row, column)];
            }
        }
        let turned = &torus.states * by_shift.transpose();
        let mut by_rotation = by.column_mut(states);
        by_rotation -= DVector::from_column_slice(turned.as_slice());
        let units = self.units();
        for (mut column, unit) in by.column_iter_mut().zip(units.iter()) {
            column *= *unit / units[0];
        }
        let residual = DVector::from_column_slice(residual.as_slice()) / units[0];
        (residual, by, integrated.smallest_chip_m)
    }

    /// Corrects a guess on the hyperplane through it that is normal to `normal`; `reference` fixes the origin of the angle.
    /// `None` if the iteration does not settle.
    pub(super) fn correct(
        &self,
        guess: &Torus,
        normal: &DVector<f64>,
        reference: &DMatrix<f64>,
    ) -> Option<Corrected> {
        let size = self.size();
        let states = guess.states.len();
        let phase = self.phase(reference);
        let units = self.units();
        let mut torus = guess.clone();
        let mut distance = 0.0;
        for newton_steps in 1..=NEWTON_STEPS_MAX {
            let (residual, by, smallest_chip_m) = self.residual(&torus);
            let mut matrix = by.resize_vertically(size, 0.0);
            matrix
                .view_mut((size - 2, 0), (1, states))
                .copy_from(&phase.transpose());
            matrix.row_mut(size - 1).copy_from(&normal.transpose());
            let mut right = -residual.resize_vertically(size, 0.0);
            let here = DVector::from_column_slice(torus.states.as_slice()) / units[0];
            right[size - 2] = -phase.dot(&here);
            right[size - 1] = -distance;
            let lu = matrix.lu();
            let step = lu.solve(&right)?;
            let length = step.norm();
            if !length.is_finite() {
                return None;
            }
            let share = (STEP_MAX / length).min(1.0);
            torus = self.moved(&torus, &step, share);
            distance += share * normal.dot(&step);
            if length < SETTLED {
                let mut last = DVector::zeros(size);
                last[size - 1] = 1.0;
                return Some(Corrected {
                    along: lu.solve(&last)?.normalize(),
                    torus,
                    smallest_chip_m,
                    newton_steps,
                });
            }
        }
        None
    }
}
