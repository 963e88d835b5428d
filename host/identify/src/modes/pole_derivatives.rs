//! Natural frequency and damping ratio of a pole, by its real and imaginary part.

use std::f64::consts::TAU;

/// Derivatives of natural frequency, Hz, and damping ratio by real and imaginary part of the pole λ, rad/s, from
/// ω = |λ| and ζ = −Re λ/|λ|.
pub(super) fn pole_derivatives(pole: num_complex::Complex64) -> ([f64; 2], [f64; 2]) {
    let omega = pole.norm();
    let of_frequency = [pole.re / omega / TAU, pole.im / omega / TAU];
    let of_damping = [
        -pole.im * pole.im / omega.powi(3),
        pole.re * pole.im / omega.powi(3),
    ];
    (of_frequency, of_damping)
}
