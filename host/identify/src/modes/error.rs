//! Reasons why no modes are identified from receptances or records.

use quietcut_frf::rational_fit::RationalFitError;
use quietcut_model::structure::Direction;
use quietcut_numerics::eigenvalues::EigenvalueError;

/// Reason why no modes are identified from receptances or records.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModesError {
    /// No modal model can be fitted to the data; the text states the reason.
    #[error("{0}")]
    Data(String),
    /// No pole in the band is stable over the model orders, or none of the stable poles is a mode after refinement.
    #[error(
        "no pole is stable over the model order from {from_hz:.2} to {to_hz:.2} Hz ({rejected} poles were rejected); a band with a resonance, or better receptances, are needed"
    )]
    NoMode {
        /// Lowest frequency of the band, Hz.
        from_hz: f64,
        /// Highest frequency of the band, Hz.
        to_hz: f64,
        /// Number of rejected poles.
        rejected: usize,
    },
    /// There are fewer stable poles than modes requested by the user.
    #[error("{found} poles are stable over the model order, but {wanted} modes are requested")]
    Fewer {
        /// Number of stable poles.
        found: usize,
        /// Number of requested modes.
        wanted: usize,
    },
    /// A direction that is identified by itself, since no receptance between it and the others was measured, has no modes.
    #[error("the direction {axis} by itself, since no receptance couples it with the others: {error}")]
    Direction {
        /// First direction of the force.
        axis: Direction,
        /// Reason.
        error: Box<ModesError>,
    },
    /// The modal fit with this number of modes does not converge, the data do not determine its parameters, or a
    /// decomposition in it fails.
    #[error("the fit of {0} modes does not converge; fewer modes or another band are needed")]
    NotConverged(usize),
    /// The poles of the LSCF model with a common denominator cannot be computed.
    #[error(transparent)]
    Poles(#[from] EigenvalueError),
    /// The residues of the receptances at the given poles cannot be computed.
    #[error(transparent)]
    Residues(#[from] RationalFitError),
}
