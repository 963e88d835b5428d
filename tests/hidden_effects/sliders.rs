//! A joint as a sum of elastic sliders in parallel, and the branches of all laws with the positions of these sliders.

use super::law::Branch;

/// Number of sliders of a joint. The error of its force is about 1e-5 of it.
const COUNT: usize = 400;

/// Sliders by strength.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sliders {
    /// Stiffness, N/m, and strength, m, of each.
    each: Vec<[f64; 2]>,
}

impl Sliders {
    /// Sliders whose force on first loading is less than that of their stiffness by s·u·(u/u₀)^e up to the displacement
    /// `most_m`. The density of stiffness over strength φ is s·e·(e + 1)/u₀^e·φ^(e − 1); each slider has the stiffness of
    /// an interval of φ, and its mean strength.
    pub(crate) fn new(softening: f64, exponent: f64, reference_m: f64, most_m: f64) -> Self {
        let factor = softening * exponent * (exponent + 1.0) / reference_m.powf(exponent);
        // Small strengths are the more closely spaced.
        let limit = |k: usize| most_m * (k as f64 / COUNT as f64).powi(2);
        let of = |k: usize| {
            let integral = |power: f64| factor * (limit(k + 1).powf(power) - limit(k).powf(power)) / power;
            let stiffness = integral(exponent);
            [stiffness, integral(exponent + 1.0) / stiffness]
        };
        Self {
            each: (0..COUNT).map(of).collect(),
        }
    }

    /// Force on the tool at the displacement `u` without that of the springs at rest, N: each slider follows the tool at
    /// the distance of its strength.
    pub(crate) fn restoring(&self, u: f64, places: &[f64]) -> f64 {
        self.each
            .iter()
            .zip(places)
            .map(|([stiffness, strength], place)| -stiffness * place.clamp(u - strength, u + strength))
            .sum()
    }

    /// Moves the sliders to where they are at the displacement `u`.
    pub(crate) fn drag(&self, u: f64, places: &mut Vec<f64>) {
        places.resize(self.each.len(), 0.0);
        for ([_, strength], place) in self.each.iter().zip(places) {
            *place = place.clamp(u - strength, u + strength);
        }
    }
}

/// The branch of each law, and the positions of its sliders.
#[derive(Clone, Debug, Default)]
pub(crate) struct Branches {
    pub(crate) each: Vec<Branch>,
    /// By law; empty for a law without sliders.
    pub(crate) places: Vec<Vec<f64>>,
}

impl Branches {
    pub(crate) fn new(laws: usize) -> Self {
        Self {
            each: vec![0; laws],
            places: vec![Vec::new(); laws],
        }
    }
}
