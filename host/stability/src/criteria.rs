//! Every threshold by which this crate decides, with where its number comes from.

/// The least error that is ever stated, relative to max(1, |μ|): what has been checked against independent
/// computations. Collocation itself settles at 1e-10 and below.
pub const LEAST_ERROR: f64 = 1e-7;

/// Error of a multiplier that the multipliers of the collocated map gave and Newton did not confirm, relative to
/// max(1, |μ|): ten times the residual with which Krylov spaces settle.
pub(crate) const UNCONFIRMED: f64 = 1e-6;
