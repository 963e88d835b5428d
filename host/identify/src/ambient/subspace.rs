//! Output-only modes: covariance-driven stochastic subspace identification (SSI-cov) with intervals.
//!
//! The covariances R_k = E[y(t + k) y(t)ᵀ] = C A^(k−1) G of a structure under white noise are those of a free decay.
//! Their block Hankel matrix is the product of an observability matrix O and a controllability matrix. Its left
//! singular vectors are O in some basis, and the state matrix A follows from the shift of O by one block row (Peeters
//! and De Roeck 1999). White sensor noise affects R₀ alone, which is not used. The covariance of the modes comes from
//! the scatter between blocks of the record: the poles are differentiated along the deviation of the Hankel matrix of
//! each block from the mean (Döhler and Mevel 2013 do the same by perturbation theory). Modal masses are not
//! identified, because the force is not measured.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix};
use num_complex::Complex64;
use quietcut_numerics::eigenvalues::{EigenvalueError, of_real};
use quietcut_numerics::singular_values::{SingularValueError, Vectors, decompose, singular_values};
use rayon::prelude::*;

use super::recording::Ambient;
use crate::criteria::{AMBIENT_BLOCKS, LARGEST_AMBIENT_DAMPING, SAME_MODE};
use quietcut_numerics::statistics::{NINETY_PERCENT, student_ninety_percent};

/// A mode from ambient vibration with standard deviations; the half-width of its 90 % intervals is 1.645 standard
/// deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmbientMode {
    /// Natural frequency |λ|/2π, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the natural frequency, Hz.
    pub frequency_deviation_hz: f64,
    /// Damping ratio −Re λ/|λ|.
    pub damping_ratio: f64,
    /// Standard deviation of the damping ratio.
    pub damping_deviation: f64,
}

/// Modes identified from a record.
#[derive(Clone, Debug, PartialEq)]
pub struct AmbientModes {
    /// The modes within the band that keep their natural frequency at a higher model order, by ascending frequency.
    pub modes: Vec<AmbientMode>,
    /// Order of the state-space model: the number of singular values of the covariances' Hankel matrix that exceed the
    /// scatter between blocks of the record, rounded up to an even number and limited by the size of the matrix.
    pub order: usize,
    /// Number of blocks into which the record was divided; the scatter between them gives the standard deviations.
    pub blocks: usize,
}

/// Reason why a record of ambient vibration gives no modes.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AmbientError {
    /// The record is too short for modes from the lower end of the band on.
    #[error(
        "{seconds:.1} s are too short to identify modes above {low_hz} Hz with intervals; at least {needed_s:.1} s are needed"
    )]
    TooShort {
        /// Duration of the record, s.
        seconds: f64,
        /// Lowest frequency of the band, Hz.
        low_hz: f64,
        /// Duration needed, s.
        needed_s: f64,
    },
    /// No mode in the band with an admissible damping ratio exceeds the noise and keeps its frequency at a higher model
    /// order.
    #[error("no mode between {0} and {1} Hz exceeds the noise; record longer, or excite the structure more")]
    NoMode(f64, f64),
    /// The singular values of the covariances cannot be computed.
    #[error(transparent)]
    SingularValues(#[from] SingularValueError),
    /// The poles of the state-space model cannot be computed.
    #[error(transparent)]
    Poles(#[from] EigenvalueError),
}

/// Smallest ratio of the length of a block of an ambient record to the longest lag of its covariances. At this ratio
/// the correlation between neighbouring blocks is negligible.
const BLOCK_LENGTH: usize = 6;

/// Range of lags of the covariances that a block column of the Hankel matrix spans, in periods of the lowest frequency
/// of the band; in samples it is limited to 6 to 60. A choice.
const PERIODS: f64 = 1.5;

/// Step of the numerical derivative of the poles along the deviation of a block's Hankel matrix from the mean matrix,
/// relative to that deviation. A choice: far below the scatter of the mean, far above rounding.
const STEP: f64 = 1e-3;

/// Identifies the modes of a record of ambient vibration in the frequency band from `low_hz` to `high_hz`.
///
/// # Errors
/// See [`AmbientError`]; for example, the record is too short, or no mode exceeds the noise.
pub fn modes(ambient: &Ambient, [low_hz, high_hz]: [f64; 2]) -> Result<AmbientModes, AmbientError> {
    let rows = ((PERIODS * ambient.rate_hz / low_hz).ceil() as usize).clamp(6, 60);
    let samples = ambient.channels.first().map_or(0, Vec::len);
    let block = BLOCK_LENGTH * 2 * rows;
    let blocks = (samples.saturating_sub(2 * rows) / block).min(AMBIENT_BLOCKS[1]);
    if blocks < AMBIENT_BLOCKS[0] {
        return Err(AmbientError::TooShort {
            seconds: ambient.seconds(),
            low_hz,
            needed_s: (AMBIENT_BLOCKS[0] * block + 2 * rows) as f64 / ambient.rate_hz,
        });
    }
    let length = (samples - 2 * rows) / blocks;
    let of_blocks: Vec<DMatrix<f64>> = (0..blocks)
        .into_par_iter()
        .map(|block| hankel(&ambient.channels, block * length..(block + 1) * length, rows))
        .collect();
    let size = of_blocks[0].shape();
    let mean = of_blocks
        .iter()
        .fold(DMatrix::zeros(size.0, size.1), |sum, part| sum + part)
        / blocks as f64;
    let record = Record {
        channels: ambient.channels.len(),
        rate_hz: ambient.rate_hz,
        band_hz: [low_hz, high_hz],
        mean,
        of_blocks,
    };
    let order = record.order()?;
    if order == 0 {
        return Err(AmbientError::NoMode(low_hz, high_hz));
    }
    let found = record.modes(order)?;
    let larger = record.poles(&record.mean, order + 4)?.unwrap_or_default();
    let modes: Vec<AmbientMode> = found
        .into_iter()
        .filter(|mode| {
            larger.iter().any(|pole| {
                let moved = (pole.norm() / TAU - mode.frequency_hz).abs();
                moved < SAME_MODE.0 * mode.frequency_hz || moved < SAME_MODE.1 * mode.frequency_deviation_hz
            })
        })
        .collect();
    if modes.is_empty() {
        return Err(AmbientError::NoMode(low_hz, high_hz));
    }
    Ok(AmbientModes { modes, order, blocks })
}

impl AmbientMode {
    /// True if the 90 % interval of the damping ratio is wider than the ratio itself: the damping is not identifiable.
    pub fn is_vague(&self) -> bool {
        2.0 * NINETY_PERCENT * self.damping_deviation > self.damping_ratio
    }
}

struct Record {
    channels: usize,
    rate_hz: f64,
    band_hz: [f64; 2],
    mean: DMatrix<f64>,
    of_blocks: Vec<DMatrix<f64>>,
}

/// Block Hankel matrix of the covariances R_1 to R_(2i−1), estimated over a range of samples, with i = `rows` block
/// rows and columns.
fn hankel(channels: &[Vec<f64>], range: std::ops::Range<usize>, rows: usize) -> DMatrix<f64> {
    let count = channels.len();
    let covariance = |lag: usize, i: usize, j: usize| -> f64 {
        let (later, now) = (
            &channels[i][range.start + lag..range.end + lag],
            &channels[j][range.clone()],
        );
        later.iter().zip(now).map(|(a, b)| a * b).sum::<f64>() / range.len() as f64
    };
    let lags: Vec<DMatrix<f64>> = (1..2 * rows)
        .map(|lag| DMatrix::from_fn(count, count, |i, j| covariance(lag, i, j)))
        .collect();
    DMatrix::from_fn(rows * count, rows * count, |i, j| {
        lags[i / count + j / count][(i % count, j % count)]
    })
}

impl Record {
    /// Model order: the number of singular values of the mean Hankel matrix that exceed the largest one of its noise,
    /// limited by the size of the matrix. It is rounded up to an even number, since poles come in conjugate pairs.
    fn order(&self) -> Result<usize, AmbientError> {
        let values = singular_values(self.mean.clone())?;
        // Half the difference between the mean Hankel matrices of the even and of the odd blocks: pure noise, about as
        // large as the noise of the mean of all blocks.
        let count = self.of_blocks.len() as f64;
        let mut noise = DMatrix::zeros(self.mean.nrows(), self.mean.ncols());
        for (index, block) in self.of_blocks.iter().enumerate() {
            noise += (block - &self.mean) * (if index % 2 == 0 { 1.0 } else { -1.0 } / count);
        }
        let level = singular_values(noise)?.max();
        let above = values.iter().filter(|value| **value > level).count();
        // The shift of the observability matrix requires fewer states than rows.
        Ok((above.div_ceil(2) * 2).min(self.mean.nrows() - self.channels - 4) & !1)
    }

    /// Poles with positive imaginary part of the state-space model that follows from a Hankel matrix, rad/s; `None` if
    /// no model of this order exists.
    fn poles(&self, hankel: &DMatrix<f64>, order: usize) -> Result<Option<Vec<Complex64>>, AmbientError> {
        let Some(u) = decompose(hankel.clone(), Vectors::Left)?.u else {
            return Ok(None);
        };
        if order > u.ncols() {
            return Ok(None);
        }
        let rows = u.nrows() - self.channels;
        let (up, down) = (
            u.view((0, 0), (rows, order)),
            u.view((self.channels, 0), (rows, order)),
        );
        let Some(gram) = Cholesky::new(up.tr_mul(&up)) else {
            return Ok(None);
        };
        let poles = of_real(gram.solve(&up.tr_mul(&down)))?;
        Ok(Some(
            poles
                .iter()
                .filter(|pole| pole.im > 0.0)
                .map(|pole| pole.ln() * self.rate_hz)
                .collect(),
        ))
    }

    /// Modes of the mean Hankel matrix within the band, with a damping ratio between 0 and `LARGEST_AMBIENT_DAMPING`,
    /// by ascending frequency. Their standard deviations come from the deviations of the Hankel matrices of the blocks
    /// from the mean.
    fn modes(&self, order: usize) -> Result<Vec<AmbientMode>, AmbientError> {
        let [low_hz, high_hz] = self.band_hz;
        let is_mode = |pole: &Complex64| {
            let (hz, damping) = (pole.norm() / TAU, -pole.re / pole.norm());
            (low_hz..=high_hz).contains(&hz) && damping > 0.0 && damping < LARGEST_AMBIENT_DAMPING
        };
        let mut poles: Vec<Complex64> = self.poles(&self.mean, order)?.unwrap_or_default();
        poles.retain(is_mode);
        poles.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        let moved: Vec<Vec<Complex64>> = self
            .of_blocks
            .par_iter()
            .map(|block| {
                let there = &self.mean + (block - &self.mean) * STEP;
                Ok(self.poles(&there, order)?.unwrap_or_default())
            })
            .collect::<Result<_, AmbientError>>()?;
        let count = self.of_blocks.len() as f64;
        let few = student_ninety_percent(self.of_blocks.len() - 1) / NINETY_PERCENT;
        let modes = poles
            .iter()
            .map(|pole| {
                let (mut frequency, mut damping) = (0.0, 0.0);
                for poles in &moved {
                    let nearest = poles
                        .iter()
                        .min_by(|a, b| (*a - pole).norm().total_cmp(&(*b - pole).norm()))
                        .unwrap_or(pole);
                    frequency += ((nearest.norm() - pole.norm()) / TAU / STEP).powi(2);
                    damping += ((pole.re / pole.norm() - nearest.re / nearest.norm()) / STEP).powi(2);
                }
                let deviation = |sum: f64| few * (sum / (count * (count - 1.0))).sqrt();
                AmbientMode {
                    frequency_hz: pole.norm() / TAU,
                    frequency_deviation_hz: deviation(frequency),
                    damping_ratio: -pole.re / pole.norm(),
                    damping_deviation: deviation(damping),
                }
            })
            .collect();
        Ok(modes)
    }
}
