//! Orders of the time derivatives that channels measure, and time integrals of Fourier series with the coefficients of
//! 1, cos, sin, cos 2 …

use nalgebra::DVector;

use quietcut_recording::Quantity;

/// Order of the time derivative of displacement that a motion channel measures: 1 for velocity, 2 for acceleration,
/// else 0.
pub(crate) fn derivative(quantity: Quantity) -> u8 {
    match quantity {
        Quantity::Velocity => 1,
        Quantity::Acceleration => 2,
        _ => 0,
    }
}

/// Fourier coefficients of the `order`-fold time integral of a series with the coefficients `x` and the fundamental
/// frequency `omega`, rad/s. An integral has zero mean; order 0 keeps the mean of `x`.
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
