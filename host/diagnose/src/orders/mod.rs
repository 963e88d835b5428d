//! A recorded cut reduced to its orders: complex amplitudes of all channels at the multiples of the spindle frequency,
//! with the covariance of their errors, and what is not synchronous with the spindle.
//!
//! | module | |
//! |---|---|
//! | `smoothing_spline`, `spindle_angle` | spindle angle of each sample from the tachometer |
//! | `speed_from_orders` | spindle frequency without a tachometer |
//! | `circle`, `taper`, `alias_kernel` | Fourier sums over the angle, weights of the samples, least squares and aliasing |
//! | `reduction`, `channel_reduction` | the entry, [`reduction::Orders`], and its work on one channel |
//! | `between_lines`, `block_noise`, `common`, `distance` | covariance of the amplitudes and distances measured by it |
//! | `trend` | slow changes of the orders |
//! | `asynchronous` | spectrum of the residual and its lines |
//!
//! Convention: y = Y_0 + 2 Re Σ_{k≥1} Y_k e^{ikθ}, θ = 0 at immersion angle 0 of tooth 1, growing with time.

pub(crate) mod alias_kernel;
pub(crate) mod asynchronous;
mod between_lines;
mod block_noise;
mod channel_reduction;
pub(crate) mod circle;
pub(crate) mod common;
pub(crate) mod distance;
pub(crate) mod followed;
pub(crate) mod reduction;
mod smoothing_spline;
pub(crate) mod speed_from_orders;
pub(crate) mod spindle_angle;
mod taper;
#[cfg(test)]
mod tests;
pub(crate) mod trend;
