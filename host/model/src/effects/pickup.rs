//! The reading of a channel.

use num_complex::Complex64;
use quietcut_recording::Quantity;

use super::FirstOrderSection;

/// The reading of a channel: a weighted sum of the measured quantity along the machine's axes, delayed, and filtered by
/// the dynamics of the sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Pickup {
    /// Name of the channel, such as `ax`, `y` or `fx`.
    pub name: String,
    /// The measured quantity, such as force, displacement, velocity or acceleration.
    pub quantity: Quantity,
    /// Weights of the measured quantity along the machine's x, y and z in the reading, gain included.
    pub weights: [f64; 3],
    /// Ratio of the motion of the sensor to that of the tool in each mode of a structure given by modes, in the order
    /// of the modes. Empty if no mode has a ratio of its own.
    pub modes: Vec<f64>,
    /// Delay of the reading behind the measured quantity, s.
    pub delay_s: f64,
    /// Dynamics of the sensor: sections of its transfer function, in series. Empty for an ideal sensor.
    pub sections: Vec<FirstOrderSection>,
}

impl Pickup {
    /// An error-free channel of one axis: 0, 1, 2 for x, y, z.
    pub fn of_axis(quantity: Quantity, axis: usize) -> Self {
        let prefix = match quantity {
            Quantity::Force => "f",
            Quantity::Velocity => "v",
            Quantity::Acceleration => "a",
            _ => "",
        };
        let mut weights = [0.0; 3];
        weights[axis] = 1.0;
        Self {
            name: format!("{prefix}{}", ["x", "y", "z"][axis]),
            quantity,
            weights,
            modes: Vec::new(),
            delay_s: 0.0,
            sections: Vec::new(),
        }
    }

    /// Transfer function of the sensor's dynamics at s, rad/s: the product of the [sections](Self::sections), without
    /// weights and delay.
    pub fn dynamics(&self, s: Complex64) -> Complex64 {
        self.sections
            .iter()
            .fold(Complex64::ONE, |product, section| product * section.at(s))
    }

    /// Weighted sum of the components `value` of the measured quantity along x, y and z: the reading without delay and
    /// sensor dynamics.
    pub fn read(&self, value: [f64; 3]) -> f64 {
        self.weights
            .iter()
            .zip(value)
            .map(|(weight, value)| weight * value)
            .sum()
    }
}
