//! Newton's method on the extended system, with the tangent of the curve of its solutions.

use nalgebra::{DMatrix, DVector};

use super::extended::{CriticalOrbit, ExtendedSystem};

/// Size of a Newton step, or predicted size of the next one, in units of the curve, below which the iteration stops.
/// As for orbits: see [`periodic_orbit`](super::super::periodic_orbit).
const SETTLED: f64 = 1e-12;

/// Size of the preceding Newton step from which on the size of the next step is not predicted yet. A choice.
const NEAR: f64 = 1e-3;

/// Largest number of Newton steps. From a predicted orbit three to five suffice.
const NEWTON_STEPS_MAX: usize = 12;

/// Orbit on the curve, with the tangent there.
#[derive(Clone, Debug)]
pub(super) struct CurveOrbit {
    pub(super) orbit: CriticalOrbit,
    /// Unit tangent: changes of the unknowns, each divided by its unit.
    pub(super) along: DVector<f64>,
    /// Vector c of the condition cᴴ v₀ = 1 on the mode. Orbits with the same c lie on one smooth curve of unknowns.
    pub(super) phase: DVector<f64>,
    /// Number of Newton steps that the orbit took.
    pub(super) newton_steps: usize,
    /// Change of the node values per unit of arc length.
    states: Vec<DMatrix<f64>>,
    modes: Vec<DMatrix<f64>>,
}

/// Newton's method on one extended system.
pub(super) struct Corrector<'a> {
    pub(super) system: &'a ExtendedSystem<'a>,
    /// Units of the unknowns, in which the arc length of the curve is measured.
    pub(super) units: DVector<f64>,
}

impl Corrector<'_> {
    /// The guess with a mode of norm 1, and the vector c parallel to that mode.
    pub(super) fn normalized(&self, guess: &CriticalOrbit) -> (CriticalOrbit, DVector<f64>) {
        let (first, size) = (self.system.first_of_mode(), self.system.layout.size());
        let mut guess = guess.clone();
        let norm = guess.unknowns.rows(first, size).norm();
        guess.unknowns.rows_mut(first, size).unscale_mut(norm);
        for modes in &mut guess.modes {
            modes.unscale_mut(norm);
        }
        let phase = guess.unknowns.rows(first, size).into_owned();
        (guess, phase)
    }

    /// Corrects a guess on the hyperplane ⟨normal, z − z_guess⟩ = 0 of the unknowns z in their units. The mode is scaled
    /// by cᴴ v₀ = 1 with c = `phase`. The tangent is oriented along `normal`. `None` if the iteration does not
    /// settle or the equations are singular.
    ///
    /// The iteration is not that of `quietcut_numerics::newton`, for the reasons of `Orbit::correct`.
    pub(super) fn correct(
        &self,
        guess: &CriticalOrbit,
        phase: &DVector<f64>,
        normal: &DVector<f64>,
    ) -> Option<CurveOrbit> {
        let system = self.system;
        let (size, order) = (system.size(), system.order());
        let mut orbit = guess.clone();
        let mut last = f64::INFINITY;
        let mut distance = 0.0;
        for iteration in 0..NEWTON_STEPS_MAX {
            let linear = system.linearize(&orbit, phase)?;
            let mut matrix = linear.jacobian.insert_row(size - 1, 0.0);
            for (mut column, unit) in matrix.column_iter_mut().zip(self.units.iter()) {
                column *= *unit;
            }
            matrix.rows_mut(0, order).scale_mut(1.0 / self.units[0]);
            matrix.row_mut(size - 1).copy_from(&normal.transpose());
            let lu = matrix.lu();
            let mut right = -linear.residual.insert_row(size - 1, distance);
            right.rows_mut(0, order).scale_mut(1.0 / self.units[0]);
            let step = lu.solve(&right)?;
            distance += normal.dot(&step);
            let change = step.component_mul(&self.units);
            orbit.unknowns += &change;
            let of_orbit = change.rows(0, order + 2).into_owned();
            orbit.states = moved(linear.states, &linear.states_by, &of_orbit);
            orbit.modes = moved(linear.modes, &linear.modes_by, &change);
            let length = step.norm().max(linear.moved);
            if !length.is_finite() || (iteration > 2 && length > 2.0 * last) {
                return None;
            }
            if length < SETTLED || (last < NEAR && length * (length / last).powi(2) < SETTLED) {
                let mut unit = DVector::zeros(size);
                unit[size - 1] = 1.0;
                let along = lu.solve(&unit)?.normalize();
                let change = along.component_mul(&self.units);
                let of_orbit = change.rows(0, order + 2).into_owned();
                return Some(CurveOrbit {
                    states: by(&linear.states_by, &of_orbit, order),
                    modes: by(&linear.modes_by, &change, system.layout.size()),
                    orbit,
                    along,
                    phase: phase.clone(),
                    newton_steps: iteration + 1,
                });
            }
            last = length;
        }
        None
    }
}

fn by(derivatives: &[DMatrix<f64>], change: &DVector<f64>, rows: usize) -> Vec<DMatrix<f64>> {
    let shaped =
        |values: DVector<f64>| DMatrix::from_column_slice(rows, values.len() / rows, values.as_slice());
    derivatives
        .iter()
        .map(|derivatives| shaped(derivatives * change))
        .collect()
}

fn moved(
    mut values: Vec<DMatrix<f64>>,
    derivatives: &[DMatrix<f64>],
    change: &DVector<f64>,
) -> Vec<DMatrix<f64>> {
    for (values, derivatives) in values.iter_mut().zip(derivatives) {
        let rows = values.nrows();
        *values += DMatrix::from_column_slice(rows, values.ncols(), (derivatives * change).as_slice());
    }
    values
}

impl CurveOrbit {
    /// Reverses the direction of the tangent.
    pub(super) fn reverse(&mut self) {
        self.along.neg_mut();
        for by in self.states.iter_mut().chain(&mut self.modes) {
            by.neg_mut();
        }
    }

    /// The mode v₀ relative to the vector c of its condition: |cᴴ v₀|/(|c| |v₀|), 1 if both are parallel.
    pub(super) fn alignment(&self, system: &ExtendedSystem<'_>) -> f64 {
        let mode = self
            .orbit
            .unknowns
            .rows(system.first_of_mode(), system.layout.size());
        1.0 / (self.phase.norm() * mode.norm())
    }

    /// Predicted orbit at an arc length further along the tangent.
    pub(super) fn predicted(&self, length: f64, units: &DVector<f64>) -> CriticalOrbit {
        let mut orbit = self.orbit.clone();
        orbit.unknowns += self.along.component_mul(units) * length;
        for (values, by) in orbit.states.iter_mut().zip(&self.states) {
            *values += by * length;
        }
        for (values, by) in orbit.modes.iter_mut().zip(&self.modes) {
            *values += by * length;
        }
        orbit
    }

    /// Predicted orbit at an arc length further, on the cubic through an earlier orbit and this one with their tangents.
    /// It lies in the hyperplane normal to the tangent in which [`predicted`](Self::predicted) lies. If the conditions on
    /// both modes differ, the tangent alone predicts.
    pub(super) fn extrapolated(&self, before: &Self, length: f64, units: &DVector<f64>) -> CriticalOrbit {
        let scaled = |change: DVector<f64>| change.component_div(units).dot(&self.along);
        // Distance of both orbits along this tangent: the cubic has its parameter 0 at the earlier one and 1 here.
        let span = scaled(&self.orbit.unknowns - &before.orbit.unknowns);
        if span <= 0.0 || self.phase != before.phase {
            return self.predicted(length, units);
        }
        let x = 1.0 + length / span;
        let own = x * x * (3.0 - 2.0 * x);
        let by_before = x * (x - 1.0).powi(2) * span;
        let mut by_own = x * x * (x - 1.0) * span;
        let unknowns = |by_own: f64| {
            &self.orbit.unknowns * own
                + &before.orbit.unknowns * (1.0 - own)
                + (&self.along * by_own + &before.along * by_before).component_mul(units)
        };
        by_own += length - scaled(unknowns(by_own) - &self.orbit.unknowns);
        let blend = |orbit: [&Vec<DMatrix<f64>>; 2], tangent: [&Vec<DMatrix<f64>>; 2]| {
            let at = |index: usize| {
                &orbit[0][index] * own
                    + &orbit[1][index] * (1.0 - own)
                    + &tangent[0][index] * by_own
                    + &tangent[1][index] * by_before
            };
            (0..orbit[0].len()).map(at).collect()
        };
        CriticalOrbit {
            unknowns: unknowns(by_own),
            states: blend(
                [&self.orbit.states, &before.orbit.states],
                [&self.states, &before.states],
            ),
            modes: blend(
                [&self.orbit.modes, &before.orbit.modes],
                [&self.modes, &before.modes],
            ),
        }
    }
}
