//! The cubic matrices of a structure as a restoring force f_r = C₃ v∘³ + K₃ x∘³, with the cubes of each velocity v and
//! displacement x of the tool.

use quietcut_model::structure::{CubicForce, Structure};
use quietcut_simulate::{MotionState, Regime, RestoringForce};

#[derive(Debug)]
struct CubicTerm(CubicForce);

/// The restoring force of the cubic matrices of a structure along x, y and z; `None` without such matrices.
pub(crate) fn cubic_term(structure: &Structure) -> Option<Box<dyn RestoringForce>> {
    Some(Box::new(CubicTerm(CubicForce::along_axes(structure)?)))
}

impl RestoringForce for CubicTerm {
    fn restoring_n(&self, _: Regime, at: &MotionState, _: &[f64]) -> [f64; 3] {
        let mut force = [0.0; 3];
        for (force, cubic) in force.iter_mut().zip(self.0.at(&at.x, &at.v)) {
            *force = cubic;
        }
        force
    }
}
