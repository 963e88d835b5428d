//! FRF estimators from auto- and cross-spectra, with coherence and random error.

use super::cross_spectra::CrossSpectra;
use super::small_matrix::{
    Matrix, ZERO, adjoint, extreme_eigenvalues, inverse, product, product_adjoint, scaled, sum,
};

/// Estimator of a frequency response function. The names H1 and H2 follow the standard use (Bendat and Piersol);
/// equations (4.1) and (4.2) of the thesis exchange them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// H1 = S_xf S_ff⁻¹: unbiased with noise in the responses only.
    #[default]
    H1,
    /// H2 = S_xx S_fx⁻¹: unbiased with noise in the forces only.
    H2,
    /// Mean ½ (H1 + H2), thesis eq. (4.4).
    Mean,
    /// Pseudo-inverse H = [S_xf,1 S_xf,2 …][S_ff,1 S_ff,2 …]⁺ over several tests (thesis eq. 7.12). The forces of a
    /// single test may be linearly dependent if those of all tests together are independent.
    PseudoInverse,
}

/// FRF estimate at one frequency line.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrfLine {
    pub(super) frequency_hz: f64,
    /// FRF matrix, rows responses, columns forces, both in the order of the channels; responses as measured, before
    /// integration to displacement.
    pub(super) h: Matrix,
    /// Multiple coherence (thesis eq. 7.10), by response: fraction of the power of the response that is linearly
    /// related to the forces.
    pub(super) coherence: [f64; 3],
    /// Standard deviation of the magnitude |H| of the estimate for each response (row) and force (column) from random
    /// errors, in the unit of `h`.
    pub(super) deviation: [[f64; 3]; 3],
    /// Largest relative error of the FRF by aliasing of content above half the sample rate, by response; estimated for
    /// hammer tests only, otherwise 0.
    pub(super) folding: [f64; 3],
    /// Smallest and largest singular value of the force spectra at this line, with each force divided by its root mean
    /// square; for the pseudo-inverse, those of the stacked matrices S_ff of all tests, with rows of unit norm.
    pub(super) singular: (f64, f64),
}

/// Number of force and response channels; the forces come first.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChannelCounts {
    /// Number of forces.
    pub(super) forces: usize,
    /// Number of responses.
    pub(super) responses: usize,
}

/// FRF estimate at every frequency line, except those at which a matrix to be inverted is singular: S_ff (for the
/// pseudo-inverse S Sᴴ, see `stacked`) and, for H2 and the mean with several forces, S_fx.
///
/// All `tests` have the same lines. For several forces, H2 and the mean require equal numbers of responses and forces;
/// the caller checks it.
///
/// Random error (Bendat and Piersol, generalised to H = Σ S_xf,i W_i): var H_pq = Σ_i S_ee,p (W_iᴴ S_ff,i W_i)_qq /
/// n_i, with the residual spectrum S_ee of the responses and n_i averages of test i; the variance of |H| is half of it.
/// S_ee is the power of X − H F with H from H1 or the pseudo-inverse (H2 and the mean take that of H1), times n/(n −
/// number of forces) with n = Σ n_i and a denominator of at least 1. For one force and large n: ε[|H|] = √(1 − γ²) /
/// (|γ| √(2n)).
pub(super) fn lines(tests: &[CrossSpectra], counts: ChannelCounts, estimator: Estimator) -> Vec<FrfLine> {
    let count = tests.first().map_or(0, |test| test.frequency_hz.len());
    (0..count)
        .filter_map(|index| line(tests, counts, estimator, index))
        .collect()
}

/// Spectra of one test at one frequency line, divided by the number of averages: S_ff of the forces, S_xf of the
/// responses with the forces, S_xx of the responses.
struct Powers {
    averages: f64,
    ff: Matrix,
    xf: Matrix,
    xx: Matrix,
}

fn powers(test: &CrossSpectra, counts: ChannelCounts, index: usize) -> Powers {
    let block = |rows: (usize, usize), columns: (usize, usize)| {
        let mut block = ZERO;
        for (i, row) in block.iter_mut().enumerate().take(rows.1) {
            for (j, entry) in row.iter_mut().enumerate().take(columns.1) {
                *entry = test.at(index, rows.0 + i, columns.0 + j) / test.averages;
            }
        }
        block
    };
    let (forces, responses) = ((0, counts.forces), (counts.forces, counts.responses));
    Powers {
        averages: test.averages,
        ff: block(forces, forces),
        xf: block(responses, forces),
        xx: block(responses, responses),
    }
}

fn line(
    tests: &[CrossSpectra],
    counts: ChannelCounts,
    estimator: Estimator,
    index: usize,
) -> Option<FrfLine> {
    let powers: Vec<Powers> = tests.iter().map(|test| powers(test, counts, index)).collect();
    let averages: f64 = powers.iter().map(|test| test.averages).sum();
    let total = |of: fn(&Powers) -> &Matrix| {
        powers.iter().fold(ZERO, |total, test| {
            sum(&total, &scaled(of(test), test.averages / averages))
        })
    };
    let (ff, xf, xx) = (
        total(|test| &test.ff),
        total(|test| &test.xf),
        total(|test| &test.xx),
    );
    let (weights, singular) = match estimator {
        Estimator::PseudoInverse => stacked(&powers, counts.forces)?,
        _ => {
            let (least, most) = extreme_eigenvalues(&ff, counts.forces);
            let inverse = inverse(&ff, counts.forces)?;
            let weights = powers
                .iter()
                .map(|test| scaled(&inverse, test.averages / averages))
                .collect();
            (weights, (least.max(0.0).sqrt(), most.max(0.0).sqrt()))
        }
    };
    let h1 = powers
        .iter()
        .zip(&weights)
        .fold(ZERO, |h, (test, weight): (_, &Matrix)| {
            sum(&h, &product(&test.xf, weight))
        });
    let h = match estimator {
        Estimator::H1 | Estimator::PseudoInverse => h1,
        Estimator::H2 => h2(&xf, &xx, counts)?,
        Estimator::Mean => scaled(&sum(&h1, &h2(&xf, &xx, counts)?), 0.5),
    };
    // Terms of the power of the residual X − H F of the responses with H = `h1`: S_xx − 2 Re(S_xf Hᴴ) + H S_ff Hᴴ.
    let explained = product_adjoint(&xf, &h1);
    let modelled = product_adjoint(&product(&h1, &ff), &h1);
    let unbiased = averages / (averages - counts.forces as f64).max(1.0);
    let mut line = FrfLine {
        frequency_hz: tests.first()?.frequency_hz[index],
        h,
        coherence: [0.0; 3],
        deviation: [[0.0; 3]; 3],
        folding: [0.0; 3],
        singular,
    };
    for p in 0..counts.responses {
        let power = xx[p][p].re;
        let residual = (power - 2.0 * explained[p][p].re + modelled[p][p].re).max(0.0);
        line.coherence[p] = if power > 0.0 {
            (1.0 - residual / power).clamp(0.0, 1.0)
        } else {
            0.0
        };
        for q in 0..counts.forces {
            let variance: f64 = powers
                .iter()
                .zip(&weights)
                .map(|(test, weight)| {
                    let spread = product(&adjoint(weight), &product(&test.ff, weight));
                    residual * unbiased * spread[q][q].re / test.averages
                })
                .sum();
            line.deviation[p][q] = (0.5 * variance.max(0.0)).sqrt();
        }
    }
    Some(line)
}

/// Estimate H2 = S_xx S_fx⁻¹. With one force, H2 is computed separately for each response, and is 0 where S_fx is 0;
/// with several, `None` if S_fx is singular.
fn h2(xf: &Matrix, xx: &Matrix, counts: ChannelCounts) -> Option<Matrix> {
    if counts.forces == 1 {
        let mut h = ZERO;
        for p in 0..counts.responses {
            let fx = xf[p][0].conj();
            h[p][0] = if fx.norm() > 0.0 { xx[p][p] / fx } else { xf[p][0] };
        }
        return Some(h);
    }
    let inverse = inverse(&adjoint(xf), counts.forces)?;
    Some(product(xx, &inverse))
}

/// Blocks W_i of the pseudo-inverse of the force spectra S = [S_ff,1 S_ff,2 …] of all tests i, and the smallest and
/// largest singular value of S with rows of unit norm.
///
/// For full row rank, S⁺ = Sᴴ (S Sᴴ)⁻¹. `None` if S Sᴴ is singular.
fn stacked(powers: &[Powers], forces: usize) -> Option<(Vec<Matrix>, (f64, f64))> {
    let gram = powers.iter().fold(ZERO, |gram, test| {
        sum(&gram, &product_adjoint(&test.ff, &test.ff))
    });
    let (least, most) = extreme_eigenvalues(&gram, forces);
    let inverse = inverse(&gram, forces)?;
    let weights = powers
        .iter()
        .map(|test| product(&adjoint(&test.ff), &inverse))
        .collect();
    Some((weights, (least.max(0.0).sqrt(), most.max(0.0).sqrt())))
}
