//! Modes from trial cuts that chattered or stayed stable (inverse stability), without a force sensor.
//!
//! The mode shapes are those of a first guess; natural frequencies, damping ratios and stiffnesses are unknown. At
//! every cut the structure has a dominant Floquet multiplier μ (characteristic multiplier): the cut chatters if |μ| >
//! 1, at the frequency given by μ. With the errors of the set depth and the measured chatter frequency, every structure
//! has a likelihood of the observed outcomes. The posterior distribution, with a log-uniform prior within
//! [`PriorFactors`], is sampled by sequential Monte Carlo (Del Moral, Doucet and Jasra 2006). If structures in several
//! separate regions of the parameters explain the cuts, the sample can contain all of these regions.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::roots::bisection;
use quietcut_numerics::statistics::sample_quantile;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::criteria::{
    CERTAIN_DEVIATIONS, CUTS_PER_MISJUDGED, MISJUDGED_SHARE, VAGUE_SHARE, WRONG_DEPTH_DEVIATIONS,
    WRONG_FREQUENCY_DEVIATIONS,
};
use crate::cutting::observed_cut::ObservedCut;
use crate::modes::IdentifiedMode;
use crate::modes::shape::{normalize, rank_one};
use quietcut_model::structure::{Direction, FirstOrder, Mode};
use quietcut_numerics::statistics::NINETY_PERCENT;
use quietcut_stability::{Problem, StabilityError, point};

/// Width of the prior of the modal parameters: for each kind, the largest factor, up or down, from the first guess.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PriorFactors {
    /// Largest factor of natural frequencies.
    pub frequency: f64,
    /// Largest factor of damping ratios.
    pub damping: f64,
    /// Largest factor of stiffnesses.
    pub stiffness: f64,
}

impl Default for PriorFactors {
    fn default() -> Self {
        Self {
            frequency: 1.25,
            damping: 4.0,
            stiffness: 4.0,
        }
    }
}

/// Relative standard deviations of the axial depths and chatter frequencies of the trial cuts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutErrors {
    /// Relative standard deviation of the set axial depths.
    pub depth: f64,
    /// Relative standard deviation of the measured chatter frequencies.
    pub frequency: f64,
}

/// Prior and posterior distribution of a modal parameter, in the unit of the parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posterior {
    /// Median of the posterior.
    pub value: f64,
    /// 5 % and 95 % quantiles of the posterior distribution of the parameter.
    pub ci90: [f64; 2],
    /// 5 % and 95 % quantiles of the prior distribution of the parameter.
    pub prior: [f64; 2],
}

impl Posterior {
    /// Standard deviation of the logarithm of the parameter, as if its posterior distribution were log-normal with the
    /// same 90 % interval.
    pub fn deviation(&self) -> f64 {
        (self.ci90[1] / self.ci90[0]).ln() / (2.0 * NINETY_PERCENT)
    }

    /// True if the posterior interval of the parameter is wider than half of the prior interval on a logarithmic scale:
    /// the cuts do not identify it.
    pub fn is_vague(&self) -> bool {
        let width = |[low, high]: [f64; 2]| (high / low).ln();
        width(self.ci90) > VAGUE_SHARE * width(self.prior)
    }
}

/// Posterior distribution of frequency, damping ratio and stiffness of one mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseMode {
    /// Natural frequency, Hz.
    pub frequency_hz: Posterior,
    /// Damping ratio.
    pub damping_ratio: Posterior,
    /// Static stiffness of this mode alone along the axis (x, y or z) in which it is softest, N/m.
    pub stiffness_n_per_m: Posterior,
    /// Static stiffness of the mode in the first guess, N/m.
    pub start_stiffness_n_per_m: f64,
}

/// Reason why the trial cuts give no result.
#[derive(Debug, thiserror::Error)]
pub enum InverseError {
    /// The first guess has no oscillating mode with a full set of mode shapes.
    #[error("the first guess has no oscillating mode with a mode shape")]
    NoModes,
    /// Every sampled structure misjudges more than one in twenty of the trial cuts.
    #[error(
        "no structure within the prior explains the cuts: the best one misjudges {0} of {1}; another first guess, or other force coefficients, are needed"
    )]
    Unexplained(usize, usize),
    /// Stability cannot be computed.
    #[error(transparent)]
    Stability(#[from] StabilityError),
}

/// Number of particles of the sequential Monte Carlo sampler, each of which is one structure. A choice.
const PARTICLES: usize = 192;

/// Smallest effective sample size that one tempering step of the sequential Monte Carlo sampler leaves, as a fraction
/// of the number of particles. A choice.
const EFFECTIVE: f64 = 0.5;

/// Number of Metropolis moves of every particle of the sequential Monte Carlo sampler: after each tempering step but
/// the last, and after the last. A choice.
const MOVES: [usize; 2] = [2, 4];

/// Family of structures with the parameters θ: logarithms of the factors by which frequency, damping ratio and
/// stiffness differ from the first guess, mode by mode.
struct Family<'a> {
    start: &'a Problem,
    /// For each mode of the first guess, its pole λ, rad/s, and its projector P in the first-order form.
    modes: Vec<(Complex64, DMatrix<Complex64>)>,
    /// The trial cuts, those with a measured chatter frequency first: they restrict the parameters of the structure
    /// most.
    cuts: Vec<ObservedCut>,
    errors: CutErrors,
    /// Largest magnitude of each component of θ: the logarithms of the prior factors for frequency, damping and
    /// stiffness of each mode.
    half_widths: Vec<f64>,
}

/// Identifies modes from trial cuts; `start` contains the first guess and the force coefficients. Equal seeds give
/// equal results.
///
/// # Errors
/// See [`InverseError`].
pub fn modes(
    start: &Problem,
    cuts: &[ObservedCut],
    errors: CutErrors,
    prior: PriorFactors,
    seed: u64,
) -> Result<Vec<InverseMode>, InverseError> {
    let modes: Vec<_> = start
        .structure
        .modal_parts()
        .iter()
        .map(|part| {
            let (real, turned) = (part.moved(Complex64::ONE), part.moved(Complex64::I));
            // P is the projector of the mode. 2 Re P and 2 Re(iP) = −2 Im P, computed from the first-order form, give
            // it.
            let projector = real.zip_map(&turned, |re, im| Complex64::new(0.5 * re, -0.5 * im));
            (part.pole, projector)
        })
        .collect();
    if modes.is_empty() {
        return Err(InverseError::NoModes);
    }
    let of_mode = [prior.frequency.ln(), prior.damping.ln(), prior.stiffness.ln()];
    let mut ordered = cuts.to_vec();
    ordered.sort_by_key(|cut| cut.chatter_hz.is_none());
    let family = Family {
        start,
        half_widths: modes.iter().flat_map(|_| of_mode).collect(),
        modes,
        cuts: ordered,
        errors,
    };
    // Reports an error if stability cannot be computed for the first guess.
    for cut in cuts {
        point(start, cut.rpm, cut.depth_mm)?;
    }
    let particles = family.draw(seed);
    family.check(&particles)?;
    Ok(family.posteriors(&particles))
}

/// The modes of `start` in the directions of the machine, with the posterior medians `found` of their parameters, for a
/// case file.
///
/// Mode shapes are those of the first guess, scaled so that the product of right and left shape is the residue, about
/// ω/(2ik). The standard deviation of the residue is given to the left shape alone. The standard deviation of a
/// parameter is that of its logarithm times the median; the posterior correlation between parameters is lost. Two modes
/// with one pole, as of a round tool, become two modes of equal frequency.
pub fn identified_modes(start: &FirstOrder, found: &[InverseMode]) -> (Vec<Direction>, Vec<IdentifiedMode>) {
    let axes: Vec<usize> = (0..3)
        .filter(|&axis| start.c.row(axis).amax() > 0.0 && start.b.column(axis).amax() > 0.0)
        .collect();
    let names = [Direction::X, Direction::Y, Direction::Z];
    let shared: Vec<(usize, usize)> = (0..axes.len()).map(|place| (place, place)).collect();
    let mut modes = Vec::new();
    for (part, posterior) in start.modal_parts().iter().zip(found) {
        let at_start = (part.omega() / TAU, posterior.start_stiffness_n_per_m);
        let scale =
            posterior.frequency_hz.value / at_start.0 / (posterior.stiffness_n_per_m.value / at_start.1);
        let share = posterior
            .frequency_hz
            .deviation()
            .hypot(posterior.stiffness_n_per_m.deviation());
        let whole = part.residue(start) * Complex64::from(scale);
        let mut rest = DMatrix::from_fn(axes.len(), axes.len(), |i, j| whole[(axes[i], axes[j])]);
        let all = rest.norm();
        while let Some((mut right, mut left, _)) = rank_one(&rest) {
            let taken = DMatrix::from_fn(axes.len(), axes.len(), |i, j| right[i] * left[j]);
            // All rank-one parts of the residue have been extracted: the remainder is rounding.
            if taken.norm() <= 1e-9 * all {
                break;
            }
            rest -= taken;
            normalize(&mut right, &mut left, &shared);
            modes.push(IdentifiedMode {
                frequency_std_hz: posterior.frequency_hz.value * posterior.frequency_hz.deviation(),
                damping_ratio_std: posterior.damping_ratio.value * posterior.damping_ratio.deviation(),
                left_std: left
                    .iter()
                    .map(|z| [z.re, z.im].map(|x| share * x.abs()))
                    .collect(),
                right_std: vec![[0.0; 2]; right.len()],
                mode: Mode {
                    frequency_hz: posterior.frequency_hz.value,
                    damping_ratio: posterior.damping_ratio.value,
                    left,
                    right,
                },
            });
        }
    }
    (axes.into_iter().map(|axis| names[axis]).collect(), modes)
}

impl Family<'_> {
    /// The stability problem of the structure with the parameters θ.
    fn problem(&self, theta: &[f64]) -> Problem {
        let mut problem = self.start.clone();
        for ((pole, projector), factors) in self.modes.iter().zip(theta.chunks_exact(3)) {
            let [frequency, damping, stiffness] = [factors[0], factors[1], factors[2]].map(f64::exp);
            let (omega, zeta) = (
                pole.norm() * frequency,
                (-pole.re / pole.norm() * damping).min(0.99),
            );
            let moved = Complex64::new(-zeta, (1.0 - zeta * zeta).sqrt()) * omega;
            problem.structure.a += projector.map(|entry| 2.0 * ((moved - pole) * entry).re);
            // The residue of a mode is about ω/(2ik) with the stiffness k, so it scales with frequency over stiffness.
            let residue = frequency / stiffness;
            let part = projector.map(|entry| 2.0 * entry.re) * &self.start.structure.b;
            problem.structure.b += part * (residue - 1.0);
        }
        problem
    }

    /// Log-likelihood of the observed outcomes and chatter frequencies for the structure θ, and the number of trial
    /// cuts that the structure misjudges.
    ///
    /// Every cut lowers the log-likelihood. If it has fallen to `least` before the last cut, the evaluation stops and
    /// returns −∞. It also returns −∞ if the stability of a cut cannot be computed. In both cases all cuts count as
    /// misjudged.
    fn likelihood(&self, theta: &[f64], least: f64) -> (f64, usize) {
        let problem = self.problem(theta);
        let mut sum = 0.0;
        let mut wrong = 0;
        for cut in &self.cuts {
            if sum <= least {
                return (f64::NEG_INFINITY, self.cuts.len());
            }
            let step = 1.0 + self.errors.depth;
            let Ok(high) = point(&problem, cut.rpm, cut.depth_mm * step) else {
                return (f64::NEG_INFINITY, self.cuts.len());
            };
            let high_growth = high.multiplier_abs.ln();
            let deviations = if high_growth.abs() > CERTAIN_DEVIATIONS * self.errors.depth {
                high_growth.signum() * f64::INFINITY
            } else {
                let Ok(low) = point(&problem, cut.rpm, cut.depth_mm / step) else {
                    return (f64::NEG_INFINITY, self.cuts.len());
                };
                // The growth rate ln |μ| is interpolated linearly over the logarithm of the depth. A least slope keeps
                // the distance to the limit, in standard deviations of the depth, finite.
                let low_growth = low.multiplier_abs.ln();
                let slope = (0.5 * (high_growth - low_growth)).abs().max(1e-4);
                0.5 * (low_growth + high_growth) / slope
            };
            let toward = if cut.chatters { deviations } else { -deviations };
            sum += (MISJUDGED_SHARE + (1.0 - 2.0 * MISJUDGED_SHARE) * normal_share(toward)).ln();
            wrong += usize::from(toward < -WRONG_DEPTH_DEVIATIONS);
            if let (Some(measured), Some(predicted)) = (cut.chatter_hz, high.chatter_hz) {
                let off = (measured / predicted - 1.0) / self.errors.frequency;
                let density = (-0.5 * off * off).exp();
                sum += (MISJUDGED_SHARE * self.errors.frequency + (1.0 - MISJUDGED_SHARE) * density).ln();
                wrong +=
                    usize::from(off.abs() > WRONG_FREQUENCY_DEVIATIONS && toward >= -WRONG_DEPTH_DEVIATIONS);
            }
        }
        (sum, wrong)
    }

    fn is_possible(&self, theta: &[f64]) -> bool {
        theta
            .iter()
            .zip(&self.half_widths)
            .all(|(value, half)| value.abs() <= *half)
    }

    /// Draws equally weighted particles, approximately from the posterior distribution.
    fn draw(&self, seed: u64) -> Vec<Vec<f64>> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut particles: Vec<Vec<f64>> = (0..PARTICLES)
            .map(|_| {
                self.half_widths
                    .iter()
                    .map(|half| half * random.random_range(-1.0..1.0))
                    .collect()
            })
            .collect();
        let mut sums: Vec<f64> = particles
            .par_iter()
            .map(|theta| self.likelihood(theta, f64::NEG_INFINITY).0)
            .collect();
        let mut share = 0.0;
        let mut stage = 0;
        while share < 1.0 {
            let step = next_step(&sums, share);
            share += step;
            let weights: Vec<f64> = weights(&sums, step);
            // Systematic resampling uses one random number for all particles.
            let first: f64 = random.random_range(0.0..1.0);
            let chosen = systematic(&weights, first);
            particles = chosen.iter().map(|&index| particles[index].clone()).collect();
            sums = chosen.iter().map(|&index| sums[index]).collect();
            let root = scatter_root(&particles);
            let moves = MOVES[usize::from(share >= 1.0)];
            (particles, sums) = particles
                .par_iter()
                .zip(&sums)
                .enumerate()
                .map(|(index, (theta, sum))| {
                    let mut own = ChaCha8Rng::seed_from_u64(seed);
                    own.set_stream(1 + (stage * PARTICLES + index) as u64);
                    self.walk((theta.clone(), *sum), &root, share, moves, &mut own)
                })
                .unzip();
            stage += 1;
        }
        particles
    }

    /// Metropolis moves of a particle with alternating step lengths; returns the moved particle and its log-likelihood.
    fn walk(
        &self,
        (mut theta, mut sum): (Vec<f64>, f64),
        root: &DMatrix<f64>,
        share: f64,
        moves: usize,
        random: &mut ChaCha8Rng,
    ) -> (Vec<f64>, f64) {
        let size = theta.len();
        for step in 0..moves {
            let length = if step % 2 == 0 { 1.6 } else { 0.5 } / (size as f64).sqrt();
            let kick = DVector::from_fn(size, |_, _| -> f64 { StandardNormal.sample(random) });
            let kick = root * kick * length;
            let tried: Vec<f64> = theta
                .iter()
                .zip(kick.iter())
                .map(|(theta, kick)| theta + kick)
                .collect();
            let luck: f64 = random.random_range(0.0..1.0);
            if !self.is_possible(&tried) {
                continue;
            }
            let least = sum + luck.ln() / share;
            let (found, _) = self.likelihood(&tried, least);
            if found > least {
                (theta, sum) = (tried, found);
            }
        }
        (theta, sum)
    }

    fn check(&self, particles: &[Vec<f64>]) -> Result<(), InverseError> {
        let wrong = particles
            .par_iter()
            .map(|theta| self.likelihood(theta, f64::NEG_INFINITY).1)
            .min()
            .unwrap_or(0);
        // One cut in twenty may be misjudged for reasons outside the model.
        if wrong > self.cuts.len() / CUTS_PER_MISJUDGED {
            Err(InverseError::Unexplained(wrong, self.cuts.len()))
        } else {
            Ok(())
        }
    }

    fn posteriors(&self, particles: &[Vec<f64>]) -> Vec<InverseMode> {
        let structure = &self.start.structure;
        self.modes
            .iter()
            .enumerate()
            .map(|(mode, (pole, projector))| {
                // Static compliance matrix of this mode alone, m/N: −2 Re(C P B/λ).
                let at_rest = projector.map(|entry| -2.0 * (entry / pole).re);
                let compliance = &structure.c * at_rest * &structure.b;
                let stiffness = 1.0 / (0..3).map(|axis| compliance[(axis, axis)]).fold(0.0, f64::max);
                let spread = |place: usize, at_start: f64| {
                    let index = 3 * mode + place;
                    let half = 0.9 * self.half_widths[index];
                    let mut values: Vec<f64> = particles.iter().map(|theta| theta[index]).collect();
                    values.sort_by(f64::total_cmp);
                    let quantile = |share: f64| {
                        let value = sample_quantile(&values, share).unwrap_or(f64::NAN);
                        at_start * value.exp()
                    };
                    Posterior {
                        value: quantile(0.5),
                        ci90: [quantile(0.05), quantile(0.95)],
                        prior: [at_start * (-half).exp(), at_start * half.exp()],
                    }
                };
                InverseMode {
                    frequency_hz: spread(0, pole.norm() / TAU),
                    damping_ratio: spread(1, -pole.re / pole.norm()),
                    stiffness_n_per_m: spread(2, stiffness),
                    start_stiffness_n_per_m: stiffness,
                }
            })
            .collect()
    }
}

/// Cumulative distribution function of the standard normal distribution.
fn normal_share(deviations: f64) -> f64 {
    0.5 * libm::erfc(-deviations * std::f64::consts::FRAC_1_SQRT_2)
}

/// Normalized particle weights after the likelihood exponent of the tempering grows by `step`; `sums` are the
/// log-likelihoods.
fn weights(sums: &[f64], step: f64) -> Vec<f64> {
    let best = sums.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let raw: Vec<f64> = sums.iter().map(|sum| (step * (sum - best)).exp()).collect();
    let total: f64 = raw.iter().sum();
    raw.iter().map(|weight| weight / total).collect()
}

/// Next increment of the likelihood exponent of the tempering: the largest one, up to the exponent 1, that keeps the
/// effective sample size at least at the share [`EFFECTIVE`] of the number of particles; at least 1e-6.
fn next_step(sums: &[f64], share: f64) -> f64 {
    let effective = |step: f64| 1.0 / weights(sums, step).iter().map(|w| w * w).sum::<f64>();
    let enough = EFFECTIVE * sums.len() as f64;
    let high = 1.0 - share;
    if effective(high) >= enough {
        return high;
    }
    // The bisection stops at 1e-12 of the range of increments: far below the scatter of the particles.
    let [low, _] = bisection([0.0, high], 1e-12 * high, |step| effective(step) >= enough);
    // A smallest increment of the likelihood exponent, 1e-6, guarantees that the tempering ends.
    low.max(1e-6).min(1.0 - share)
}

/// Index of the old particle that each new particle copies, by systematic resampling with the particle weights
/// `weights`; `first` is a random number from 0 to 1.
fn systematic(weights: &[f64], first: f64) -> Vec<usize> {
    let count = weights.len();
    let (mut index, mut below) = (0, weights[0]);
    (0..count)
        .map(|number| {
            let at = (number as f64 + first) / count as f64;
            while below < at && index + 1 < count {
                index += 1;
                below += weights[index];
            }
            index
        })
        .collect()
}

/// Cholesky factor of the covariance of the particles' parameters θ; 1e-3 times the identity if the factorization
/// fails.
fn scatter_root(particles: &[Vec<f64>]) -> DMatrix<f64> {
    let size = particles.first().map_or(0, Vec::len);
    let count = particles.len() as f64;
    let mut mean = DVector::zeros(size);
    for theta in particles {
        mean += DVector::from_column_slice(theta) / count;
    }
    let mut covariance = DMatrix::identity(size, size) * 1e-12;
    for theta in particles {
        let off = DVector::from_column_slice(theta) - &mean;
        covariance.ger(1.0 / count, &off, &off, 1.0);
    }
    Cholesky::new(covariance).map_or_else(|| DMatrix::identity(size, size) * 1e-3, |cholesky| cholesky.l())
}
