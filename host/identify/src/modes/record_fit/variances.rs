//! Noise variances of the channels of a record.

use nalgebra::Matrix3;
use num_complex::Complex64;
use serde::Serialize;

/// Estimated noise of a channel; for a force it includes unmeasured forces.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelNoise {
    /// Path of the recording.
    pub recording: String,
    /// Name of the channel.
    pub channel: String,
    /// Standard deviation of the channel's noise in one sample, SI unit, if the noise is white up to half the sample
    /// rate.
    pub deviation: f64,
    /// Standard deviation of the noise in percent of the RMS of the channel.
    pub percent: f64,
}

/// Noise variances of the channels of one record, in each frequency line of their transforms.
#[derive(Clone, Debug)]
pub(super) struct Variances {
    /// Noise variances of the responses, by response channel of the record.
    pub(super) responses: Vec<f64>,
    /// Apparent noise variances of the forces, V_f + V_d, by force channel of the record: V_f of measurement noise and
    /// V_d of unmeasured forces.
    pub(super) forces: Vec<f64>,
    /// Variances V_f of the measurement noise of the forces, by force channel of the record; the rest of the apparent
    /// noise `forces` is V_d of unmeasured forces.
    pub(super) measured: Vec<f64>,
    /// Covariance sⁿ H V_d Hᴴ s̄ⁿ of the responses to unmeasured forces at each line, with the structure's FRF H of the
    /// previous round.
    pub(super) disturbance: Vec<Matrix3<Complex64>>,
}
