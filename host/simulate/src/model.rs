//! Equation of motion of a structure with its cut, external excitation and restoring forces.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::contact::Contact;
use super::cutting::Cutting;
use super::drive::Drive;
use quietcut_model::restoring_force::{self, Regimes};
use quietcut_model::{Dynamics, RestoringForce};

/// Equation of motion M ẍ + C ẋ + K x + f_r = F: structure, cutting force, external excitation and added restoring
/// forces f_r.
pub struct Model {
    /// Linear structure with its cubic terms, in first-order form.
    pub dynamics: Dynamics,
    /// Cutter, spindle and workpiece; `None` for a test without cutting.
    pub cutting: Option<Cutting>,
    /// External excitation force besides the cutting force; `None` if there is none.
    pub drive: Option<Box<dyn Drive>>,
    /// Restoring forces f_r besides those of the structure: friction, backlash, nonlinear springs and others.
    pub restoring_forces: Vec<Box<dyn RestoringForce>>,
}

/// Quantities that are fixed during one integration step: contact of the teeth, limits of the step, and regimes of the
/// restoring forces.
#[derive(Clone, Copy)]
pub(super) struct StepContext<'a> {
    pub(super) contact: Option<&'a Contact<'a>>,
    /// Start and end of the integration step, s, moved inwards by a rounding margin: the excitation force may jump at
    /// either.
    pub(super) within: [f64; 2],
    pub(super) regimes: Regimes<'a>,
}

impl Model {
    /// Number of states: those of [`Dynamics`], followed by the internal states of the restoring forces in their order.
    pub fn order(&self) -> usize {
        self.dynamics.order() + restoring_force::states(&self.restoring_forces)
    }

    /// Index ranges of the states that change within a step: all but the memories of restoring forces.
    pub(super) fn moving(&self) -> Vec<Range<usize>> {
        let mut from = self.dynamics.order();
        let mut moving = Vec::with_capacity(1 + self.restoring_forces.len());
        moving.push(0..from);
        for restoring_force in &self.restoring_forces {
            let to = from + restoring_force.states();
            if !restoring_force.remembers() {
                moving.push(from..to);
            }
            from = to;
        }
        moving
    }

    /// Force on the tool from cut and excitation, N, with process damping and the force drop of a shaker.
    pub(super) fn force_n(&self, context: StepContext<'_>, t: f64, x: [f64; 3], y: &[f64]) -> [f64; 3] {
        let mut force = context.contact.map_or([0.0; 3], |contact| contact.force_n(t, x));
        if let Some(drive) = &self.drive {
            let driven = drive.force_n(t.clamp(context.within[0], context.within[1]));
            for (force, driven) in force.iter_mut().zip(driven) {
                *force += driven;
            }
            let drop = drive.drop_ns_per_m();
            if drop != [0.0; 3] {
                let v = self
                    .dynamics
                    .velocity_under(&y[..self.dynamics.order()], [0.0; 3]);
                for axis in 0..3 {
                    force[axis] -= drop[axis] * v[axis];
                }
            }
        }
        match context.contact.and_then(|contact| contact.damping_ns_per_m(t, x)) {
            Some(damping) => self.damped_n(force, damping, y),
            None => force,
        }
    }

    /// Force F on the tool with process damping, N. Solves F = `force` − D v together with the velocity v = C A y + C B
    /// F of the first-order form.
    fn damped_n(&self, force: [f64; 3], damping: [[f64; 3]; 3], y: &[f64]) -> [f64; 3] {
        let v = Vector3::from(
            self.dynamics
                .velocity_under(&y[..self.dynamics.order()], [0.0; 3]),
        );
        let damping = Matrix3::from_fn(|i, j| damping[i][j]);
        let jump = self.dynamics.velocity_per_force();
        let jump = Matrix3::from_fn(|i, j| jump[i][j]);
        let free = Vector3::from(force) - damping * v;
        // D C B, by which the damping force reacts on the velocity that the force causes, is small compared with 1, so
        // that I + D C B has an inverse; without one, C B F is left out.
        (Matrix3::identity() + damping * jump)
            .lu()
            .solve(&free)
            .unwrap_or(free)
            .into()
    }

    /// Writes the derivative ẏ of the states `y` at the time `t`, s, and displacement `x`, m; returns the force on the
    /// tool from cut and excitation, N.
    pub(super) fn rate(
        &self,
        context: StepContext<'_>,
        (t, x): (f64, [f64; 3]),
        y: &[f64],
        rate: &mut [f64],
    ) -> [f64; 3] {
        let force = self.force_n(context, t, x, y);
        if self.restoring_forces.is_empty() {
            self.dynamics.rate(y, force, rate);
        } else {
            restoring_force::rate(
                &self.dynamics,
                &self.restoring_forces,
                context.regimes,
                (t, x),
                force,
                y,
                rate,
            );
        }
        force
    }
}
