//! A recorded cut, reduced.

use std::path::PathBuf;

use nalgebra::{Cholesky, DMatrix};
use num_complex::Complex64;

use super::conditions::Conditions;
use crate::baseline::Baseline;
use crate::error::DiagnoseError;
use crate::motion::recorded_cut::cut_of;
use crate::orders::reduction::{Orders, ReductionSettings};
use quietcut_recording::Recording;

/// Highest order of a prediction over that at half the sample rate: what lies above folds.
const ALIAS_FACTOR: f64 = 3.0;

/// A recorded cut as amplitudes with their errors.
pub(crate) struct ReducedCut {
    /// File of the recording.
    pub path: PathBuf,
    pub orders: Orders,
    pub conditions: Conditions,
    /// By order from 1: the matrix W with WᴴW = 2 Σ⁻¹, Σ the covariance of the amplitudes of all channels, so that real
    /// and imaginary parts of W e have unit variance.
    whiteners: Vec<DMatrix<Complex64>>,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Highest order of a prediction.
    pub highest: usize,
}

impl ReducedCut {
    /// Reduces a recording.
    ///
    /// # Errors
    /// The recording lacks a channel or a value of the cut, or is too short.
    pub(crate) fn new(baseline: &Baseline<'_>, recording: &Recording) -> Result<Self, DiagnoseError> {
        let given = recording.sidecar.cut.unwrap_or_default();
        let depth_mm = given.axial_depth_mm.ok_or_else(|| {
            recording.lacks("axial_depth_mm under [cut] in its sidecar (.toml), the axial depth of the cut")
        })?;
        let names: Vec<&str> = recording
            .channels
            .iter()
            .filter(|channel| {
                let pickup = baseline.pickup(&channel.name);
                pickup.is_some_and(|pickup| {
                    (0..3).all(|axis| pickup.weights[axis] == 0.0 || baseline.axes.contains(&axis))
                })
            })
            .map(|channel| channel.name.as_str())
            .collect();
        let settings = ReductionSettings {
            highest_hz: f64::INFINITY,
            alias_factor: ALIAS_FACTOR,
            slowest_decay_s: baseline.slowest_decay_s(),
            settled_s: 0.0,
        };
        let orders = Orders::new(recording, &names, &settings)?;
        let conditions = Conditions {
            spindle_hz: orders.angle.frequency_hz,
            depth_m: 1e-3 * depth_mm,
            cut: cut_of(baseline.case, recording)?,
            time_s: 0.5 * recording.len() as f64 / recording.sample_rate_hz,
        };
        let whiteners = whiteners(&orders).ok_or_else(|| {
            DiagnoseError::record(&recording.path, "the noise of a channel is not a number".to_owned())
        })?;
        Ok(Self {
            path: recording.path.clone(),
            highest: orders.kernel().aliases(),
            rate_hz: recording.sample_rate_hz,
            orders,
            conditions,
            whiteners,
        })
    }

    /// Number of compared values: real and imaginary parts of the amplitudes of all orders but 0, whose offset is free.
    pub(crate) fn count(&self) -> usize {
        2 * self.whiteners.len() * self.orders.channels.len()
    }

    /// Amplitudes as the reduction would find them, from Fourier coefficients of the channels.
    pub(crate) fn seen(&self, coefficients: &DMatrix<Complex64>) -> DMatrix<Complex64> {
        let columns: Vec<_> = coefficients
            .column_iter()
            .map(|column| nalgebra::DVector::from_vec(self.orders.seen(column.as_slice())))
            .collect();
        DMatrix::from_columns(&columns)
    }

    /// Amplitudes in standard deviations of their errors, in a common order of values.
    pub(crate) fn whitened(&self, amplitudes: &DMatrix<Complex64>) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.count());
        for (index, whitener) in self.whiteners.iter().enumerate() {
            let white = whitener * amplitudes.row(index + 1).transpose();
            values.extend(white.iter().flat_map(|value| [value.re, value.im]));
        }
        values
    }

    /// Directions in which all orders err together, in standard deviations.
    pub(crate) fn common_directions(&self) -> impl Iterator<Item = &DMatrix<Complex64>> {
        self.orders.common.directions.iter()
    }
}

fn whiteners(orders: &Orders) -> Option<Vec<DMatrix<Complex64>>> {
    let channels = orders.channels.len() as f64;
    let inflation = orders.common.inflation();
    orders.covariances[1..]
        .iter()
        .map(|covariance| {
            // The mean of T² exceeds the number of values, since the covariance is estimated (Hotelling).
            let freedoms = covariance.freedoms;
            let scale = 0.5 * inflation * freedoms / (freedoms - channels).max(1.0);
            let lower = Cholesky::new(&covariance.matrix * Complex64::from(scale))?.l();
            lower.try_inverse()
        })
        .collect()
}
