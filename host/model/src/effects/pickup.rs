//! The reading of a channel.

use quietcut_recording::Quantity;

/// The reading of a channel: a mix of axes, scaled and delayed.
#[derive(Clone, Debug, PartialEq)]
pub struct Pickup {
    /// Its name: `ax`, `y`, `fx` …
    pub name: String,
    /// The measured quantity: force, displacement, velocity or acceleration.
    pub quantity: Quantity,
    /// The weights of the machine's x, y and z in the reading.
    pub weights: [f64; 3],
    /// For each mode of a modal structure: the ratio of the motion of the sensor to that of the tool. Empty where the sensor moves as
    /// the tool.
    pub modes: Vec<f64>,
    /// Its delay, s.
    pub delay_s: f64,
}

impl Pickup {
    /// A channel of one axis (0, 1, 2), without an error.
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
        }
    }

    /// The reading of a quantity along x, y and z.
    pub fn read(&self, value: [f64; 3]) -> f64 {
        self.weights
            .iter()
            .zip(value)
            .map(|(weight, value)| weight * value)
            .sum()
    }
}
