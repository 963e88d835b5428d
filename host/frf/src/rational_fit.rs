//! Vector fitting: a sum of modes with common poles fitted to measured receptances.
//!
//! The method is that of Gustavsen and Semlyen (1999) with common poles for all functions, where the unknowns of each
//! function are eliminated separately (Deschrijver and others, 2008). Tool-tip calibration and the removal of an
//! exponential window use its poles and residues. Fits with poles from other methods use only the function
//! [`residues`].

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::eigenvalues::{EigenvalueError, of_real};
use quietcut_numerics::least_squares::{MinimumNorm, Tolerance, eliminated};
use quietcut_numerics::singular_values::SingularValueError;

/// Number of times that a vector fit relocates its poles. A choice: the poles usually converge within a few
/// relocations.
const ROUNDS: usize = 20;

/// Bound on the singular values of a vector fit's equations, whose receptances or columns are normalized; combinations
/// of columns with a singular value up to the bound count as linearly dependent. It is about the rounding error of the
/// sums.
const DEPENDENT: Tolerance = Tolerance::Absolute(1e-13);

/// Error of fitting a sum of modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RationalFitError {
    /// No mode, fewer frequencies than 4 plus twice the number of modes, or no receptance other than zero.
    #[error("{lines} frequencies and {functions} functions other than zero do not determine {modes} modes")]
    Undetermined {
        /// Number of frequencies.
        lines: usize,
        /// Number of fitted receptances that are not zero at all frequencies.
        functions: usize,
        /// Number of modes.
        modes: usize,
    },
    /// The least-squares equations have no computable singular values.
    #[error(transparent)]
    Equations(#[from] SingularValueError),
    /// The list of the numbers of modes to try is empty.
    #[error("no model order is tried")]
    NoOrder,
    /// The poles cannot be computed.
    #[error(transparent)]
    Poles(#[from] EigenvalueError),
}

/// Poles and residues of a sum of modes H_k(s) = Σ_r [R_kr/(s − λ_r) + R*_kr/(s − λ*_r)] + d_k + e_k/s², s = iω, fitted
/// to receptances; d_k and e_k are not kept.
#[derive(Clone, Debug)]
pub struct RationalFit {
    /// Poles λ_r, rad/s: of a vector fit with positive, ascending imaginary parts; of a fit by [`residues`] the given
    /// ones.
    pub poles: Vec<Complex64>,
    /// Residues R_kr, m/(N s): one row for each function, one column for each pole.
    pub residues: Vec<Vec<Complex64>>,
    /// RMS residual of the fit over all receptances other than zero; each residual is divided by the RMS of its
    /// receptance. 0 if all receptances are zero.
    pub residual: f64,
}

impl RationalFit {
    /// Contribution of one mode to the receptance with the index `function` at `frequency_hz`, m/N: R/(s − λ) + R*/(s −
    /// λ*).
    pub(super) fn mode_at(&self, function: usize, mode: usize, frequency_hz: f64) -> Complex64 {
        let s = Complex64::new(0.0, TAU * frequency_hz);
        let (pole, residue) = (self.poles[mode], self.residues[function][mode]);
        residue / (s - pole) + residue.conj() / (s - pole.conj())
    }

    /// Natural frequency of a mode, Hz: |λ|/2π.
    pub(super) fn frequency_hz(&self, mode: usize) -> f64 {
        self.poles[mode].norm() / TAU
    }
}

/// Fits `modes` modes with common poles to the receptances `functions`, each with one value per frequency.
///
/// # Errors
/// There are fewer than 2 · `modes` + 4 frequencies, no modes or no receptance other than zero; a value is not finite,
/// or a frequency is 0; or an iteration exceeds its bound.
pub fn fit(
    frequency_hz: &[f64],
    functions: &[&[Complex64]],
    modes: usize,
) -> Result<RationalFit, RationalFitError> {
    let [first, .., last] = frequency_hz else {
        return Err(undetermined(frequency_hz, functions, modes));
    };
    // Start values of the poles: damping ratio about 1 %, equally spaced over the band.
    let start = (0..modes)
        .map(|mode| {
            let omega = TAU * (first + (last - first) * (mode as f64 + 0.5) / modes as f64);
            Complex64::new(-0.01 * omega, omega)
        })
        .collect();
    fit_from(frequency_hz, functions, start)
}

/// Fits as many modes with common poles as there are start values `poles`, rad/s with positive imaginary part, to the
/// receptances `functions`, each with one value per frequency.
///
/// # Errors
/// As [`fit`].
pub fn fit_from(
    frequency_hz: &[f64],
    functions: &[&[Complex64]],
    mut poles: Vec<Complex64>,
) -> Result<RationalFit, RationalFitError> {
    let modes = poles.len();
    if frequency_hz.len() < 2 * modes + 4 || modes == 0 {
        return Err(undetermined(frequency_hz, functions, modes));
    }
    for _ in 0..ROUNDS {
        poles = relocated(frequency_hz, functions, &poles)?;
    }
    poles.sort_by(|a, b| a.im.total_cmp(&b.im));
    residues(frequency_hz, functions, poles)
}

/// Basis functions of a pair of conjugate poles at s, whose real coefficients are the real and the imaginary part of
/// the residue.
fn pair(s: Complex64, pole: Complex64) -> [Complex64; 2] {
    let (a, b) = ((s - pole).inv(), (s - pole.conj()).inv());
    [a + b, Complex64::i() * (a - b)]
}

/// Basis functions of an FRF at one frequency: pole pairs, the constant 1/`scale` (modes above the band), and
/// `scale`/s² (modes below the band).
fn basis(frequency_hz: f64, poles: &[Complex64], scale: f64) -> Vec<Complex64> {
    let s = Complex64::new(0.0, TAU * frequency_hz);
    let mut row: Vec<Complex64> = poles.iter().flat_map(|&pole| pair(s, pole)).collect();
    row.push(Complex64::ONE / scale);
    row.push(scale / (s * s));
    row
}

/// Error of a vector fit whose data do not determine its unknowns.
fn undetermined(frequency_hz: &[f64], functions: &[&[Complex64]], modes: usize) -> RationalFitError {
    let is_zero = |function: &&&[Complex64]| function.iter().all(|h| h.norm_sqr() == 0.0);
    RationalFitError::Undetermined {
        lines: frequency_hz.len(),
        functions: functions.len() - functions.iter().filter(is_zero).count(),
        modes,
    }
}

/// Relocated poles of a vector fit: the [`zeros`] of σ(s) = 1 + Σ c_n φ_n(s), where φ_n are the functions [`pair`] of
/// the previous poles. The c_n are the coefficients with which σH is best fitted by the [`basis`] of these poles.
fn relocated(
    frequency_hz: &[f64],
    functions: &[&[Complex64]],
    poles: &[Complex64],
) -> Result<Vec<Complex64>, RationalFitError> {
    let own = 2 * poles.len();
    let scale = TAU * frequency_hz.last().copied().unwrap_or(0.0);
    let rows = 2 * frequency_hz.len();
    let mut left = DMatrix::<f64>::zeros(0, own);
    let mut right = DVector::<f64>::zeros(0);
    for function in functions {
        let norm = function.iter().map(|h| h.norm_sqr()).sum::<f64>().sqrt();
        if norm == 0.0 {
            continue;
        }
        let width = own + 2;
        let mut matrix = DMatrix::<f64>::zeros(rows, width + own + 1);
        for (k, (&hertz, h)) in frequency_hz.iter().zip(*function).enumerate() {
            let (h, row) = (h / norm, basis(hertz, poles, scale));
            for (column, value) in row.iter().enumerate() {
                matrix[(2 * k, column)] = value.re;
                matrix[(2 * k + 1, column)] = value.im;
                if column < own {
                    let product = -h * value;
                    matrix[(2 * k, width + column)] = product.re;
                    matrix[(2 * k + 1, width + column)] = product.im;
                }
            }
            matrix[(2 * k, width + own)] = h.re;
            matrix[(2 * k + 1, width + own)] = h.im;
        }
        // Eliminates the residues, the constant and the 1/s² term of this receptance: the remaining equations have only
        // the unknowns c_n, which all receptances share.
        let common = eliminated(matrix, width);
        let count = common.nrows().min(own);
        let at = left.nrows();
        left = left.resize_vertically(at + count, 0.0);
        right = right.resize_vertically(at + count, 0.0);
        left.rows_mut(at, count)
            .copy_from(&common.view((0, 0), (count, own)));
        right
            .rows_mut(at, count)
            .copy_from(&common.view((0, own), (count, 1)));
    }
    if left.nrows() < own {
        return Err(undetermined(frequency_hz, functions, poles.len()));
    }
    let c = MinimumNorm::new(left, DEPENDENT)?.solve(&right);
    Ok(zeros(poles, &c)?)
}

/// Zeros of σ = 1 + Σ c_n φ_n with positive imaginary part: eigenvalues of A − b cᵀ in real form, where A holds the
/// poles of σ and b the inputs of its state-space form. Zeros with positive real part are mirrored at the imaginary
/// axis. Other values replace real zeros, so that the number of poles is kept.
fn zeros(poles: &[Complex64], c: &DVector<f64>) -> Result<Vec<Complex64>, EigenvalueError> {
    let size = 2 * poles.len();
    let mut matrix = DMatrix::<f64>::zeros(size, size);
    for (n, pole) in poles.iter().enumerate() {
        let at = 2 * n;
        matrix[(at, at)] = pole.re;
        matrix[(at, at + 1)] = pole.im;
        matrix[(at + 1, at)] = -pole.im;
        matrix[(at + 1, at + 1)] = pole.re;
        for column in 0..size {
            matrix[(at, column)] -= 2.0 * c[column];
        }
    }
    let mut upper: Vec<Complex64> = of_real(matrix)?
        .iter()
        .filter(|value| value.im > 0.0)
        .map(|value| Complex64::new(-value.re.abs(), value.im))
        .collect();
    // A pair of real zeros of σ is not an oscillatory mode; it is replaced by a start value, at a frequency
    // proportional to that of the highest previous pole.
    let highest = poles.iter().map(|pole| pole.im).fold(0.0, f64::max);
    while upper.len() < poles.len() {
        let omega = highest * (0.9 + 0.05 * upper.len() as f64);
        upper.push(Complex64::new(-0.05 * omega, omega));
    }
    Ok(upper)
}

/// Residues of the receptances `functions` for given poles by linear least squares.
///
/// # Errors
/// There is no frequency, a frequency or pole gives a basis function that is not finite, or an iteration exceeds its
/// bound.
pub fn residues(
    frequency_hz: &[f64],
    functions: &[&[Complex64]],
    poles: Vec<Complex64>,
) -> Result<RationalFit, RationalFitError> {
    residues_of(frequency_hz, functions, poles, 2)
}

/// Residues of the receptances `functions` for given poles by linear least squares, without a constant and a term of
/// 1/s²: d_k = e_k = 0.
///
/// # Errors
/// As [`residues`].
pub fn residues_of_modes_alone(
    frequency_hz: &[f64],
    functions: &[&[Complex64]],
    poles: Vec<Complex64>,
) -> Result<RationalFit, RationalFitError> {
    residues_of(frequency_hz, functions, poles, 0)
}

/// Implements [`residues`] with the first `further` of the terms d_k and e_k/s².
fn residues_of(
    frequency_hz: &[f64],
    functions: &[&[Complex64]],
    poles: Vec<Complex64>,
    further: usize,
) -> Result<RationalFit, RationalFitError> {
    let scale = TAU * frequency_hz.last().copied().unwrap_or(0.0);
    let width = 2 * poles.len() + further;
    let mut matrix = DMatrix::<f64>::zeros(2 * frequency_hz.len(), width);
    for (k, &hertz) in frequency_hz.iter().enumerate() {
        for (column, value) in basis(hertz, &poles, scale).iter().take(width).enumerate() {
            matrix[(2 * k, column)] = value.re;
            matrix[(2 * k + 1, column)] = value.im;
        }
    }
    // The basis functions are normalized, since their magnitudes differ by many powers of ten.
    let norms: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
    for (mut column, norm) in matrix.column_iter_mut().zip(&norms) {
        if *norm > 0.0 {
            column /= *norm;
        }
    }
    let equations = MinimumNorm::new(matrix.clone(), DEPENDENT)?;
    let (mut all, mut residual) = (0.0, 0.0);
    let mut residues = Vec::with_capacity(functions.len());
    for function in functions {
        let values = function.iter().flat_map(|h| [h.re, h.im]);
        let right = DVector::from_iterator(2 * frequency_hz.len(), values);
        let solution = equations.solve(&right);
        // The squared residual of each receptance is divided by the squared norm of the receptance, so that all
        // receptances have equal weight in the RMS residual.
        let norm = right.norm_squared();
        if norm > 0.0 {
            residual += (&matrix * &solution - &right).norm_squared() / norm;
            all += 1.0;
        }
        let residue = |mode: usize| {
            Complex64::new(
                solution[2 * mode] / norms[2 * mode],
                solution[2 * mode + 1] / norms[2 * mode + 1],
            )
        };
        residues.push((0..poles.len()).map(residue).collect());
    }
    Ok(RationalFit {
        poles,
        residues,
        residual: if all > 0.0 { (residual / all).sqrt() } else { 0.0 },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_of_a_fit_that_breaks_down_reaches_the_caller() {
        let frequency_hz: Vec<f64> = (0..40).map(|k| 5.0 + f64::from(k)).collect();
        let mut function = vec![Complex64::ONE; 40];
        let error = fit(&frequency_hz[..3], &[&function[..3]], 1).unwrap_err();
        assert!(error.to_string().starts_with("3 frequencies"), "{error}");
        let error = fit(&frequency_hz, &[&[Complex64::ZERO; 40]], 1).unwrap_err();
        assert!(
            matches!(error, RationalFitError::Undetermined { functions: 0, .. }),
            "{error}"
        );
        function[7].re = f64::NAN;
        let error = fit(&frequency_hz, &[&function], 2).unwrap_err();
        assert!(error.to_string().contains("check the data"), "{error}");
        let error = zeros(&[Complex64::new(-1.0, f64::INFINITY)], &DVector::zeros(2)).unwrap_err();
        assert!(error.to_string().contains("check the data"), "{error}");
    }

    #[test]
    fn poles_and_residues_of_known_modes_are_recovered() {
        let frequency_hz: Vec<f64> = (0..400).map(|k| 5.0 + 0.0625 * f64::from(k)).collect();
        let poles = [(8.9, 0.015), (10.4, 0.02), (17.5, 0.03)].map(|(hertz, damping): (f64, f64)| {
            TAU * hertz * Complex64::new(-damping, (1.0 - damping * damping).sqrt())
        });
        let residues = [
            [(1e-6, -2e-4), (0.0, -1e-4), (2e-5, -5e-4)],
            [(0.0, 1e-4), (1e-6, -3e-4), (0.0, -1e-5)],
        ];
        let function = |k: usize| -> Vec<Complex64> {
            let value = |hertz: &f64| {
                let s = Complex64::new(0.0, TAU * hertz);
                let modes = poles.iter().zip(residues[k]).map(|(pole, (re, im))| {
                    let residue = Complex64::new(re, im);
                    residue / (s - pole) + residue.conj() / (s - pole.conj())
                });
                modes.sum::<Complex64>() + 2e-7 + 1e-3 / (s * s)
            };
            frequency_hz.iter().map(value).collect()
        };
        let (a, b) = (function(0), function(1));
        let fit = fit(&frequency_hz, &[&a, &b], 3).unwrap();
        assert!(fit.residual < 1e-9, "{}", fit.residual);
        for (k, row) in residues.iter().enumerate() {
            for (mode, (pole, (re, im))) in poles.iter().zip(row).enumerate() {
                // Tolerance: rounding errors.
                assert!((fit.poles[mode] - pole).norm() < 1e-6 * pole.norm());
                let residue = Complex64::new(*re, *im);
                assert!((fit.residues[k][mode] - residue).norm() < 1e-5 * residue.norm());
            }
        }
    }
}
