//! The methods that `--method` knows.

use super::Error;
use crate::case::Case;
use crate::continuation::ForcedProblem;
use crate::stability::{Collocation, CubicTerms, Method, Problem};

/// The methods that can be asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum MethodName {
    /// Collocation of the one-period map; with cubic terms about the forced orbit.
    #[default]
    Collocation,
}

impl MethodName {
    /// The method on a case; `linear` leaves out cubic terms.
    ///
    /// # Errors
    /// The method is not defined for the case.
    pub(super) fn on(self, case: &Case, linear: bool) -> Result<Box<dyn Method>, Error> {
        let has_cubic_terms = case.structure().map_err(Error::input)?.is_nonlinear() && !linear;
        match self {
            Self::Collocation if has_cubic_terms => Ok(Box::new(ForcedProblem::new(case)?)),
            Self::Collocation => Ok(Box::new(Collocation {
                problem: Problem::new(case, CubicTerms::LeaveOut)?,
            })),
        }
    }
}
