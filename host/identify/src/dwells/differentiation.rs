//! Derivatives and integrals of Fourier coefficients 1, cos, sin, cos 2 …

use nalgebra::DVector;

use quietcut_recording::Quantity;

/// Order of differentiation of a channel with respect to displacement.
pub(crate) fn derivative(quantity: Quantity) -> u8 {
    match quantity {
        Quantity::Velocity => 1,
        Quantity::Acceleration => 2,
        _ => 0,
    }
}

/// Fourier coefficients of the `order`-fold integral.
pub(crate) fn undo(x: &DVector<f64>, order: u8, omega: f64) -> DVector<f64> {
    let mut integral = x.clone();
    for _ in 0..order {
        integral[0] = 0.0;
        for h in 1..=x.len() / 2 {
            let (c, s) = (integral[2 * h - 1], integral[2 * h]);
            let factor = 1.0 / (h as f64 * omega);
            (integral[2 * h - 1], integral[2 * h]) = (-factor * s, factor * c);
        }
    }
    integral
}
