//! A first-order section of a sensor's transfer function.

use num_complex::Complex64;

/// A first-order section H(s) = (b₀ + b₁·s)/(1 + T·s) of the transfer function from the measured quantity to the
/// reading. With b₁ = 0 it is a low pass, with b₀ = 0 the high pass of a coupling capacitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstOrderSection {
    /// Gain b₀ at the frequency 0.
    pub static_gain: f64,
    /// Coefficient b₁ of the derivative of the measured quantity, s.
    pub derivative_s: f64,
    /// Time constant T, s, positive.
    pub time_constant_s: f64,
}

impl FirstOrderSection {
    /// A low pass 1/(1 + T·s) with the time constant T, s.
    pub const fn low_pass(time_constant_s: f64) -> Self {
        Self {
            static_gain: 1.0,
            derivative_s: 0.0,
            time_constant_s,
        }
    }

    /// Value H(s) of this section; s = iω for a harmonic motion, and a pole of the structure for a free decay.
    pub fn at(&self, s: Complex64) -> Complex64 {
        (self.static_gain + self.derivative_s * s) / (1.0 + self.time_constant_s * s)
    }
}
