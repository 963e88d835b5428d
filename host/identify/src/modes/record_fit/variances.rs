//! Variances of the noise of a record.

use nalgebra::Matrix3;
use num_complex::Complex64;
use serde::Serialize;

/// Noise that was found on a channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelNoise {
    /// The recording.
    pub recording: String,
    /// The channel.
    pub channel: String,
    /// Standard deviation of a sample, if it is white over all frequencies, SI.
    pub deviation: f64,
    /// The same in percent of the channel's root mean square.
    pub percent: f64,
}

/// Noise variances per line of one record.
#[derive(Clone, Debug)]
pub(super) struct Variances {
    /// Of the sensors of responses.
    pub(super) responses: Vec<f64>,
    /// Of what looks like noise of the forces: V_f and V_d together.
    pub(super) forces: Vec<f64>,
    /// The part that is in the measured forces: V_f; the rest is V_d.
    pub(super) measured: Vec<f64>,
    /// sⁿ H V_d Hᴴ s̄ⁿ by line, of the structure of the round before.
    pub(super) disturbance: Vec<Matrix3<Complex64>>,
}
