//! Residue matrices of rank one, and the left and right shapes that they consist of.

use nalgebra::DMatrix;
use num_complex::Complex64;

/// Receptance of a residue R: R/(s − λ), plus its conjugate at the conjugate pole.
pub(super) fn pair(residue: Complex64, s: Complex64, pole: Complex64) -> Complex64 {
    residue / (s - pole) + residue.conj() / (s - pole.conj())
}

/// The nearest rank-one matrix right·leftᵀ to a matrix of residues (responses by forces), and the norm of the
/// difference relative to that of the matrix. `None` if the singular value decomposition fails.
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

/// Modal assurance criterion |aᴴb|²/(aᴴa · bᴴb) of two shapes; 0 if one of them is zero.
pub(super) fn assurance(a: &[Complex64], b: &[Complex64]) -> f64 {
    let power = |shape: &[Complex64]| shape.iter().map(|entry| entry.norm_sqr()).sum::<f64>();
    let sizes = power(a) * power(b);
    if sizes == 0.0 {
        return 0.0;
    }
    let inner: Complex64 = a.iter().zip(b).map(|(a, b)| a.conj() * b).sum();
    inner.norm_sqr() / sizes
}

/// Scales the right shape of a mode by a complex factor c and the left one by 1/c, unless one of them is zero. Then
/// both have equal norm over the `shared` entries (index in right, index in left) and differ as little as possible: the
/// shapes of a reciprocal structure become equal. Without a shared entry, or if one shape is zero in all of them, the
/// norms of the whole shapes become equal. The real part of the largest entry of the right shape does not become
/// negative.
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
    // The difference ‖c·right − left/c‖ is smallest if c²·Σ right·conj(left) is real and positive.
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
