//! A recorded cut, reduced.

use std::path::PathBuf;

use nalgebra::{Cholesky, DMatrix};
use num_complex::Complex64;

use super::conditions::Conditions;
use crate::baseline::{Baseline, derivatives};
use crate::error::DiagnoseError;
use crate::motion::recorded_cut::cut_of;
use crate::orders::reduction::{Orders, ReductionSettings};
use crate::orders::spindle_angle::SpindleAngle;
use crate::signal::noise::rms;
use quietcut_model::structure::FirstOrder;
use quietcut_numerics::eigenvalues::eigenvector;
use quietcut_recording::{Quantity, Recording};

/// Range of the highest order of a prediction over that at half the sample rate. Jumps of the force have orders far
/// above, which fold; each unit takes one cell of the spectrum between two lines, of as many cells as there are
/// revolutions, from the estimate of the noise.
const ALIAS_FACTOR: [f64; 2] = [2.0, 8.0];
/// Slope of the size of the orders over time, in standard deviations, from which on they change: noise exceeds it in one
/// of 400 records.
const TREND: f64 = 3.0;
/// Time after which a record is taken as settled, in slowest decays of the structure, and at most this share of it. What
/// is left of the free decay is fitted.
const SETTLED_DECAYS: f64 = 3.0;
const SETTLED_SHARE: f64 = 0.25;
/// Share of the cells between two lines that aliases may take.
const ALIASED_CELLS: f64 = 0.25;

/// A recorded cut as amplitudes with their errors.
pub(crate) struct ReducedCut {
    /// File of the recording.
    pub path: PathBuf,
    pub orders: Orders,
    pub conditions: Conditions,
    /// By order from 1: the matrix W with WᴴW = 2 Σ⁻¹, Σ the covariance of the amplitudes of all channels, so that real
    /// and imaginary parts of W e have unit variance.
    whiteners: Vec<DMatrix<Complex64>>,
    /// What free decays of the modes leave in the orders, real and imaginary part of each mode, as large at the start of
    /// the record as the motion.
    decays: Vec<DMatrix<Complex64>>,
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
        let duration_s = recording.len() as f64 / recording.sample_rate_hz;
        let settled_s = (SETTLED_DECAYS * baseline.slowest_decay_s()).min(SETTLED_SHARE * duration_s);
        let angle = SpindleAngle::new(recording, settled_s)?;
        let [least, most] = ALIAS_FACTOR;
        let settings = ReductionSettings {
            highest_hz: f64::INFINITY,
            alias_factor: (ALIASED_CELLS * angle.count() as f64).clamp(least, most),
            slowest_decay_s: baseline.slowest_decay_s(),
            settled_s,
        };
        let orders = Orders::with_angle(recording, &names, angle, &settings)?;
        let decays = decays(baseline, recording, &orders, &settings);
        let conditions = Conditions {
            spindle_hz: orders.angle.frequency_hz,
            depth_m: 1e-3 * depth_mm,
            cut: cut_of(baseline.case, recording)?,
            time_s: 0.5 * recording.len() as f64 / recording.sample_rate_hz,
        };
        let whiteners = whiteners(&orders).ok_or_else(|| {
            DiagnoseError::record(
                &recording.path,
                "the noise of a channel is not a number".to_owned(),
            )
        })?;
        Ok(Self {
            path: recording.path.clone(),
            highest: orders.kernel().aliases(),
            rate_hz: recording.sample_rate_hz,
            orders,
            conditions,
            whiteners,
            decays,
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

    /// True if the orders change over the record by more than noise: in any way, or all in proportion to each other and
    /// to time.
    pub(crate) fn changes(&self) -> bool {
        !self.orders.common.directions.is_empty() || self.trend() > TREND
    }

    /// Slope over time of the size of the amplitudes, in standard deviations of its error; 0 if the record is too short
    /// for one.
    ///
    /// The size of block b is a_b = Re⟨Y, Y_b⟩/⟨Y, Y⟩ in the metric of the covariance, with the variance
    /// q/⟨Y, Y⟩, q the variance of an amplitude of a block over that of the record. Every second block is taken: these do
    /// not overlap.
    fn trend(&self) -> f64 {
        let blocks: Vec<_> = self.orders.blocks.iter().step_by(2).collect();
        let [first, .., last] = blocks.as_slice() else {
            return 0.0;
        };
        let white = self.whitened(&self.orders.amplitudes);
        let energy: f64 = white.iter().map(|value| value * value).sum();
        let sizes: Vec<f64> = blocks
            .iter()
            .map(|block| {
                let of_block = self.whitened(&block.amplitudes);
                of_block
                    .iter()
                    .zip(&white)
                    .map(|(block, whole)| block * whole)
                    .sum::<f64>()
                    / energy
            })
            .collect();
        let length = (last.centre_s - first.centre_s) / (blocks.len() - 1) as f64 * self.rate_hz;
        // Hann's weights of a block have the variance 3/2 over its length.
        let of_block = 1.5 / length / self.orders.variance_of_mean();
        let mean_s = blocks.iter().map(|block| block.centre_s).sum::<f64>() / blocks.len() as f64;
        let (mut slope, mut squares) = (0.0, 0.0);
        for (block, size) in blocks.iter().zip(&sizes) {
            let t = block.centre_s - mean_s;
            slope += t * size;
            squares += t * t;
        }
        slope.abs() / (squares * of_block / energy).sqrt()
    }

    /// True if a spectral line of a channel of motion that is no order exceeds the share `least` of the largest order.
    pub(crate) fn chatters(&self, least: f64) -> bool {
        self.orders.lines.iter().any(|line| {
            let is_motion = !self.orders.channels[line.channel].starts_with('f');
            let orders = self.orders.amplitudes.column(line.channel);
            let largest = orders
                .iter()
                .skip(1)
                .map(|amplitude| 2.0 * amplitude.norm())
                .fold(0.0, f64::max);
            is_motion && line.amplitude > least * largest
        })
    }

    /// Directions in which all orders err together, in standard deviations: by slow changes, and by a motion that has
    /// not settled.
    pub(crate) fn common_directions(&self) -> impl Iterator<Item = &DMatrix<Complex64>> {
        self.orders.common.directions.iter().chain(&self.decays)
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

/// Orders that free decays of the structure leave in a reduction.
fn decays(
    baseline: &Baseline<'_>,
    recording: &Recording,
    orders: &Orders,
    settings: &ReductionSettings,
) -> Vec<DMatrix<Complex64>> {
    let names: Vec<&str> = orders.channels.iter().map(String::as_str).collect();
    let first_s = orders.angle.edges_s()[0];
    let mut all = Vec::new();
    for pole in baseline.first_order.poles() {
        if pole.im <= 0.0 || pole.re >= 0.0 {
            continue;
        }
        let Some(shape) = mode_shape(&baseline.first_order, pole) else {
            continue;
        };
        for part in [Complex64::ONE, Complex64::i()] {
            let mut decay = recording.clone();
            let mut share: f64 = 0.0;
            for channel in &mut decay.channels {
                let Some(pickup) = baseline
                    .pickup(&channel.name)
                    .filter(|_| names.contains(&channel.name.as_str()))
                else {
                    continue;
                };
                let size = rms(&channel.samples);
                let moved: Complex64 = pickup
                    .weights
                    .iter()
                    .zip(&shape)
                    .map(|(weight, shape)| shape * *weight)
                    .sum();
                let amplitude = match pickup.quantity {
                    Quantity::Force => Complex64::ZERO,
                    quantity => part * moved * pole.powi(derivatives(quantity)),
                };
                share = share.max(amplitude.norm() / size.max(f64::MIN_POSITIVE));
                for (index, sample) in channel.samples.iter_mut().enumerate() {
                    let t = index as f64 / recording.sample_rate_hz - first_s;
                    *sample = if t < 0.0 {
                        0.0
                    } else {
                        (amplitude * (pole * t).exp()).re
                    };
                }
            }
            if share == 0.0 {
                continue;
            }
            if let Ok(reduced) = Orders::with_angle(&decay, &names, orders.angle.clone(), settings) {
                all.push(reduced.amplitudes / Complex64::from(share));
            }
        }
    }
    all
}

/// Motion of the tool along x, y, z in the mode of a pole.
fn mode_shape(structure: &FirstOrder, pole: Complex64) -> Option<[Complex64; 3]> {
    let vector = eigenvector(&structure.a.map(Complex64::from), pole)?;
    let moved = structure.c.map(Complex64::from) * vector;
    Some(std::array::from_fn(|axis| moved[axis]))
}
