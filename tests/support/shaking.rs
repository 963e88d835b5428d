//! Random force on the structure, which models excitation by floor, drives and material.

use quietcut::simulate::Drive;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// White-noise force in each axis, constant over steps of 0.5 ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaking {
    /// One-sided spectral density (square root), N/√Hz.
    pub newton_per_root_hertz: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Force vector in N of each time step.
struct Steps(Vec<[f64; 3]>);

impl Shaking {
    /// Time step, s: about 1/100 of the period of the robot modes at 17 to 19 Hz, so that the force is white for them.
    const STEP_S: f64 = 0.5e-3;

    /// Random force from time 0 over this duration.
    pub fn for_seconds(self, seconds: f64) -> Box<dyn Drive> {
        let mut source = ChaCha8Rng::seed_from_u64(self.seed);
        let deviation_n = self.newton_per_root_hertz * (0.5 / Self::STEP_S).sqrt();
        let mut normal =
            || deviation_n * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut source);
        let steps = (seconds / Self::STEP_S).ceil() as usize;
        Box::new(Steps(
            (0..steps).map(|_| [normal(), normal(), normal()]).collect(),
        ))
    }
}

impl Drive for Steps {
    fn force_n(&self, t: f64) -> [f64; 3] {
        let step = (t / Shaking::STEP_S) as usize;
        self.0.get(step).copied().unwrap_or_default()
    }

    fn next_knot_s(&self, t: f64) -> f64 {
        // A time within 1e-9 steps of a step boundary counts as the boundary.
        ((t / Shaking::STEP_S + 1e-9).floor() + 1.0) * Shaking::STEP_S
    }
}
