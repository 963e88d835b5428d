//! Errors of stability computations.

use std::path::PathBuf;

use quietcut_frf::FrfError;
use quietcut_model::ModelError;
use quietcut_model::case::CaseError;
use quietcut_model::cutting_load::LoadError;
use quietcut_model::structure::StructureError;
use quietcut_numerics::eigenvalues::EigenvalueError;

/// Reason why stability cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// The case cannot be used, for example because it lacks a section, or has an extension that linear stability
    /// cannot treat.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The matrices or modes of the structure are invalid.
    #[error("{}: {cause}", path.display())]
    Structure {
        /// The case file.
        path: PathBuf,
        /// Reason from the structure.
        cause: StructureError,
    },
    /// An extension has invalid keys or values, or cannot be applied to the case.
    #[error("{}: {cause}", path.display())]
    Extension {
        /// The case file.
        path: PathBuf,
        /// Reason, from the model of the extension's effect.
        cause: Box<ModelError>,
    },
    /// The torque or power of the cut cannot be computed.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The method does not cover a feature of the case.
    #[error("{}: {what}", path.display())]
    NotCovered {
        /// The case file.
        path: PathBuf,
        /// Feature of the case that the method does not cover, and what to do instead.
        what: &'static str,
    },
    /// A mode has zero, almost zero or negative damping, so that its receptance is infinite or meaningless.
    #[error(
        "a mode of {frequency_hz:.4} Hz has no damping: its receptance is infinite there; damping is needed, or a method \
         that does not go through receptances"
    )]
    Undamped {
        /// Frequency of the mode, Hz.
        frequency_hz: f64,
    },
    /// The structure does not allow mode coupling.
    #[error(
        "mode coupling is not defined here: {found}; two modes that move the tool in feed and normal direction are needed"
    )]
    NoModeCoupling {
        /// Reason: number or direction of the modes.
        found: &'static str,
    },
    /// A table of frequency response functions is invalid.
    #[error(transparent)]
    Frf(#[from] FrfError),
    /// The table of receptances ends at a frequency at which the loop gain at the requested depth is still 1 or more.
    #[error(
        "depths from {deepest_mm:.3} mm on cannot be judged, and {depth_mm} mm was asked for: the frequency response \
         functions end at {last_hz} Hz, where the gain of the loop then reaches 1; measure to higher frequencies, or ask \
         for less depth"
    )]
    EndsEarly {
        /// Requested axial depth, mm.
        depth_mm: f64,
        /// Axial depth up to which the table of receptances suffices, mm.
        deepest_mm: f64,
        /// Last frequency of the table of receptances, Hz.
        last_hz: f64,
    },
    /// The cut vibrates at a frequency outside the range of the table of receptances.
    #[error(
        "at {rpm} rev/min and {depth_mm:.4} mm the cut vibrates at {frequency_hz:.3} Hz, but the frequency response \
         functions were measured from {first_hz} to {last_hz} Hz only; measure there too, or ask for less depth"
    )]
    NotMeasured {
        /// Spindle speed, rev/min.
        rpm: f64,
        /// Axial depth, mm.
        depth_mm: f64,
        /// Frequency of the vibration, Hz.
        frequency_hz: f64,
        /// First frequency of the table of receptances, Hz.
        first_hz: f64,
        /// Last frequency of the table of receptances, Hz.
        last_hz: f64,
    },
    /// More than a fifth of the machines drawn from the standard deviations of the case are not physical.
    #[error(
        "{}: with its deviations (keys that end in _std) {percent:.0} % of the machines are impossible: a damping ratio \
         or a frequency below 0, or indefinite matrices; smaller deviations are needed (the first one: {reason})",
        path.display()
    )]
    Deviations {
        /// The case file.
        path: PathBuf,
        /// Percentage of drawn machines that are not physical.
        percent: f64,
        /// Reason why the first of the machines that are not physical is impossible.
        reason: String,
    },
    /// An argument out of range, such as a speed or a depth.
    #[error("{quantity} {value}: {expected} is needed")]
    Argument {
        /// Name of the quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Description of valid values.
        expected: &'static str,
    },
    /// The numerical computation failed.
    #[error("at {rpm} rev/min and {depth_mm} mm the computation broke down: {what}")]
    BrokeDown {
        /// Spindle speed, rev/min.
        rpm: f64,
        /// Axial depth, mm.
        depth_mm: f64,
        /// Reason of the failure.
        what: &'static str,
    },
    /// The eigenvalues of a period map or of a loop of receptances cannot be computed.
    #[error("at {rpm} rev/min and {depth_mm} mm the computation broke down: {cause}")]
    Eigenvalues {
        /// Spindle speed, rev/min.
        rpm: f64,
        /// Axial depth, mm.
        depth_mm: f64,
        /// Reason from the eigenvalue iteration.
        cause: EigenvalueError,
    },
}

/// Text for the error that the equations over a period have no finite solution.
pub(crate) const NO_SOLUTION: &str = "the equations of the period have no finite solution";

/// Text for the error that a limit is not confirmed on a finer mesh.
pub(crate) const NO_FINER: &str = "a finer mesh has no Floquet multiplier near that of the limit";

/// Text for the error that receptances are infinite or not a number.
pub(crate) const NOT_FINITE: &str = "receptances are not finite";

/// Text for the error that no method finds the dominant multiplier.
pub(crate) const NO_DOMINANT: &str = "motions grow beyond the range of numbers, or Floquet multipliers of nearly one size are too many to tell apart";

/// Reason why Floquet multipliers, or roots of a loop, cannot be computed at one speed and depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Breakdown {
    /// A linear system is singular, a result is not finite, or no solution is found.
    NoSolution,
    /// Block Arnoldi does not converge on a map too large for all eigenvalues.
    TooManyMultipliers,
    /// The eigenvalue iteration of a matrix failed.
    Eigenvalues(EigenvalueError),
}

impl From<EigenvalueError> for Breakdown {
    fn from(cause: EigenvalueError) -> Self {
        // A matrix that is not finite comes from equations without a finite solution: that reason is stated.
        match cause {
            EigenvalueError::NotFinite { .. } => Self::NoSolution,
            _ => Self::Eigenvalues(cause),
        }
    }
}

impl Breakdown {
    /// Error at a spindle speed (rev/min) and an axial depth (mm); `no_solution` is its text for
    /// [`NoSolution`](Self::NoSolution).
    pub(crate) fn at(self, rpm: f64, depth_mm: f64, no_solution: &'static str) -> StabilityError {
        let what = match self {
            Self::NoSolution => no_solution,
            Self::TooManyMultipliers => "Floquet multipliers of nearly one size are too many to tell apart",
            Self::Eigenvalues(cause) => return StabilityError::Eigenvalues { rpm, depth_mm, cause },
        };
        StabilityError::BrokeDown { rpm, depth_mm, what }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_multipliers_name_the_iteration_or_the_equations() {
        let iteration = EigenvalueError::NotConverged {
            size: 120,
            iterations: 3600,
        };
        let error = Breakdown::from(iteration).at(900.0, 2.0, NO_SOLUTION).to_string();
        assert!(
            error.contains("900 rev/min") && error.contains("3600 iterations"),
            "{error}"
        );
        let overflow = EigenvalueError::NotFinite { size: 120 };
        let error = Breakdown::from(overflow).at(900.0, 2.0, NO_SOLUTION).to_string();
        assert!(error.contains(NO_SOLUTION), "{error}");
    }
}
