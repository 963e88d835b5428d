//! One channel of a record: its measured samples and their prediction by the baseline.

use nalgebra::Matrix3;
use num_complex::Complex64;

use crate::baseline::derivatives;
use quietcut_simulate::effect::Pickup;

/// A measured channel of a record with the samples that the baseline predicts.
#[derive(Clone, Debug)]
pub(crate) struct Observed {
    /// The quantity, axes, delay, dynamics and modes of the sensor.
    pub pickup: Pickup,
    /// Measured samples of the channel, in its SI unit.
    pub measured: Vec<f64>,
    /// Samples that the baseline predicts for the channel along the measured motion, free decay included, in its SI
    /// unit.
    pub predicted: Vec<f64>,
    /// Standard deviation of the channel's white noise, in its SI unit.
    pub deviation: f64,
    /// Time over which a reading of the channel averages, s: one sampling interval for accelerations if a force step
    /// makes the velocity jump, otherwise zero.
    pub(super) mean_s: f64,
    /// Receptance of the baseline at the sensor, m/N, by frequency bin, if the baseline has mode shapes there;
    /// otherwise `None`: see [`Record::seen_by`](super::record::Record::seen_by).
    pub(super) seen: Option<Vec<Matrix3<Complex64>>>,
}

impl Observed {
    /// Residual of the channel: measured samples minus those that the baseline predicts.
    pub(crate) fn residual(&self) -> Vec<f64> {
        self.measured
            .iter()
            .zip(&self.predicted)
            .map(|(a, b)| a - b)
            .collect()
    }

    /// Transfer function at ω, rad/s, from the displacement at the sensor to the reading of this channel, without the
    /// channel's axis weights: (iω)^q e^(−iωτ) S(iω) sinc(ωT/2), where q is the number of derivatives, τ the delay, S
    /// the dynamics of the sensor and T the averaging time.
    pub(crate) fn factor(&self, omega: f64) -> Complex64 {
        let half = 0.5 * omega * self.mean_s;
        let mean = if half == 0.0 { 1.0 } else { half.sin() / half };
        Complex64::new(0.0, omega).powi(derivatives(self.pickup.quantity))
            * Complex64::cis(-omega * self.pickup.delay_s)
            * self.pickup.dynamics(Complex64::new(0.0, omega))
            * mean
    }
}

/// The axis with the largest |weight| in a channel; `None` if all weights are zero.
pub(crate) fn main_axis(channel: &Observed) -> Option<usize> {
    (0..3)
        .filter(|axis| channel.pickup.weights[*axis] != 0.0)
        .max_by(|a, b| {
            channel.pickup.weights[*a]
                .abs()
                .total_cmp(&channel.pickup.weights[*b].abs())
        })
}
