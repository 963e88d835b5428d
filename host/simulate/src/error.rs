//! Errors of the simulation.

use quietcut_model::ModelError;

/// A simulation that cannot be set up or cannot continue.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulateError {
    /// The machine model cannot be assembled: see [`ModelError`].
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The tool diameter is missing, which entry through a face of the workpiece and porous material require.
    #[error(
        "the tool's diameter is not known, so its way into the workpiece is not: give diameter_mm in [tool], or let the depth grow instead"
    )]
    NoDiameter,
    /// The displacement of the tool, or another state of the structure converted into one, exceeded the bound
    /// [`super::Settings::largest_m`], or no integration step above the rounding of the time has an error within the
    /// tolerance.
    #[error(
        "at {time_s:.6} s the tool is displaced by {displacement_mm:.3} mm and growing: beyond that the model means nothing (a softening spring has given way, or the cut is so unstable that loss of contact does not bound it)"
    )]
    Diverged {
        /// Simulated time at which the run stopped, s.
        time_s: f64,
        /// Largest state of the structure, converted into a displacement of the tool, mm.
        displacement_mm: f64,
    },
    /// The integration took more steps, accepted and rejected, than [`super::Settings::steps_max`].
    #[error(
        "at {time_s:.6} s {steps} steps were taken, and no more are allowed: the equations are too stiff"
    )]
    TooManySteps {
        /// Simulated time at which the run stopped, s.
        time_s: f64,
        /// Number of accepted and rejected integration steps when the run stopped.
        steps: u64,
    },
    /// A tooth that can neither keep nor lose contact (chattering events).
    #[error(
        "at {time_s:.6} s tooth {tooth} leaves the surface the moment it touches it and touches it the moment it leaves: the edge force is too large for this structure"
    )]
    ContactUndecided {
        /// Simulated time at which the run stopped, s.
        time_s: f64,
        /// Number of the tooth, from 1.
        tooth: usize,
    },
    /// Restoring forces without a consistent regime, such as two friction forces that act against each other.
    #[error(
        "at {time_s:.6} s no regime of the restoring forces (friction, backlash) is consistent with the motion: two of them act against each other"
    )]
    RegimeUndecided {
        /// Simulated time at which the run stopped, s.
        time_s: f64,
    },
    /// A rig drives a direction that the structure does not have, or a rotation.
    #[error("the structure cannot be driven in {direction}: it has no such direction, or it is a rotation")]
    NoDirection {
        /// Direction of the excitation force.
        direction: quietcut_model::structure::Direction,
    },
}
