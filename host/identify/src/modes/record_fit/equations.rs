//! Normal equations of one record for the parameters of the structure (modes and terms outside the band), with the
//! transient of the record eliminated.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3};
use num_complex::Complex64;
use quietcut_numerics::least_squares::{Idle, NormalEquations};

use super::data::Data;
use super::line::{Line, of_forces, powers};
use super::unknowns::{SMOOTH, Unknowns};
use super::variances::Variances;

/// Number of frequency lines per block of the matrix products of the Jacobian. A choice that keeps a block in the
/// cache.
const BLOCK: usize = 64;

/// Ridge on the diagonal of the normal equations of a record's transient, relative to each diagonal entry; it
/// regularizes terms that the data do not determine. A choice, near the rounding error.
const RIDGE: f64 = 1e-12;

/// Normal equations that one record contributes for the parameters of the structure.
pub(super) struct Equations {
    /// Normal matrix for the structure after elimination of the transient: the Schur complement of Re(Jᴴ J), with the
    /// Jacobian J of the weighted residual by structure and transient.
    pub(super) normal: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    transients: NormalEquations,
    /// Block of Re(Jᴴ J) that couples transient and structure; rows transient, columns structure.
    mixed: DMatrix<f64>,
    of_transient: DVector<f64>,
}

impl Equations {
    /// Step of the record's transient parameters for a given step of the structure parameters.
    pub(super) fn transient(&self, step: &DVector<f64>) -> DVector<f64> {
        self.transients.solve(&(&self.of_transient - &self.mixed * step))
    }
}

/// Normal equations of a record for the structure and its own transient; `None` if they are singular or the residual's
/// covariance is not positive definite.
pub(super) fn equations(
    data: &Data<'_>,
    record: usize,
    unknowns: &Unknowns,
    variances: &Variances,
) -> Option<Equations> {
    let structure = unknowns.structure.parameters().len();
    let transient = unknowns.transients[record].width();
    let size = structure + transient;
    let responses = variances.responses.len();
    let lines = data.records[record].frequency_hz.len();
    let mut gram = DMatrix::<f64>::zeros(size + 1, size + 1);
    let mut rows = DMatrix::<f64>::zeros(size + 1, 2 * responses * BLOCK);
    let mut row = vec![Vector3::zeros(); size];
    for block in (0..lines).step_by(BLOCK) {
        let count = BLOCK.min(lines - block);
        for index in 0..count {
            let line = Line::of(data, record, unknowns, variances, block + index)?;
            of_structure(data, record, unknowns, &line, &line.force, &mut row[..structure]);
            of_transient(data, record, unknowns, &line, &mut row);
            let left = line.whitening * line.left;
            for (j, derivative) in row.iter().enumerate() {
                let white = line.whitening * derivative;
                for p in 0..responses {
                    rows[(j, 2 * (index * responses + p))] = white[p].re;
                    rows[(j, 2 * (index * responses + p) + 1)] = white[p].im;
                }
            }
            for p in 0..responses {
                rows[(size, 2 * (index * responses + p))] = left[p].re;
                rows[(size, 2 * (index * responses + p) + 1)] = left[p].im;
            }
        }
        let used = rows.columns(0, 2 * responses * count);
        gram.gemm(1.0, &used, &used.transpose(), 1.0);
    }
    eliminated(&gram, structure, transient)
}

fn eliminated(gram: &DMatrix<f64>, structure: usize, transient: usize) -> Option<Equations> {
    let size = structure + transient;
    let own = gram
        .view((structure, structure), (transient, transient))
        .into_owned();
    let transients = NormalEquations::new(&own, RIDGE, Idle::Hold)?;
    let mixed = gram.view((structure, 0), (transient, structure)).into_owned();
    let of_transient = gram
        .view((structure, size), (transient, 1))
        .column(0)
        .into_owned();
    Some(Equations {
        normal: gram.view((0, 0), (structure, structure)) - mixed.tr_mul(&transients.solve_columns(&mixed)),
        gradient: gram.view((0, size), (structure, 1)).column(0)
            - mixed.tr_mul(&transients.solve(&of_transient)),
        transients,
        mixed,
        of_transient,
    })
}

/// Contribution of the uncertainty of the estimated forces to the normal matrix Re(Jᴴ J), for forces with the
/// covariance P = V_f − V_f Gᴴ C⁻¹ G V_f, where G = sⁿ H. `None` if a covariance is not positive definite.
pub(super) fn of_force_noise(
    data: &Data<'_>,
    record: usize,
    unknowns: &Unknowns,
    variances: &Variances,
) -> Option<DMatrix<f64>> {
    let structure = unknowns.structure.parameters().len();
    let responses = variances.responses.len();
    let forces = variances.forces.len();
    let lines = data.records[record].frequency_hz.len();
    let root = of_forces(variances).map(|variance| Complex64::from(variance.re.sqrt()));
    let mut gram = DMatrix::<f64>::zeros(structure, structure);
    let mut rows = DMatrix::<f64>::zeros(structure, 2 * responses * forces * BLOCK);
    let mut row = vec![Vector3::zeros(); structure];
    for block in (0..lines).step_by(BLOCK) {
        let count = BLOCK.min(lines - block);
        for index in 0..count {
            let line = Line::of(data, record, unknowns, variances, block + index)?;
            let seen = line.whitening * line.gain * Matrix3::from_diagonal(&root);
            let rest = Matrix3::identity() - seen.adjoint() * seen;
            let spread = Matrix3::from_diagonal(&root) * Cholesky::new(rest)?.l();
            for q in 0..forces {
                of_structure(
                    data,
                    record,
                    unknowns,
                    &line,
                    &spread.column(q).into_owned(),
                    &mut row,
                );
                for (j, derivative) in row.iter().enumerate() {
                    let white = line.whitening * derivative;
                    for p in 0..responses {
                        let at = 2 * ((index * forces + q) * responses + p);
                        rows[(j, at)] = white[p].re;
                        rows[(j, at + 1)] = white[p].im;
                    }
                }
            }
        }
        let used = rows.columns(0, 2 * responses * forces * count);
        gram.gemm(1.0, &used, &used.transpose(), 1.0);
    }
    Some(gram)
}

/// Derivatives of the predicted response sⁿ H F + T, with the force F and the transient T, by the parameters of the
/// structure. The derivative of T by the poles is included only if F is the estimated force of the line itself.
fn of_structure(
    data: &Data<'_>,
    record: usize,
    unknowns: &Unknowns,
    line: &Line,
    force: &Vector3<Complex64>,
    row: &mut [Vector3<Complex64>],
) {
    row.fill(Vector3::zeros());
    let spectra = &data.records[record];
    let (responses, forces) = &data.axes[record];
    let is_own = force == &line.force;
    let (s, i) = (line.s, Complex64::i());
    let structure = &unknowns.structure;
    let mut at = 0;
    for (r, mode) in structure.modes.iter().enumerate() {
        let (a, b) = ((s - mode.pole).inv(), (s - mode.pole.conj()).inv());
        let sum = |left: &dyn Fn(usize) -> Complex64| -> Complex64 {
            forces.iter().enumerate().map(|(j, &q)| left(q) * force[j]).sum()
        };
        let driven = (sum(&|q| mode.left[q]), sum(&|q| mode.left[q].conj()));
        let rights = mode.right.len();
        for (k, (channel, &p)) in spectra.responses.iter().zip(responses).enumerate() {
            let derivative = s.powi(channel.derivatives);
            let mut put = |at: usize, up: Complex64, down: Complex64| {
                row[at][k] = up + down;
                row[at + 1][k] = i * (up - down);
            };
            let right = mode.right[p];
            let ringing = if is_own {
                unknowns.transients[record].residues[k][r]
            } else {
                Complex64::ZERO
            };
            put(
                at,
                (derivative * right * driven.0 + ringing) * a * a,
                (derivative * right.conj() * driven.1 + ringing.conj()) * b * b,
            );
            put(
                at + 2 + 2 * p,
                derivative * driven.0 * a,
                derivative * driven.1 * b,
            );
            for (j, &q) in forces.iter().enumerate() {
                put(
                    at + 2 + 2 * (rights + q),
                    derivative * right * force[j] * a,
                    derivative * right.conj() * force[j] * b,
                );
            }
        }
        at += mode.width();
    }
    for (index, &(p, q)) in data.places.iter().enumerate() {
        let place = (
            responses.iter().position(|&known| known == p),
            forces.iter().position(|&known| known == q),
        );
        if let (Some(k), Some(j)) = place {
            let driven = s.powi(spectra.responses[k].derivatives) * force[j];
            row[at + 2 * index][k] = driven;
            row[at + 2 * index + 1][k] = driven / (s * s);
        }
    }
}

/// Derivatives of a record's predicted responses by the parameters of its transient; their entries in `row` follow
/// those of the structure.
fn of_transient(
    data: &Data<'_>,
    record: usize,
    unknowns: &Unknowns,
    line: &Line,
    row: &mut [Vector3<Complex64>],
) {
    let transient = &unknowns.transients[record];
    let mut at = row.len() - transient.width();
    row[at..].fill(Vector3::zeros());
    for (k, residues) in transient.residues.iter().enumerate() {
        for (mode, _) in unknowns.structure.modes.iter().zip(residues) {
            let (a, b) = ((line.s - mode.pole).inv(), (line.s - mode.pole.conj()).inv());
            row[at][k] = a + b;
            row[at + 1][k] = Complex64::i() * (a - b);
            at += 2;
        }
    }
    let powers = powers(data, line.s);
    for (k, _) in transient.smooth.iter().enumerate() {
        for power in powers {
            row[at][k] = power;
            at += 1;
        }
    }
    debug_assert_eq!(at, row.len());
    debug_assert_eq!(powers.len(), SMOOTH);
}
