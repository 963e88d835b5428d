//! The part of the error of the amplitudes that moves all orders together: slow changes of speed or force.
//!
//! The record is cut into blocks of whole revolutions that overlap by half, each longer than the slowest decay, and
//! combined to B blocks with independent noise (`block_noise`). Their deviations from the record, whitened by the spectrum
//! between the lines, are vectors u_b of D = 2·K·C real components: independent, with unit variance, if no change is
//! common to the orders. The eigenvectors of Σ u_b u_bᵀ/B with significantly large eigenvalues are common directions.
//!
//! Changes are taken as independent from block to block: those slower than a block make the stated variance too small,
//! and are seen in the amplitudes of the blocks.
//!
//! Test: the phases of the u_b are drawn anew, independently for each order and block, which keeps all variances and
//! destroys what orders have in common. A direction is significant if its eigenvalue exceeds those of the draws but for
//! a share of [`FALSE_DIRECTION`]. Its eigenvalue and its error are those of a spiked covariance (Paul, Statist. Sinica
//! 17 (2007) 1617): with γ = D/B, an eigenvalue λ of the covariance gives one of λ + γλ/(λ − 1) in the sample.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::eigenvalues::of_symmetric;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Error rate of the test of a direction.
pub(crate) const FALSE_DIRECTION: f64 = 0.01;

/// Number of draws of the test. The share of the draws is known to 1/200; two of 200 are [`FALSE_DIRECTION`].
const DRAWS: usize = 199;

/// Largest number of blocks that follow each other; those between, which overlap two of them by half, make it nearly
/// twice as many. Fifteen blocks estimate a variance with a relative error of √(2/13) = 39 %; more blocks are shorter,
/// and slow changes make their means dependent.
pub(crate) const BLOCKS_MAX: f64 = 8.0;

/// Fewest blocks that follow each other of which a common part is estimated: with those between they are five, and
/// Student's t has four degrees of freedom.
pub(crate) const BLOCKS_MIN: f64 = 3.0;

/// Fewest independent combinations of blocks: Student's t with four degrees of freedom.
const FEWEST_INDEPENDENT: usize = 4;

/// Low-rank part of the covariance of the amplitudes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Common {
    /// Directions v, one matrix of orders and channels each. The error of the amplitudes contains Σ s v with independent
    /// real s of unit variance.
    pub directions: Vec<DMatrix<Complex64>>,
    /// Degrees of freedom of each variance: number of independent combinations of
    /// blocks.
    pub freedoms: f64,
}

impl Common {
    /// Factor on the covariance between the lines for the errors of the directions: with r directions from B blocks,
    /// the part of the error that their estimates miss has r/B of the covariance's own size.
    pub(crate) fn inflation(&self) -> f64 {
        match self.directions.len() {
            0 => 1.0,
            count => 1.0 + count as f64 / self.freedoms,
        }
    }

    /// From the deviations of the blocks, (order, channel) each, and the factors L_k of the covariances L_k L_kᴴ of a
    /// block between the lines. `of_record` is the variance of a weighted mean over the record, over that of a block.
    /// `independent` combines the blocks to ones whose noise is independent: see `block_noise`.
    pub(crate) fn new(
        deviations: &[DMatrix<Complex64>],
        factors: &[DMatrix<Complex64>],
        independent: &DMatrix<f64>,
        of_record: f64,
    ) -> Self {
        let count = independent.nrows();
        if count < FEWEST_INDEPENDENT {
            return Self::default();
        }
        let mut blocks = Blocks::whitened(deviations, factors, independent);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut directions = Vec::new();
        while directions.len() + 2 < count {
            let Some((largest, direction)) = blocks.largest() else {
                break;
            };
            let above = (0..DRAWS)
                .filter(|_| {
                    blocks
                        .with_drawn_phases(&mut random)
                        .largest()
                        .is_some_and(|(drawn, _)| drawn >= largest)
                })
                .count();
            if (above + 1) as f64 > FALSE_DIRECTION * (DRAWS + 1) as f64 {
                break;
            }
            blocks.remove(&direction);
            let Some(excess) = blocks.excess(largest, directions.len() + 1) else {
                break;
            };
            directions.push(direction.of(factors, (of_record * excess).sqrt()));
        }
        Self {
            directions,
            freedoms: count as f64,
        }
    }
}

/// Whitened deviations of the blocks: by block, the components of order 1, all channels, then of order 2 …
struct Blocks {
    channels: usize,
    of: Vec<DVector<Complex64>>,
}

/// A direction in the whitened components, of unit length in the real components.
struct Direction {
    channels: usize,
    components: DVector<Complex64>,
}

/// Inner product of the real components, which have unit variance if the complex ones have.
fn inner(a: &DVector<Complex64>, b: &DVector<Complex64>) -> f64 {
    2.0 * a.dotc(b).re
}

impl Blocks {
    fn whitened(
        deviations: &[DMatrix<Complex64>],
        factors: &[DMatrix<Complex64>],
        independent: &DMatrix<f64>,
    ) -> Self {
        let channels = factors.first().map_or(0, DMatrix::nrows);
        let white = |deviation: &DMatrix<Complex64>| {
            let orders = (1..factors.len()).flat_map(|order| {
                let right = deviation.row(order).transpose();
                let white = factors[order].solve_lower_triangular(&right).unwrap_or(right);
                white.iter().copied().collect::<Vec<_>>()
            });
            DVector::from_vec(orders.collect())
        };
        let blocks: Vec<DVector<Complex64>> = deviations.iter().map(white).collect();
        let combined = independent.row_iter().map(|row| {
            let mut sum = DVector::zeros(blocks[0].len());
            for (block, weight) in blocks.iter().zip(row.iter()) {
                sum += block * Complex64::from(*weight);
            }
            sum
        });
        Self {
            channels,
            of: combined.collect(),
        }
    }

    /// Largest eigenvalue of Σ u uᵀ/B and its eigenvector.
    fn largest(&self) -> Option<(f64, Direction)> {
        let count = self.of.len();
        let products = DMatrix::from_fn(count, count, |i, j| {
            if i < j {
                0.0
            } else {
                inner(&self.of[i], &self.of[j])
            }
        });
        let eigen = of_symmetric(products).ok()?;
        let (index, largest) = eigen.eigenvalues.argmax();
        if largest <= 0.0 {
            return None;
        }
        let weights = eigen.eigenvectors.column(index);
        let mut components = DVector::zeros(self.of[0].len());
        for (block, weight) in self.of.iter().zip(weights.iter()) {
            components += block * Complex64::from(*weight);
        }
        components /= Complex64::from(largest.sqrt());
        let channels = self.channels;
        Some((largest / count as f64, Direction { channels, components }))
    }

    fn with_drawn_phases(&self, random: &mut ChaCha8Rng) -> Self {
        let of = self.of.iter().map(|block| {
            let mut drawn = block.clone();
            for order in drawn.as_mut_slice().chunks_mut(self.channels) {
                let phase = Complex64::from_polar(1.0, TAU * random.random::<f64>());
                order.iter_mut().for_each(|value| *value *= phase);
            }
            drawn
        });
        Self {
            channels: self.channels,
            of: of.collect(),
        }
    }

    fn remove(&mut self, direction: &Direction) {
        for block in &mut self.of {
            let score = inner(&direction.components, block);
            *block -= &direction.components * Complex64::from(score);
        }
    }

    /// Variance, beyond that between the lines, in a direction with the sample eigenvalue `largest`, after `removed`
    /// directions with this one are removed; `None` if the eigenvalue is not above those of noise.
    fn excess(&self, largest: f64, removed: usize) -> Option<f64> {
        let free = self.of.len() as f64;
        let ratio = 2.0 * self.of[0].len() as f64 / free;
        let whole: f64 = self.of.iter().map(|block| inner(block, block)).sum::<f64>() / free;
        // The other eigenvalues of the sample are γ times the noise variance on average.
        let noise = whole / (free - removed as f64).max(1.0) / ratio;
        let sum = largest / noise + 1.0 - ratio;
        let square = sum * sum - 4.0 * largest / noise;
        (square >= 0.0 && sum > 0.0).then(|| noise * (0.5 * (sum + square.sqrt()) - 1.0).max(0.0))
    }
}

impl Direction {
    /// The direction in orders and channels, `scale` times as long.
    fn of(&self, factors: &[DMatrix<Complex64>], scale: f64) -> DMatrix<Complex64> {
        let mut direction = DMatrix::zeros(factors.len(), self.channels);
        for (order, white) in self.components.as_slice().chunks(self.channels).enumerate() {
            let white = DVector::from_column_slice(white);
            let row = &factors[order + 1] * white * Complex64::from(scale);
            direction.set_row(order + 1, &row.transpose());
        }
        direction
    }
}
