//! Why a simulation cannot be made or cannot go on.

use quietcut_model::ModelError;

/// What is wrong with a simulation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulateError {
    /// Equations that cannot be set up.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The tool feeds into the workpiece and its size is not known.
    #[error(
        "the tool's diameter is not known, so its way into the workpiece is not: give diameter_mm in [tool], or let the depth grow instead"
    )]
    NoDiameter,
    /// The motion left every bound.
    #[error(
        "at {time_s:.6} s the tool is displaced by {displacement_mm:.3} mm and growing: beyond that the model means nothing (a softening spring has given way, or the cut is so unstable that loss of contact does not bound it)"
    )]
    Diverged {
        /// When.
        time_s: f64,
        /// How far the tool was.
        displacement_mm: f64,
    },
    /// More steps than were allowed.
    #[error(
        "at {time_s:.6} s {steps} steps were taken, and no more are allowed: the equations are too stiff"
    )]
    TooManySteps {
        /// When.
        time_s: f64,
        /// How many.
        steps: u64,
    },
    /// A tooth that neither cuts nor leaves the surface.
    #[error(
        "at {time_s:.6} s tooth {tooth} leaves the surface the moment it touches it and touches it the moment it leaves: the edge force is too large for this structure"
    )]
    ContactUndecided {
        /// When.
        time_s: f64,
        /// Which, from 1.
        tooth: usize,
    },
    /// A term of the equation of motion that finds no branch that goes on.
    #[error(
        "at {time_s:.6} s no branch of the added terms (friction, play) goes on: two of them act against each other"
    )]
    BranchUndecided {
        /// When.
        time_s: f64,
    },
    /// A rig drives a direction that the structure does not have.
    #[error("the structure cannot be driven in {direction}: it has no such direction, or it is a rotation")]
    NoDirection {
        /// The direction.
        direction: quietcut_model::structure::Direction,
    },
}
