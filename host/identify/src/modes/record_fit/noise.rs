//! Noise variances of the channels of a record, estimated from the residual of a modal fit to whole records.
//!
//! The residual e is Gaussian with covariance C = Σ_c v_c B_c. B_c is one diagonal entry for the noise of a response,
//! and g gᴴ for the noise of a force with the column g of sⁿ H. So resonances in the residual indicate force noise. The
//! likelihood is maximized by Fisher scoring for the variances v_c: v = A⁻¹ b, A_cd = Σ tr(C⁻¹B_cC⁻¹B_d), b_c = Σ
//! eᴴC⁻¹B_cC⁻¹e over the lines.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use num_complex::Complex64;

use super::data::Data;
use super::line::{Line, gain};
use super::unknowns::{Transient, Unknowns};
use super::variances::Variances;
use crate::criteria::LEAST_RELATIVE_NOISE;
use quietcut_frf::ChannelLines;
use quietcut_numerics::eigenvalues::of_symmetric;
use quietcut_numerics::least_squares::{Idle, NormalEquations};

/// Number of Fisher scoring steps for the noise variances in each round of a modal fit to whole records. A choice;
/// later rounds continue the iteration.
const STEPS: usize = 10;

/// Smallest factor by which one scoring step may multiply a noise variance. A choice that damps the iteration.
const SHRINK: f64 = 0.1;

/// Least number of frequency lines in each band over which the spectral matrix of the forces is averaged; a record with
/// fewer lines has one band. With this number the smallest eigenvalue of the sample covariance of three noise channels
/// is rarely below [`EIGENVALUE`] times the variance (Marchenko and Pastur: (1 − √(3/64))² = 0.61).
const BAND: usize = 64;
/// Lower bound of the smallest eigenvalue of a sample covariance of noise over [`BAND`] lines, relative to the noise
/// variance; below the expected 0.61.
const EIGENVALUE: f64 = 0.5;

/// Ridge on the diagonal of the Fisher scoring matrix, scaled by the current noise variances, relative to the trace of
/// the scaled matrix. A choice, near the rounding error.
const RIDGE: f64 = 1e-12;

/// Smallest start value of the noise variance of a force channel, relative to the mean square of its transform in the
/// band. A choice.
const FORCE_START: f64 = 1e-6;

/// Start values of the noise variances of a record: the whole residual is attributed to noise of the responses, and the
/// variances of the forces start at their lower bounds, or at `FORCE_START` times the mean square if that is larger.
pub(super) fn start(data: &Data<'_>, record: usize, unknowns: &Unknowns) -> Variances {
    let spectra = &data.records[record];
    let mut variances = Variances {
        responses: data.sizes(record),
        forces: spectra
            .forces
            .iter()
            .map(|channel| lowest(channel).max(FORCE_START * mean_square(&channel.lines)))
            .collect(),
        measured: vec![0.0; spectra.forces.len()],
        disturbance: vec![Matrix3::zeros(); spectra.frequency_hz.len()],
    };
    let count = spectra.frequency_hz.len();
    let mut sums = vec![0.0; variances.responses.len()];
    for k in 0..count {
        if let Some(line) = Line::of(data, record, unknowns, &variances, k) {
            for (p, sum) in sums.iter_mut().enumerate() {
                *sum += line.left[p].norm_sqr();
            }
        }
    }
    for ((variance, sum), channel) in variances.responses.iter_mut().zip(sums).zip(&spectra.responses) {
        *variance = (sum / count as f64).max(least(channel));
    }
    variances
}

fn least(channel: &ChannelLines) -> f64 {
    (LEAST_RELATIVE_NOISE * channel.root_mean_square).powi(2)
}

/// Lower bound of the noise variance of a force channel: the larger one of the noise plateau of its spectrum, if it has
/// one, and the smallest assumed noise of a channel.
fn lowest(channel: &ChannelLines) -> f64 {
    channel.plateau.unwrap_or(0.0).max(least(channel))
}

fn mean_square(lines: &[Complex64]) -> f64 {
    lines.iter().map(|line| line.norm_sqr()).sum::<f64>() / lines.len().max(1) as f64
}

/// Updates the noise variances of a record. Returns the largest relative change of the residual covariance over every
/// 16th line.
pub(super) fn update(data: &Data<'_>, record: usize, unknowns: &Unknowns, variances: &mut Variances) -> f64 {
    let before = variances.clone();
    let responses = variances.responses.len();
    let spectra = &data.records[record];
    let values = 2.0 * (spectra.frequency_hz.len() * responses) as f64;
    // Number of parameters of transients and structure, divided by the number of records: they reduce the degrees of
    // freedom of the residual.
    let unknown = unknowns.transients.iter().map(Transient::width).sum::<usize>() / data.records.len()
        + unknowns.structure.parameters().len() / data.records.len();
    let unbiased = values / (values - unknown as f64).max(1.0);
    let mut change = 0.0;
    for _ in 0..STEPS {
        let Some((normal, right)) = scores(data, record, unknowns, variances) else {
            break;
        };
        let current: Vec<f64> = variances
            .responses
            .iter()
            .chain(&variances.forces)
            .copied()
            .collect();
        let bounds: Vec<f64> = spectra
            .responses
            .iter()
            .map(least)
            .chain(spectra.forces.iter().map(lowest))
            .collect();
        let Some(next) = scored(&normal, &(right * unbiased), &current, &bounds) else {
            break;
        };
        for (index, value) in next.into_iter().enumerate() {
            if index < responses {
                let most = mean_square(&spectra.responses[index].lines);
                variances.responses[index] = value.min(most.max(bounds[index]));
            } else {
                let most = mean_square(&spectra.forces[index - responses].lines);
                variances.forces[index - responses] = value.min(most.max(bounds[index]));
            }
        }
        divide(data, record, unknowns, variances);
    }
    // The variance of a single channel may be poorly determined; convergence is judged by the covariance of the
    // residual at every 16th line.
    for k in (0..spectra.frequency_hz.len()).step_by(16) {
        let pair = (
            Line::of(data, record, unknowns, &before, k),
            Line::of(data, record, unknowns, variances, k),
        );
        if let (Some(old), Some(new)) = pair {
            // tr(C_old C_new⁻¹) of the residual's covariances before and after the update, from their whitening
            // matrices.
            let mixed = new.whitening * old.whitening.try_inverse().unwrap_or_else(Matrix3::identity);
            let part = mixed.norm_squared() / 3.0;
            change = f64::max(change, (part - 1.0).abs());
        }
    }
    change
}

/// Solution of the scoring equations A v = b for the noise variances v with lower bounds: variances at a bound are
/// fixed there and the others are solved again. No variance falls below `SHRINK` times its current value. `None` if the
/// equations are singular.
fn scored(normal: &DMatrix<f64>, right: &DVector<f64>, current: &[f64], bounds: &[f64]) -> Option<Vec<f64>> {
    let mut next = current.to_vec();
    let mut free: Vec<usize> = (0..current.len()).collect();
    loop {
        // The scoring equations are scaled by the current variances, so that their unknowns are ratios near 1.
        let size = free.len();
        let mut scaled = DMatrix::from_fn(size, size, |i, j| {
            normal[(free[i], free[j])] * current[free[i]] * current[free[j]]
        });
        let trace = scaled.trace();
        let target = DVector::from_fn(size, |i, _| {
            let fixed = (0..current.len()).filter(|c| !free.contains(c));
            let known: f64 = fixed.map(|c| normal[(free[i], c)] * next[c]).sum();
            (right[free[i]] - known) * current[free[i]]
        });
        for i in 0..size {
            scaled[(i, i)] += RIDGE * trace;
        }
        let ratio = NormalEquations::new(&scaled, 0.0, Idle::Refuse)?.solve(&target);
        let below: Vec<usize> = (0..size)
            .filter(|&i| ratio[i] * current[free[i]] < bounds[free[i]])
            .map(|i| free[i])
            .collect();
        for (&c, ratio) in free.iter().zip(ratio.iter()) {
            next[c] = (current[c] * ratio.max(SHRINK)).max(bounds[c]);
        }
        if below.is_empty() || below.len() == free.len() {
            return Some(next);
        }
        free.retain(|c| !below.contains(c));
    }
}

/// Divides the apparent noise of each force into measurement noise and unmeasured forces. The variance V_f of the
/// measurement noise is at most the apparent noise. It is the noise plateau of the force spectrum, if there is one;
/// else it is the fraction of the apparent noise, common to all forces without a plateau, that the smallest eigenvalue
/// of the spectral matrix of the forces allows in every band. The rest is unmeasured force that acts on the structure.
fn divide(data: &Data<'_>, record: usize, unknowns: &Unknowns, variances: &mut Variances) {
    let spectra = &data.records[record];
    let count = spectra.frequency_hz.len();
    let forces = variances.forces.len();
    let bands = (count / BAND).max(1);
    let eigenvalue = |band: usize| -> f64 {
        let lines = band * count / bands..(band + 1) * count / bands;
        let power = DMatrix::from_fn(forces, forces, |i, j| {
            let (a, b) = (&spectra.forces[i].lines, &spectra.forces[j].lines);
            let sum: Complex64 = lines.clone().map(|k| a[k] * b[k].conj()).sum();
            sum / (lines.len() as f64 * (variances.forces[i] * variances.forces[j]).sqrt())
        });
        // A spectral matrix of the forces with non-finite entries gives no measurement noise.
        of_symmetric(power).map_or(0.0, |eigen| eigen.eigenvalues.min())
    };
    let least = (0..bands).map(eigenvalue).fold(f64::INFINITY, f64::min);
    let part = (least / EIGENVALUE).clamp(0.0, 1.0);
    for (q, channel) in spectra.forces.iter().enumerate() {
        let all = variances.forces[q];
        variances.measured[q] = channel.plateau.map_or(part * all, |plateau| plateau.min(all));
    }
    let unmeasured = Vector3::from_fn(|q, _| {
        let all = variances.forces.get(q).copied().unwrap_or(0.0);
        Complex64::from(all - variances.measured.get(q).copied().unwrap_or(0.0))
    });
    for (k, disturbance) in variances.disturbance.iter_mut().enumerate() {
        let gain = gain(data, record, unknowns, spectra.s(k));
        *disturbance = gain * Matrix3::from_diagonal(&unmeasured) * gain.adjoint();
    }
}

/// Fisher scoring matrix A_cd = Σ tr(C⁻¹B_cC⁻¹B_d) and right-hand side b_c = Σ eᴴC⁻¹B_cC⁻¹e for the noise variances of
/// the channels c: first the responses, then the forces. `None` if C is not positive definite at some line.
fn scores(
    data: &Data<'_>,
    record: usize,
    unknowns: &Unknowns,
    variances: &Variances,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let (responses, forces) = (variances.responses.len(), variances.forces.len());
    let size = responses + forces;
    let (mut normal, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
    for k in 0..data.records[record].frequency_hz.len() {
        let line = Line::of(data, record, unknowns, variances, k)?;
        // Every matrix B_c, by which the noise of channel c enters the covariance of the residual, is the product of a
        // column and its adjoint.
        let column = |c: usize| -> Vector3<Complex64> {
            if c < responses {
                Vector3::from_fn(|p, _| if p == c { Complex64::ONE } else { Complex64::ZERO })
            } else {
                line.gain.column(c - responses).into_owned()
            }
        };
        let white: [Vector3<Complex64>; 6] = std::array::from_fn(|c| {
            if c < size {
                line.whitening * column(c)
            } else {
                Vector3::zeros()
            }
        });
        for c in 0..size {
            right[c] += column(c).dotc(&line.weighted).norm_sqr();
            for d in 0..size {
                normal[(c, d)] += white[c].dotc(&white[d]).norm_sqr();
            }
        }
    }
    Some((normal, right))
}
