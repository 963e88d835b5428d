//! Derivatives of natural frequency and damping ratio by the real and the imaginary part of the pole.

use std::f64::consts::TAU;

/// Derivatives of the natural frequency |λ|/2π, Hz, and of the damping ratio ζ = −Re λ/|λ|, each by the real and by the
/// imaginary part of the pole λ, rad/s.
pub(super) fn pole_derivatives(pole: num_complex::Complex64) -> ([f64; 2], [f64; 2]) {
    let omega = pole.norm();
    let of_frequency = [pole.re / omega / TAU, pole.im / omega / TAU];
    let of_damping = [
        -pole.im * pole.im / omega.powi(3),
        pole.re * pole.im / omega.powi(3),
    ];
    (of_frequency, of_damping)
}
