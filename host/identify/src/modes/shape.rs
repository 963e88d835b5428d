//! Residues of rank one, and their left and right shapes.

use nalgebra::DMatrix;
use num_complex::Complex64;

/// R/(s − λ) and its conjugate at the conjugate pole.
pub(super) fn pair(residue: Complex64, s: Complex64, pole: Complex64) -> Complex64 {
    residue / (s - pole) + residue.conj() / (s - pole.conj())
}

/// The nearest right·leftᵀ to a matrix of residues (responses by forces), and how much of the matrix it leaves, as a part.
pub(crate) fn rank_one(residues: &DMatrix<Complex64>) -> Option<(Vec<Complex64>, Vec<Complex64>, f64)> {
    let all = residues.norm();
    let svd = residues.clone().try_svd(true, true, f64::EPSILON, 0)?;
    let (u, v) = (svd.u?, svd.v_t?);
    let largest = svd.singular_values.imax();
    let root = svd.singular_values[largest].sqrt();
    let right: Vec<Complex64> = u.column(largest).iter().map(|entry| entry * root).collect();
    let left: Vec<Complex64> = v.row(largest).iter().map(|entry| entry * root).collect();
    let rest: f64 = svd
        .singular_values
        .iter()
        .enumerate()
        .filter(|(index, _)| *index != largest)
        .map(|(_, value)| value * value)
        .sum();
    Some((right, left, if all > 0.0 { rest.sqrt() / all } else { 0.0 }))
}

/// Scales right by c and left by 1/c, so that both have one norm over the `shared` entries (index in right, in left) and
/// are as near to each other as can be: those of a reciprocal structure become equal. Without a shared entry the norms
/// of the whole shapes become one. The largest entry of the right shape has a positive real part.
pub(crate) fn normalize(right: &mut [Complex64], left: &mut [Complex64], shared: &[(usize, usize)]) {
    let norm = |shape: &[Complex64]| shape.iter().map(|entry| entry.norm_sqr()).sum::<f64>().sqrt();
    let pick = |shape: &[Complex64], of: &dyn Fn(&(usize, usize)) -> usize| -> Vec<Complex64> {
        shared.iter().map(|both| shape[of(both)]).collect()
    };
    let (at_right, at_left) = (pick(right, &|both| both.0), pick(left, &|both| both.1));
    let norms = match (norm(&at_right), norm(&at_left)) {
        (r, l) if r > 0.0 && l > 0.0 => (r, l),
        _ => (norm(right), norm(left)),
    };
    if !(norms.0 > 0.0 && norms.1 > 0.0) {
        return;
    }
    // ‖c·right − left/c‖ is least where c²·Σ right·conj(left) is real and positive.
    let inner: Complex64 = at_right.iter().zip(&at_left).map(|(r, l)| r * l.conj()).sum();
    let phase = if inner.norm() > 0.0 {
        -0.5 * inner.arg()
    } else {
        0.0
    };
    let mut scale = Complex64::from_polar((norms.1 / norms.0).sqrt(), phase);
    let largest = right.iter().max_by(|a, b| a.norm().total_cmp(&b.norm()));
    if largest.is_some_and(|entry| (entry * scale).re < 0.0) {
        scale = -scale;
    }
    for entry in right {
        *entry *= scale;
    }
    for entry in left {
        *entry /= scale;
    }
}
