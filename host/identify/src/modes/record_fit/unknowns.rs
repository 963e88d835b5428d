//! Unknown parameters of a modal fit to whole records.

use nalgebra::DVector;
use num_complex::Complex64;

use crate::modes::pole_residue::PoleResidue;

/// Number of coefficients, per response, of the polynomial part of a record's transient.
pub(super) const SMOOTH: usize = 3;

/// The unknown parameters: modes of the structure with the terms outside the band, and the transient of each record.
#[derive(Clone)]
pub(super) struct Unknowns {
    pub(super) structure: PoleResidue,
    pub(super) transients: Vec<Transient>,
}

/// Transient of one record in each of its responses p: T_p(s) = Σ_r c_pr/(s − λ_r) + conjugate at the conjugate pole +
/// Σ_j a_pj (s/ω₀)ʲ. The poles λ_r are those of the structure, ω₀ is the mean angular frequency of the lines.
#[derive(Clone)]
pub(super) struct Transient {
    /// Residues c_pr of the transient, by response and mode.
    pub(super) residues: Vec<Vec<Complex64>>,
    /// Polynomial coefficients a_pj, by response and power j.
    pub(super) smooth: Vec<[f64; SMOOTH]>,
}

impl Unknowns {
    /// The unknown parameters after a step of the structure and of each transient. The step of a transient lists its
    /// residues by response and mode, then its polynomial coefficients.
    pub(super) fn moved(&self, structure: &DVector<f64>, transients: &[DVector<f64>]) -> Self {
        let mut moved = self.clone();
        moved.structure = self.structure.moved(structure.as_slice());
        for (transient, step) in moved.transients.iter_mut().zip(transients) {
            let mut values = step.iter();
            let mut next = || values.next().copied().unwrap_or(0.0);
            for residue in transient.residues.iter_mut().flatten() {
                *residue += Complex64::new(next(), next());
            }
            for value in transient.smooth.iter_mut().flatten() {
                *value += next();
            }
        }
        moved
    }
}

impl Transient {
    /// Number of real parameters of the transient of one record.
    pub(super) fn width(&self) -> usize {
        self.residues.iter().map(|row| 2 * row.len() + SMOOTH).sum()
    }
}
