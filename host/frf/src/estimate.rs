//! From power and cross spectra to frequency response functions, with what is known of their quality.

use super::cross_spectra::CrossSpectra;
use super::small_matrix::{
    Matrix, ZERO, adjoint, extreme_eigenvalues, inverse, product, product_adjoint, scaled, sum,
};

/// How spectra become a frequency response function. The names are the standard ones: equations (4.1) and (4.2) of
/// the thesis call them the other way round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// H1 = S_xf S_ff⁻¹: noise of the responses averages out.
    #[default]
    H1,
    /// H2 = S_xx S_fx⁻¹: noise of the forces averages out.
    H2,
    /// ½ (H1 + H2), equation (4.4).
    Mean,
    /// H = [S_xf,1 S_xf,2 …][S_ff,1 S_ff,2 …]⁺ over several tests, equation (7.12): the forces of each may be
    /// dependent, as long as those of all are not.
    PseudoInverse,
}

/// The smallest singular value of the forces, divided by their root mean squares, below which they count as dependent:
/// noise of a hundredth of a force then makes errors as large as the FRF.
pub(super) const DEPENDENT: f64 = 1e-2;

/// One frequency of an estimate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) frequency_hz: f64,
    /// Responses by forces, as they were measured: not yet displacements.
    pub(super) h: Matrix,
    /// Multiple coherence of each response, equation (7.10): the part of its power that the forces explain.
    pub(super) coherence: [f64; 3],
    /// Standard deviation of |H|.
    pub(super) deviation: [[f64; 3]; 3],
    /// Smallest and largest singular value of the forces, each divided by its root mean square.
    pub(super) singular: (f64, f64),
}

/// What an estimate needs to know.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// The first channels are forces,
    pub(super) forces: usize,
    /// and these many after them responses.
    pub(super) responses: usize,
}

/// The estimate at each line where it can be made.
///
/// `tests` have the same lines. H2 and the mean of several forces need as many responses as forces; the caller has
/// seen to it.
///
/// The random error is that of Bendat and Piersol, generalised to W in H = Σ S_xf,i W_i: the variance of H_pq is
/// Σ_i S_ee,p (W_iᴴ S_ff,i W_i)_qq / n_i with the power S_ee that the forces do not explain. With one force it is their
/// ε[|H|] = √(1 − γ²) / (|γ| √(2n)).
pub(super) fn lines(tests: &[CrossSpectra], shape: Shape, estimator: Estimator) -> Vec<Line> {
    let count = tests.first().map_or(0, |test| test.frequency_hz.len());
    (0..count)
        .filter_map(|index| line(tests, shape, estimator, index))
        .collect()
}

/// The spectra of one test at one line, per average.
struct Powers {
    averages: f64,
    ff: Matrix,
    xf: Matrix,
    xx: Matrix,
}

fn powers(test: &CrossSpectra, shape: Shape, index: usize) -> Powers {
    let block = |rows: (usize, usize), columns: (usize, usize)| {
        let mut block = ZERO;
        for (i, row) in block.iter_mut().enumerate().take(rows.1) {
            for (j, entry) in row.iter_mut().enumerate().take(columns.1) {
                *entry = test.at(index, rows.0 + i, columns.0 + j) / test.averages;
            }
        }
        block
    };
    let (forces, responses) = ((0, shape.forces), (shape.forces, shape.responses));
    Powers {
        averages: test.averages,
        ff: block(forces, forces),
        xf: block(responses, forces),
        xx: block(responses, responses),
    }
}

fn line(tests: &[CrossSpectra], shape: Shape, estimator: Estimator, index: usize) -> Option<Line> {
    let powers: Vec<Powers> = tests.iter().map(|test| powers(test, shape, index)).collect();
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
        Estimator::PseudoInverse => stacked(&powers, shape.forces)?,
        _ => {
            let (least, most) = extreme_eigenvalues(&ff, shape.forces);
            let inverse = inverse(&ff, shape.forces)?;
            let weights = powers
                .iter()
                .map(|test| scaled(&inverse, test.averages / averages))
                .collect();
            (weights, (least.max(0.0).sqrt(), most.max(0.0).sqrt()))
        }
    };
    let first = powers
        .iter()
        .zip(&weights)
        .fold(ZERO, |h, (test, weight): (_, &Matrix)| {
            sum(&h, &product(&test.xf, weight))
        });
    let h = match estimator {
        Estimator::H1 | Estimator::PseudoInverse => first,
        Estimator::H2 => second(&xf, &xx, shape)?,
        Estimator::Mean => scaled(&sum(&first, &second(&xf, &xx, shape)?), 0.5),
    };
    // Power of X − H1 F.
    let explained = product_adjoint(&xf, &first);
    let modelled = product_adjoint(&product(&first, &ff), &first);
    let unbiased = averages / (averages - shape.forces as f64).max(1.0);
    let mut line = Line {
        frequency_hz: tests.first()?.frequency_hz[index],
        h,
        coherence: [0.0; 3],
        deviation: [[0.0; 3]; 3],
        singular,
    };
    for p in 0..shape.responses {
        let power = xx[p][p].re;
        let rest = (power - 2.0 * explained[p][p].re + modelled[p][p].re).max(0.0);
        line.coherence[p] = if power > 0.0 {
            (1.0 - rest / power).clamp(0.0, 1.0)
        } else {
            0.0
        };
        for q in 0..shape.forces {
            let variance: f64 = powers
                .iter()
                .zip(&weights)
                .map(|(test, weight)| {
                    let spread = product(&adjoint(weight), &product(&test.ff, weight));
                    rest * unbiased * spread[q][q].re / test.averages
                })
                .sum();
            line.deviation[p][q] = (0.5 * variance.max(0.0)).sqrt();
        }
    }
    Some(line)
}

/// S_xx S_fx⁻¹; with one force for each response by itself, as it should be for one.
fn second(xf: &Matrix, xx: &Matrix, shape: Shape) -> Option<Matrix> {
    if shape.forces == 1 {
        let mut h = ZERO;
        for p in 0..shape.responses {
            let fx = xf[p][0].conj();
            h[p][0] = if fx.norm() > 0.0 { xx[p][p] / fx } else { xf[p][0] };
        }
        return Some(h);
    }
    let inverse = inverse(&adjoint(xf), shape.forces)?;
    Some(product(xx, &inverse))
}

/// The blocks W_i of the pseudo-inverse of [S_ff,1 S_ff,2 …], and its smallest and largest singular value after each
/// row has been divided by its norm.
///
/// With more columns than rows and full rank, S⁺ = Sᴴ (S Sᴴ)⁻¹.
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
