//! Choice of the collocation method that a case requires.

use super::equivalent::EquivalentProblem;
use super::forced::ForcedProblem;
use crate::error::StabilityError;
use crate::limits::method::Method;
use crate::methods::at_each_speed::AtEachSpeed;
use crate::methods::collocation::Collocation;
use crate::methods::revolution_collocation::RevolutionCollocation;
use crate::problem::linear::{CubicTerms, Problem};
use crate::problem::pitched::Pitched;
use crate::process::speed_dependence::depends_on_speed;
use crate::process::treatment::{is_not_smooth, needs_orbit};
use quietcut_model::case::Case;

/// Collocation method that suits a case: over one tooth period; over the revolution for unequal pitch; about the forced
/// orbit if limits depend on it, with equivalent stiffness and damping of friction, backlash and hysteresis; with the
/// structure and the cutting coefficients of each spindle speed if they depend on it.
///
/// # Errors
/// The case lacks a section, is not valid, or has a feature that no collocation method treats.
pub fn collocation_of(case: &Case) -> Result<Box<dyn Method>, StabilityError> {
    Ok(if depends_on_speed(case) {
        Box::new(AtEachSpeed::new(case, collocation_of)?)
    } else if is_not_smooth(case) {
        Box::new(EquivalentProblem::new(case)?)
    } else if needs_orbit(case) {
        Box::new(ForcedProblem::new(case)?)
    } else if case.tool()?.has_variable_pitch() {
        Box::new(RevolutionCollocation {
            pitched: Pitched::new(case, CubicTerms::Refuse)?,
        })
    } else {
        Box::new(Collocation {
            problem: Problem::new(case, CubicTerms::Refuse)?,
        })
    })
}
