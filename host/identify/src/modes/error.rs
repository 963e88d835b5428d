//! Why no modes come out.

/// Why no modes come out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModesError {
    /// Nothing to fit.
    #[error("{0}")]
    Data(String),
    /// No pole came again from order to order.
    #[error(
        "no pole is stable over the orders of the model from {from_hz:.2} to {to_hz:.2} Hz ({rejected} poles were rejected); a band with a resonance, or better receptances, are needed"
    )]
    NoMode {
        /// First frequency, Hz.
        from_hz: f64,
        /// Last frequency, Hz.
        to_hz: f64,
        /// Poles that were looked at.
        rejected: usize,
    },
    /// Other than the wanted number of modes.
    #[error("{found} poles are stable over the orders of the model, but {wanted} modes are asked for")]
    Fewer {
        /// Modes found.
        found: usize,
        /// Modes wanted.
        wanted: usize,
    },
    /// The fit broke down.
    #[error("the fit of {0} modes does not converge; fewer modes or another band are needed")]
    NotConverged(usize),
}
