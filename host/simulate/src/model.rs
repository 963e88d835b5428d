//! The equation of motion of a machine with its cut.

use nalgebra::{Matrix3, Vector3};

use super::contact::Contact;
use super::cutting::Cutting;
use super::drive::Drive;
use quietcut_model::term::{self, Branches};
use quietcut_model::{Dynamics, Term};

/// A machine, and what happens to it.
pub struct Model {
    /// The structure.
    pub dynamics: Dynamics,
    /// The cut; `None` where no tool turns.
    pub cutting: Option<Cutting>,
    /// A force from outside, besides that of the cut.
    pub drive: Option<Box<dyn Drive>>,
    /// What the equation of motion has besides the structure.
    pub terms: Vec<Box<dyn Term>>,
}

/// What holds on a smooth stretch of the motion.
#[derive(Clone, Copy)]
pub(super) struct Stretch<'a> {
    pub(super) contact: Option<&'a Contact<'a>>,
    /// The ends of the stretch, shortened by rounding: a drive may jump at either.
    pub(super) within: [f64; 2],
    pub(super) branches: Branches<'a>,
}

impl Model {
    /// Number of states: those of [`Dynamics`], and behind them those of the terms in their order.
    pub fn order(&self) -> usize {
        self.dynamics.order() + term::states(&self.terms)
    }

    /// Force on the tool from cut and drive, N.
    pub(super) fn force_n(&self, stretch: Stretch<'_>, t: f64, x: [f64; 3], y: &[f64]) -> [f64; 3] {
        let mut force = stretch.contact.map_or([0.0; 3], |contact| contact.force_n(t, x));
        if let Some(drive) = &self.drive {
            let driven = drive.force_n(t.clamp(stretch.within[0], stretch.within[1]));
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
        match stretch.contact.and_then(|contact| contact.damping_ns_per_m(t, x)) {
            Some(damping) => self.damped_n(force, damping, y),
            None => force,
        }
    }

    /// F with F = `force` − D v, v = C A x + C B F: where the velocity feels the force itself, both are solved for.
    fn damped_n(&self, force: [f64; 3], damping: [[f64; 3]; 3], y: &[f64]) -> [f64; 3] {
        let v = Vector3::from(
            self.dynamics
                .velocity_under(&y[..self.dynamics.order()], [0.0; 3]),
        );
        let damping = Matrix3::from_fn(|i, j| damping[i][j]);
        let jump = self.dynamics.velocity_per_force();
        let jump = Matrix3::from_fn(|i, j| jump[i][j]);
        let free = Vector3::from(force) - damping * v;
        // Damping over a tool without inertia is small beside 1: the matrix is regular.
        (Matrix3::identity() + damping * jump)
            .lu()
            .solve(&free)
            .unwrap_or(free)
            .into()
    }

    /// ẏ at `t` with the tool at `x`; the force on the tool from cut and drive, N.
    pub(super) fn rate(
        &self,
        stretch: Stretch<'_>,
        (t, x): (f64, [f64; 3]),
        y: &[f64],
        rate: &mut [f64],
    ) -> [f64; 3] {
        let force = self.force_n(stretch, t, x, y);
        if self.terms.is_empty() {
            self.dynamics.rate(y, force, rate);
        } else {
            term::rate(
                &self.dynamics,
                &self.terms,
                stretch.branches,
                (t, x),
                force,
                y,
                rate,
            );
        }
        force
    }
}
